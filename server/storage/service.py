"""Rules for checkpoints: what one would take, taking it, keeping it after all.

What a rule takes goes after as many days as the trash keeps things, and is as it was until then. What a training began
with, what somebody had evaluated, and what its run stands by on leaderboards stays whatever the rule says, which is asked
again at the moment of removal.
"""

import shutil
import time
from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session

from server.audit.repository import AuditRepository
from server.checkpoints.archives import LooseArchives, forget_recordings, remove_archives
from server.checkpoints.repository import CheckpointRepository
from server.curve_thinning.repository import rule_of
from server.database import tables
from server.events.changes import Change
from server.experiments.repository import ExperimentRepository
from server.http.paging import Window
from server.security.principal import Principal
from server.services import Services
from server.storage.repository import StorageRepository
from server.storage.rule import KEEP_ALL, KeepRule, Stored, staying
from server.storage.schemas import MOST_SPARED, SparedCheckpoint, Storage, StoredExperiment, Thinning

_DAY = 86_400.0


@dataclass(frozen=True)
class _Plan:
    """What a rule takes, leaves by itself, and leaves for a reason."""

    goes: list[tables.Checkpoint]
    stays: list[tables.Checkpoint]
    spared: dict[str, str]


class StorageService:
    """Tells what takes how much, and applies rules."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def page(self, principal: Principal, window: Window) -> Storage:
        """What experiments take, the largest first."""
        settings = self._services.settings
        with self._services.database.read() as session:
            repository = StorageRepository(session)
            experiments, total, size, going = repository.page(principal.visible, window)
            curves = repository.curve_bytes([experiment.id for experiment in experiments])
        return Storage(
            items=[self._view(experiment, curves.get(experiment.id, 0)) for experiment in experiments],
            total=total,
            checkpoint_bytes=size,
            going_bytes=going,
            free_bytes=shutil.disk_usage(settings.data_dir).free,
            min_free_bytes=settings.min_free_disk_bytes,
            keep_days=settings.trash_days,
        )

    def preview(self, experiment_id: str, rule: KeepRule) -> Thinning:
        """What a rule would take of an experiment now.

        Raises:
            NotFoundError: there is no such experiment.
        """
        with self._services.database.read() as session:
            experiment = ExperimentRepository(session).get(experiment_id)
            return _thinning(experiment, rule, _plan(session, experiment, rule))

    def state(self, experiment_id: str) -> Thinning:
        """What the rule takes that an experiment goes by.

        Raises:
            NotFoundError: there is no such experiment.
        """
        with self._services.database.read() as session:
            experiment = ExperimentRepository(session).get(experiment_id)
            rule = self._rule(experiment)
            return _thinning(experiment, rule, _plan(session, experiment, rule))

    def change(self, experiment_id: str, rule: KeepRule | None) -> Thinning:
        """Give an experiment a rule, or the installation's again, and say of each checkpoint whether it goes.

        Raises:
            NotFoundError: there is no such experiment.
        """
        with self._services.database.write() as session:
            experiment = ExperimentRepository(session).get(experiment_id)
            experiment.keep_rule = rule.model_dump(mode="json") if rule else None
            thinning = self._apply(session, experiment)
            AuditRepository(session).add(
                "experiment.rule_changed",
                target=experiment.id,
                name=experiment.name,
                project_id=experiment.project_id,
                details=f"{thinning.rule.model_dump_json()}: {thinning.going} checkpoints go",
            )
        self._publish(experiment_id)
        return thinning

    def free(self, experiment_id: str) -> None:
        """Let go now what goes of an experiment; the sweep removes it, some at a time.

        Raises:
            NotFoundError: there is no such experiment.
        """
        with self._services.database.write() as session:
            experiment = ExperimentRepository(session).get(experiment_id)
            hastened = StorageRepository(session).hasten(experiment_id, time.time())
            if hastened:
                AuditRepository(session).add(
                    "experiment.freed",
                    target=experiment.id,
                    name=experiment.name,
                    project_id=experiment.project_id,
                    details=f"{hastened} checkpoints go now",
                )
        self._services.storage_wake.ring()

    def apply_to_new(self, since: float, limit: int) -> tuple[int, float]:
        """Apply the rules of experiments that have got checkpoints after `since`.

        Returns:
            How many there were, `limit` at most, and when the newest of these checkpoints came.
        """
        with self._services.database.read() as session:
            found = StorageRepository(session).with_new(since, limit)
        for experiment_id, _ in found:
            with self._services.database.write() as session:
                experiment = session.get(tables.Experiment, experiment_id)
                if experiment is None or experiment.deleted_at is not None or self._rule(experiment).last is None:
                    continue
                changed = self._apply(session, experiment).going
            if changed:
                self._publish(experiment_id)
        return len(found), max((at for _, at in found), default=since)

    def remove_due(self, now: float, limit: int) -> int:
        """Remove some of what was to go by `now`; how many were looked at."""
        with self._services.database.read() as session:
            due = StorageRepository(session).due(now, limit)
            runs = {checkpoint.run_id: session.get_one(tables.Run, checkpoint.run_id).experiment_id for checkpoint in due}
        for experiment_id in dict.fromkeys(runs.values()):
            self._remove(experiment_id, [each.id for each in due if runs[each.run_id] == experiment_id])
        return len(due)

    @property
    def _default(self) -> KeepRule:
        return self._services.settings.keep_checkpoints or KEEP_ALL

    def _rule(self, experiment: tables.Experiment) -> KeepRule:
        return self._default if experiment.keep_rule is None else KeepRule.model_validate(experiment.keep_rule)

    def _apply(self, session: Session, experiment: tables.Experiment) -> Thinning:
        rule = self._rule(experiment)
        plan = _plan(session, experiment, rule)
        repository = StorageRepository(session)
        goes_at = time.time() + self._services.settings.trash_days * _DAY
        repository.mark([each.id for each in plan.goes if each.goes_at is None], goes_at)
        repository.mark([each.id for each in plan.stays if each.goes_at is not None], None)
        return _thinning(experiment, rule, plan)

    def _remove(self, experiment_id: str, checkpoint_ids: Sequence[str]) -> int:
        with self._services.database.write() as session:
            experiment = session.get(tables.Experiment, experiment_id)
            repository = StorageRepository(session)
            rows = [row for row in (session.get(tables.Checkpoint, each) for each in checkpoint_ids) if row is not None]
            if experiment is None or not rows:
                return 0
            reasons = repository.reasons(rows)
            last = {run_id: CheckpointRepository(session).last(run_id) for run_id in {row.run_id for row in rows}}
            kept = {row.id for row in rows if row.id in reasons or row is last[row.run_id]}
            repository.mark(kept, None)
            gone = [row for row in rows if row.id not in kept]
            size = sum(row.size for row in gone)
            repository.remove([row.id for row in gone])
            session.flush()
            archive_ids = LooseArchives(session).let_go([row.id for row in gone])
            if gone:
                AuditRepository(session).add(
                    "experiment.thinned",
                    target=experiment.id,
                    name=experiment.name,
                    project_id=experiment.project_id,
                    details=f"{len(gone)} checkpoints, {size} bytes",
                )
        remove_archives(self._services, archive_ids)
        forget_recordings(self._services, [row.sha256 for row in gone])
        self._publish(experiment_id)
        return len(gone)

    def _view(self, experiment: tables.Experiment, curves: int) -> StoredExperiment:
        return StoredExperiment(
            id=experiment.id,
            name=experiment.name,
            in_trash=experiment.deleted_at is not None,
            checkpoints=experiment.checkpoint_count,
            checkpoint_bytes=experiment.checkpoint_bytes,
            curve_bytes=curves,
            going=experiment.going_count,
            going_bytes=experiment.going_bytes,
            rule=self._rule(experiment),
            own_rule=experiment.keep_rule is not None,
            curve_rule=rule_of(experiment, self._services.settings.thin_curves),
            own_curve_rule=experiment.curve_rule is not None,
        )

    def _publish(self, experiment_id: str) -> None:
        self._services.bus.publish(Change(experiment_id=experiment_id, run_id=None, kind="checkpoint"))


def _plan(session: Session, experiment: tables.Experiment, rule: KeepRule) -> _Plan:
    repository = StorageRepository(session)
    goes: list[tables.Checkpoint] = []
    stays: list[tables.Checkpoint] = []
    for run_id, rows in repository.of_experiment(experiment.id).items():
        best = CheckpointRepository(session).best(run_id) if rule.best else None
        best_id = best[0].id if best else None
        stay = staying(rule, [Stored(row.id, row.damaged_at is None, row.id == best_id) for row in rows])
        for row in rows:
            (stays if row.id in stay else goes).append(row)
    spared = repository.reasons(goes)
    stays += [row for row in goes if row.id in spared]
    return _Plan([row for row in goes if row.id not in spared], stays, spared)


def _thinning(experiment: tables.Experiment, rule: KeepRule, plan: _Plan) -> Thinning:
    seeds = {run.id: run.seed for run in experiment.runs}
    spared = [row for row in plan.stays if row.id in plan.spared]
    return Thinning(
        rule=rule,
        going=len(plan.goes),
        going_bytes=sum(row.size for row in plan.goes),
        staying=len(plan.stays),
        spared=[
            SparedCheckpoint(id=row.id, seed=seeds[row.run_id], step=row.step, reason=plan.spared[row.id])
            for row in spared[:MOST_SPARED]
        ],
        spared_total=len(spared),
    )

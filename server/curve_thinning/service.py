"""Rules for curves: what one would do, doing it a piece at a time, and leaving it after all.

A run that a rule holds for is marked, and thinned after as many days as the trash keeps things; until then it is as it was.
What speaks against it is asked again at that moment. A piece is a few series in one transaction: one that is broken off
leaves the others thinned, and the run marked.
"""

import logging
import time
from collections.abc import Iterator
from dataclasses import dataclass

from sqlalchemy.orm import Session

from server.audit.repository import AuditRepository
from server.checkpoints.repository import CheckpointRepository
from server.curve_thinning.repository import DAY, CurveThinningRepository, rule_of
from server.curve_thinning.rule import CurveRule
from server.curve_thinning.schemas import CurveThinning
from server.database import tables
from server.errors import PartAwayError
from server.events.changes import Change
from server.experiments.repository import ExperimentRepository
from server.metrics.repository import MetricRepository
from server.metrics.thinning import Thinned, ThinningRepository, thinned
from server.runs import states
from server.runs.repository import PointsState, RunRepository
from server.services import Services
from workers.wording import counted

logger = logging.getLogger(__name__)

# Points that are read at once, unless one series alone has more.
_PIECE_POINTS = 500_000
# The newest whole checkpoints at which buckets end, so that a run that goes on from there loses nothing before it.
_STOPS = 8
# What a bucket takes: 14.3 in a run of 43 metrics of 100,000 points that wander with noise, 1,000 buckets each.
BUCKET_BYTES = 15


@dataclass(frozen=True)
class _Piece:
    """Some series of a run, thinned in memory.

    Attributes:
        state: of the run's points as they were read.
        series: what is left of each.
        last: whether no other series of the run has too many points.
        limit: of the rule.
    """

    state: PointsState
    series: list[Thinned]
    last: bool
    limit: int


class CurveThinningService:
    """Tells what a rule does to curves, and does it."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._default = services.settings.thin_curves

    def preview(self, experiment_id: str, rule: CurveRule | None) -> CurveThinning:
        """What a rule would do to the curves of an experiment now; without one, what the rule does that it goes by.

        Raises:
            NotFoundError: there is no such experiment.
        """
        with self._services.database.read() as session:
            experiment = ExperimentRepository(session).get(experiment_id)
            return _view(session, experiment, rule or rule_of(experiment, self._default), time.time())

    def change(self, experiment_id: str, rule: CurveRule | None) -> CurveThinning:
        """Give an experiment a rule, or the installation's again; the days until it is applied begin anew.

        Raises:
            NotFoundError: there is no such experiment.
        """
        with self._services.database.write() as session:
            experiment = ExperimentRepository(session).get(experiment_id)
            experiment.curve_rule = rule.model_dump(mode="json") if rule else None
            CurveThinningRepository(session).begin_anew(experiment_id)
            holds = rule_of(experiment, self._default)
            _note(session, experiment, "experiment.curve_rule_changed", holds.model_dump_json())
        self._services.curves_wake.ring()
        self._publish(experiment_id, None)
        return self.preview(experiment_id, None)

    def hasten(self, experiment_id: str) -> CurveThinning:
        """Thin now what is marked of an experiment; the sweep does it, a piece at a time.

        Raises:
            NotFoundError: there is no such experiment.
        """
        with self._services.database.write() as session:
            experiment = ExperimentRepository(session).get(experiment_id)
            hastened = CurveThinningRepository(session).hasten(experiment_id, time.time())
            if hastened:
                _note(session, experiment, "experiment.curves_hastened", f"curves of {hastened} runs are thinned now")
        self._services.curves_wake.ring()
        return self.preview(experiment_id, None)

    def mark_some(self, now: float, limit: int) -> int:
        """Look at some runs that a rule has come to hold for, and mark those that have too many points; how many it were."""
        with self._services.database.read() as session:
            found = CurveThinningRepository(session).unlooked(self._default, now, limit)
        for run_id in found:
            with self._services.database.write() as session:
                run = session.get(tables.Run, run_id, with_for_update=True)
                if run is None or run.state not in states.FINISHED:
                    continue
                points = rule_of(run.experiment, self._default).points
                if points is None:
                    continue
                # What waits counts too, and is out of the way.
                MetricRepository(session).compact(run_id)
                if ThinningRepository(session).longer_than([run_id], points):
                    run.thins_at = now + self._services.settings.trash_days * DAY
                else:
                    run.thin_enough = points
            if run.thins_at is not None:
                self._publish(run.experiment_id, run_id)
        return len(found)

    def spare_some(self) -> None:
        """Let runs be that were marked, and that no rule holds for any more."""
        with self._services.database.read() as session:
            found = CurveThinningRepository(session).without_rule(self._default)
        if not found:
            return
        with self._services.database.write() as session:
            CurveThinningRepository(session).spare(found)

    def thin_some(self, now: float) -> int:
        """Thin a piece of a run that was to be thinned by `now`; 0 where none was, else 1."""
        with self._services.database.read() as session:
            run_id = CurveThinningRepository(session).due(now)
        if run_id is None:
            return 0
        try:
            self._thin(run_id, now)
        except PartAwayError:
            raise
        except Exception:
            # The others are not to wait for one that can't be read.
            logger.exception("the curves of run %s could not be thinned: the next try is in a day", run_id)
            with self._services.database.write() as session:
                run = session.get(tables.Run, run_id, with_for_update=True)
                if run is not None and run.thins_at is not None:
                    run.thins_at = now + DAY
        return 1

    def _thin(self, run_id: str, now: float) -> None:
        with self._services.database.read() as session:
            piece = self._piece(session, run_id, now)
        with self._services.database.write() as session:
            run = session.get(tables.Run, run_id, with_for_update=True)
            if run is None:
                return
            if piece is None or not self._holds(session, run, now):
                run.thins_at = None
                return
            if PointsState.of(run) != piece.state:
                # Looked at once more.
                return
            if piece.series:
                MetricRepository(session).thin(run_id, piece.series)
                run.thinned_at = time.time()
            if piece.last:
                run.thins_at, run.thin_enough = None, piece.limit
                if run.thinned_at is not None and run.thinned_from is not None and run.thinned_to is not None:
                    told = f"{counted(run.thinned_from)} points to {counted(run.thinned_to)}"
                    RunRepository(session).add_event(run_id, "info", f"Curves were thinned: {told}.", run.step)
                    _note(session, run.experiment, "experiment.curves_thinned", f"seed {run.seed}: {told}")
            experiment_id = run.experiment_id
        self._publish(experiment_id, run_id)

    def _piece(self, session: Session, run_id: str, now: float) -> _Piece | None:
        """Some series of a run, thinned; None where it is not to be."""
        run = session.get(tables.Run, run_id)
        if run is None or not self._holds(session, run, now):
            return None
        limit = rule_of(run.experiment, self._default).points
        assert limit is not None
        counted = ThinningRepository(session).longer_than([run_id], limit)
        names = list(_some({name: count for (_, name), count in counted.items()}))
        points = MetricRepository(session).read(run_id, names)
        before = ThinningRepository(session).of([run_id], names)
        whole = CheckpointRepository(session).steps(run_id)
        stops = [each.step for each in whole[-_STOPS:]]
        series = [thinned(name, points[name], before.get((run_id, name)), limit, stops) for name in names]
        return _Piece(PointsState.of(run), series, len(names) == len(counted), limit)

    def _holds(self, session: Session, run: tables.Run, now: float) -> bool:
        """Whether a marked run is to be thinned."""
        rule = rule_of(run.experiment, self._default)
        return (
            rule.points is not None
            and run.state in states.FINISHED
            and run.finished_at is not None
            and run.finished_at <= now - rule.after_days * DAY
            and CurveThinningRepository(session).spared(run.experiment) is None
        )

    def _publish(self, experiment_id: str, run_id: str | None) -> None:
        self._services.bus.publish(Change(experiment_id=experiment_id, run_id=run_id, kind="run"))
        if run_id is not None:
            self._services.bus.publish(Change(experiment_id=experiment_id, run_id=run_id, kind="metrics"))


def _some(counted: dict[str, int]) -> Iterator[str]:
    """The first of these series, as many as are read at once; one at least, where there is one."""
    total = 0
    for name, count in counted.items():
        if total and total + count > _PIECE_POINTS:
            return
        total += count
        yield name


def _view(session: Session, experiment: tables.Experiment, rule: CurveRule, now: float) -> CurveThinning:
    repository = CurveThinningRepository(session)
    old = [
        run.id
        for run in experiment.runs
        if run.state in states.FINISHED and run.finished_at is not None and run.finished_at <= now - rule.after_days * DAY
    ]
    spared = repository.spared(experiment)
    found = repository.longest(old, rule.points) if rule.points is not None and spared is None else {}
    kept = sum(len(each.points) for each in found.values()) * (rule.points or 0)
    size = sum(each.size for each in found.values())
    marks = [run.thins_at for run in experiment.runs if run.thins_at is not None]
    return CurveThinning(
        rule=rule,
        runs=len(found),
        points=sum(sum(each.points.values()) for each in found.values()),
        kept=kept,
        frees=max(0, size - kept * BUCKET_BYTES),
        later=len(experiment.runs) - len(old),
        marked=len(marks),
        thins_at=min(marks, default=None),
        spared=spared,
    )


def _note(session: Session, experiment: tables.Experiment, action: str, details: str) -> None:
    AuditRepository(session).add(
        action, target=experiment.id, name=experiment.name, project_id=experiment.project_id, details=details
    )

"""What moves studies on: ended trials are scored, hopeless ones stopped, the next ones asked for, the best one is judged.

Nothing of it happens in a request, and all that it goes by is in the database: after a restart it goes on where it was. What
two servers would do at the same time is done by the one whose compare-and-set comes first.
"""

import logging
import time
from collections.abc import AsyncIterator, Mapping, Sequence
from contextlib import asynccontextmanager
from typing import Any

from pydantic import ValidationError

from server.audit.repository import AuditRepository
from server.background import kept_up
from server.checkpoints.repository import CheckpointRepository
from server.database import tables
from server.errors import PartAwayError
from server.events.changes import Change
from server.experiments.repository import ExperimentRepository
from server.ids import new_id
from server.runs import states
from server.runs.service import RunService, stop_run
from server.services import Services
from server.studies.importance_intervals import intervals
from server.studies.proposals import importances, propose
from server.studies.repository import StudyRepository
from server.studies.schemas import JUDGES, StudySpec
from server.studies.space import Space, Values, wording
from server.studies.trials import Verdict, cost, ended, rungs, told, unpromising
from workers.archive_size import refuse_too_large
from workers.config import TrainingConfig
from workers.errors import MemoryTooLargeError
from workers.protocol import queues_of

logger = logging.getLogger(__name__)

_PAUSE_SECONDS = 1.0
_LONGEST_NAME = 100
_MAX_SEED = 2**31 - 1


@asynccontextmanager
async def keep_studying(services: Services) -> AsyncIterator[None]:
    """Move every study on, for as long as the block lasts."""
    async with kept_up(
        lambda: advance(services),
        # All that there is to do is done in one look.
        at_once=1_000_000,
        pause=_PAUSE_SECONDS,
        failed="studies could not be moved on: the next look tries again",
    ):
        yield


def advance(services: Services) -> int:
    """One look at every study that goes on; how many there are. Blocks."""
    with services.database.read() as session:
        going_on = StudyRepository(session).going_on()
    for study_id in going_on:
        try:
            StudyMover(services, study_id).move()
        except PartAwayError:
            raise
        except Exception:
            # One that can't be read must not keep the others waiting.
            logger.exception("study %s could not be moved on: the next look tries again", study_id)
    return len(going_on)


class StudyMover:
    """Moves one study on."""

    def __init__(self, services: Services, study_id: str) -> None:
        self._services = services
        self._id = study_id
        self._runs = RunService(services)

    def move(self) -> None:
        """Do what is due."""
        with self._services.database.read() as session:
            study = StudyRepository(session).get(self._id)
        if study.state not in ("running", "judging"):
            self._weigh_late(study)
            return
        spec = spec_of(study)
        if study.state == "judging":
            self._end_judgement(study)
            return
        if self._settle(study, spec):
            self._weigh(spec)
        while self._ask(spec):
            pass
        self._judge(spec)

    def _settle(self, study: tables.Study, spec: StudySpec) -> bool:
        """Whether a trial has ended, or is stopped early."""
        with self._services.database.read() as session:
            repository = StudyRepository(session)
            trials = repository.trials(study.id, "running")
            experiments = repository.experiments([trial.experiment_id for trial in trials if trial.experiment_id])
            run_ids = [run.id for experiment in experiments.values() for run in experiment.runs]
            evaluations = repository.evaluations(run_ids)
            finals = CheckpointRepository(session).final_evaluations(run_ids)
        suite_hash, any_ended = study.suite_hash, False
        for trial in trials:
            experiment = experiments.get(trial.experiment_id or "")
            now = rungs(experiment, evaluations, spec.training.evaluation.every_steps) if experiment else trial.rungs
            verdict = ended(experiment, finals, suite_hash)
            if verdict is None and now != trial.rungs:
                verdict = unpromising(spec, now, self._complete())
            if verdict is not None:
                any_ended |= self._end(trial, experiment, verdict, now)
                if verdict.state == "complete" and suite_hash is None and experiment is not None:
                    suite_hash = finals[experiment.runs[0].id].suite_hash
                    with self._services.database.write() as session:
                        StudyRepository(session).note(study.id, suite_hash=suite_hash)
            elif now != trial.rungs:
                with self._services.database.write() as session:
                    StudyRepository(session).note_rungs(trial, now)
        return any_ended

    def _complete(self) -> Sequence[tables.StudyTrial]:
        with self._services.database.read() as session:
            return StudyRepository(session).trials(self._id, "complete")

    def _end(
        self,
        trial: tables.StudyTrial,
        experiment: tables.Experiment | None,
        verdict: Verdict,
        now: Mapping[str, Sequence[float | None]],
    ) -> bool:
        """Whether it was this one that has ended the trial; runs of it that go on are stopped."""
        moment, stopped = time.time(), []
        with self._services.database.write() as session:
            spent = cost(experiment, moment)
            done = StudyRepository(session).settle(
                trial, verdict.state, rungs=dict(now), cost=spent, finished_at=moment, **verdict.columns
            )
            if done and experiment is not None:
                for run in ExperimentRepository(session).lock_runs(experiment.id):
                    if states.allows(run.state, "stop"):
                        stop_run(session, run)
                        stopped.append(run)
        for run in stopped:
            self._runs.announce_stopped(run)
        return done

    def _weigh(self, spec: StudySpec) -> None:
        with self._services.database.read() as session:
            trials = StudyRepository(session).trials(self._id)
        space = space_of(spec)
        found = importances(space, [told(trial) for trial in trials])
        if found:
            complete = [trial for trial in trials if trial.state == "complete"]
            spans = intervals(space, [trial.values for trial in complete], [trial.score or 0.0 for trial in complete])
            sure = {"trials": len(complete), "spans": spans}
            with self._services.database.write() as session:
                StudyRepository(session).note(self._id, importances=found, importance_intervals=sure)

    def _weigh_late(self, study: tables.Study) -> None:
        """What an older version has ended, or came from another server: once, whatever comes of it."""
        with self._services.database.write() as session:
            repository = StudyRepository(session)
            complete = repository.counts([self._id])[self._id].get("complete", 0)
            repository.note(self._id, importance_intervals={"trials": complete, "spans": {}})
        try:
            self._weigh(spec_of(study))
        except (ValueError, KeyError):
            logger.warning(
                "study %s has settings that this version can't weigh: its importances stay as they were", self._id
            )

    def _ask(self, spec: StudySpec) -> bool:
        """Whether there may be more to ask for."""
        with self._services.database.read() as session:
            repository = StudyRepository(session)
            study = repository.get(self._id)
            full = repository.counts([self._id])[self._id].get("running", 0) >= spec.at_once
            if study.state != "running" or study.asked >= study.budget or full:
                return False
            trials = repository.trials(self._id)
        if len(trials) != study.asked:
            # Another server's next trial has come between the two looks.
            return False
        space = space_of(spec)
        values = propose(space, spec.sampler, spec.seed, [told(trial) for trial in trials])
        return self._launch(study, spec, space, values)

    def _launch(self, study: tables.Study, spec: StudySpec, space: Space, values: Values) -> bool:
        """Whether the trial was this server's to launch."""
        trial = tables.StudyTrial(study_id=study.id, number=study.asked, values=dict(values), rungs={})
        experiment, training = None, None
        try:
            training = space.training(values)
            refuse_too_large(training, self._services.settings.max_checkpoint_bytes)
        except (ValidationError, MemoryTooLargeError) as error:
            reason = wording(error) if isinstance(error, ValidationError) else str(error)
            trial.state, trial.finished_at = "failed", time.time()
            trial.reason = f"These settings make no training: {reason}"
        else:
            name = f"{study.name[:_LONGEST_NAME]}, trial {study.asked + 1}"
            experiment = _experiment(study, name, training, spec.seeds)
            experiment.study_id, trial.experiment_id = study.id, experiment.id
        with self._services.database.write() as session:
            if not StudyRepository(session).claim_trial(study.id, study.asked):
                return False
            session.add(trial)
            if experiment is not None:
                ExperimentRepository(session).add(experiment)
        if experiment is not None and training is not None:
            self._announce(experiment, training)
        return True

    def _judge(self, spec: StudySpec) -> None:
        """Once all trials are through, train the best one's settings with fresh seeds, unless that was done already."""
        with self._services.database.read() as session:
            repository = StudyRepository(session)
            study = repository.get(self._id)
            going_on = repository.counts([self._id])[self._id].get("running", 0)
            if study.state != "running" or study.asked < study.budget or going_on:
                return
            best = best_of(repository.trials(self._id, "complete"))
        if best is None:
            with self._services.database.write() as session:
                StudyRepository(session).move(study, "done", finished_at=time.time())
            return
        if study.judged_trial == best.number and study.judgement_id is not None:
            with self._services.database.write() as session:
                StudyRepository(session).move(study, "judging")
            return
        training = space_of(spec).training(best.values)
        name = f"{study.name[:_LONGEST_NAME]}, the best judged, trial {best.number}"
        experiment = _experiment(study, name, training, fresh_seeds(spec.seeds))
        with self._services.database.write() as session:
            moved = StudyRepository(session).move(study, "judging", judged_trial=best.number, judgement_id=experiment.id)
            if not moved:
                return
            ExperimentRepository(session).add(experiment)
            AuditRepository(session).add(
                "experiment.launched",
                target=experiment.id,
                name=name,
                project_id=study.project_id,
                details=f"{JUDGES} runs, by the study {study.name}",
            )
        self._announce(experiment, training)

    def _end_judgement(self, study: tables.Study) -> None:
        with self._services.database.read() as session:
            found = StudyRepository(session).experiments([study.judgement_id or ""])
        experiment = found.get(study.judgement_id or "")
        if experiment is None or all(run.state in states.FINISHED for run in experiment.runs):
            with self._services.database.write() as session:
                StudyRepository(session).move(study, "done", finished_at=time.time())

    def _announce(self, experiment: tables.Experiment, training: TrainingConfig) -> None:
        for run in experiment.runs:
            for queue in queues_of(training):
                self._services.doorbell.ring(run.id, run.attempt, queue)
        self._services.bus.belongs(experiment.id, experiment.project_id)
        self._services.bus.publish(Change(experiment_id=experiment.id, run_id=None, kind="experiment"))


def spec_of(study: tables.Study) -> StudySpec:
    """What a study searches, and how.

    Raises:
        ValidationError: another version has stored it, and this one can't read it.
    """
    return StudySpec.model_validate(study.spec)


def space_of(spec: StudySpec) -> Space:
    """The settings that are searched over the training that is shared."""
    base: dict[str, Any] = spec.training.model_dump(mode="json")
    return Space(base, spec.settings)


def best_of(trials: Sequence[tables.StudyTrial]) -> tables.StudyTrial | None:
    """The complete trial with the highest score, of equal ones the first; None where none is complete."""
    complete = [trial for trial in trials if trial.state == "complete" and trial.score is not None]
    return max(complete, key=lambda trial: (trial.score or 0.0, -trial.number), default=None)


def fresh_seeds(seeds: Sequence[int]) -> list[int]:
    """The next ones after the highest; where there are none, the lowest that are not among them."""
    following = range(max(seeds) + 1, max(seeds) + 1 + JUDGES)
    if following[-1] <= _MAX_SEED:
        return list(following)
    return [seed for seed in range(len(seeds) + JUDGES) if seed not in seeds][:JUDGES]


def _experiment(study: tables.Study, name: str, training: TrainingConfig, seeds: Sequence[int]) -> tables.Experiment:
    return tables.Experiment(
        id=new_id(),
        project_id=study.project_id,
        launched_by=study.launched_by,
        name=name,
        training=training.model_dump(mode="json"),
        runs=[tables.Run(id=new_id(), seed=seed) for seed in sorted(seeds)],
    )

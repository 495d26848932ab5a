"""What a person may do with an experiment."""

import statistics
import time
from collections.abc import Callable, Sequence

from sqlalchemy.orm import Session

from server.arenas.references import without_geometry
from server.audit.repository import AuditRepository
from server.checkpoints.archives import LooseArchives, forget_recordings, remove_archives
from server.checkpoints.repository import CheckpointRepository
from server.checkpoints.views import success_over_runs
from server.database import tables
from server.errors import ConflictError, RefusedFieldError
from server.events.changes import Change, ChangeKind
from server.experiments.repository import ExperimentRepository, aggregate_state
from server.experiments.schemas import (
    Experiment,
    ExperimentLaunch,
    ExperimentPatch,
    TrainingPace,
)
from server.experiments.stored import read_training
from server.ids import new_id
from server.lineage.starts import with_start
from server.projects.repository import ProjectRepository
from server.runs import states
from server.runs.repository import RunRepository
from server.runs.service import RunService, resume_run, stop_run
from server.runs.views import SHOWN, SPEED, run_view
from server.security.principal import Principal
from server.services import Services
from workers.archive_size import refuse_too_large
from workers.config import TrainingConfig
from workers.errors import MemoryTooLargeError
from workers.protocol import queues_of


def launchable(services: Services, training: TrainingConfig, principal: Principal) -> TrainingConfig:
    """The training as the database keeps it: with what it begins with, its extensions as they are here, without geometry.

    Args:
        services: of the application.
        training: what is to be trained.
        principal: who launches it, and so may begin with the policies that they may see.

    Raises:
        UnusableArenaError: it trains on an imported arena that is not here.
        RefusedFieldError: its checkpoints would be larger than this installation takes, or the policy that it is to begin
            with is not there, or does not fit.
    """
    try:
        refuse_too_large(training, services.settings.max_checkpoint_bytes)
    except MemoryTooLargeError as error:
        raise RefusedFieldError(
            ("body", "training", "algorithm", training.algorithm.name, "replay_size"), str(error)
        ) from error
    with services.database.read() as session:
        started = with_start(training, session, services.files, principal)
    return without_geometry(started.as_installed(), services.arenas)


class ExperimentService:
    """Launches, reads, stops, resumes and deletes experiments."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._runs = RunService(services)

    def create(self, request: ExperimentLaunch, principal: Principal) -> Experiment:
        """Queue one run a seed, and wake workers for them.

        Args:
            request: what to train.
            principal: who launches it, and so may begin with the policies that they may see.

        Raises:
            NotFoundError: there is no such project.
            UnusableArenaError: as `launchable`.
            RefusedFieldError: likewise.
        """
        training = launchable(self._services, request.training, principal)
        experiment = tables.Experiment(
            id=new_id(),
            project_id=request.project_id,
            name=request.name,
            training=training.model_dump(mode="json"),
            launched_by=principal.user_id,
            parallel_runs=request.parallel_runs,
        )
        experiment.runs = [tables.Run(id=new_id(), seed=seed) for seed in sorted(request.seeds)]
        with self._services.database.write() as session:
            ProjectRepository(session).get(request.project_id)
            ExperimentRepository(session).add(experiment)
            _note(session, "experiment.launched", experiment, f"{len(experiment.runs)} runs")
        for run in experiment.runs:
            for queue in queues_of(request.training):
                self._services.doorbell.ring(run.id, run.attempt, queue)
        self._publish(experiment, "experiment")
        return self.get(experiment.id)

    def get(self, experiment_id: str) -> Experiment:
        """The experiment as it is now.

        Raises:
            NotFoundError: there is none.
        """
        with self._services.database.read() as session:
            return _views(session, [ExperimentRepository(session).get(experiment_id)])[0]

    def pace(self, algorithm: str, network: str) -> TrainingPace:
        """How quick runs of an algorithm with a network were."""
        with self._services.database.read() as session:
            speeds = ExperimentRepository(session).speeds(algorithm, network, SPEED)
        return TrainingPace(steps_per_second=statistics.median(speeds) if speeds else None, runs=len(speeds))

    def change(self, experiment_id: str, patch: ExperimentPatch) -> Experiment:
        """Give the experiment another name, or move it to another project.

        Raises:
            NotFoundError: there is no such experiment, or project.
        """
        with self._services.database.write() as session:
            experiment = ExperimentRepository(session).get(experiment_id)
            if patch.name is not None and patch.name != experiment.name:
                before, experiment.name = experiment.name, patch.name
                _note(session, "experiment.renamed", experiment, f"was {before}")
            if patch.parallel_runs is not None and (patch.parallel_runs or None) != experiment.parallel_runs:
                experiment.parallel_runs = patch.parallel_runs or None
                _note(session, "experiment.limited", experiment, f"{patch.parallel_runs or 'any number of'} runs at a time")
            if patch.project_id is not None and patch.project_id != experiment.project_id:
                projects = ProjectRepository(session)
                before = projects.get(experiment.project_id).name
                experiment.project_id = projects.get(patch.project_id).id
                _note(session, "experiment.moved", experiment, f"was in {before}")
        self._publish(experiment, "experiment")
        return self.get(experiment_id)

    def stop(self, experiment_id: str) -> Experiment:
        """Stop every run that has not ended.

        Raises:
            NotFoundError: there is no such experiment.
            ConflictError: all of its runs have ended.
        """
        with self._services.database.write() as session:
            runs = [
                run for run in ExperimentRepository(session).lock_runs(experiment_id) if states.allows(run.state, "stop")
            ]
            if not runs:
                raise ConflictError("All runs of this experiment have ended already.")
            for run in runs:
                stop_run(session, run)
            _note(session, "experiment.stopped", runs[0].experiment)
        for run in runs:
            self._runs.announce_stopped(run)
        return self.get(experiment_id)

    def resume(self, experiment_id: str) -> Experiment:
        """Queue every run that was stopped or failed.

        Raises:
            NotFoundError: there is no such experiment.
            ConflictError: none of its runs was stopped or failed.
        """
        with self._services.database.write() as session:
            runs = [
                run for run in ExperimentRepository(session).lock_runs(experiment_id) if states.allows(run.state, "resume")
            ]
            if not runs:
                raise ConflictError("No run of this experiment was stopped or has failed, so there is nothing to resume.")
            for run in runs:
                resume_run(session, run)
            _note(session, "experiment.resumed", runs[0].experiment)
        for run in runs:
            self._runs.announce_queued(run)
        return self.get(experiment_id)

    def delete(self, experiment_id: str) -> None:
        """Put the experiment into the trash, from where it is removed later; runs that are going on are stopped.

        Raises:
            NotFoundError: there is none.
        """
        self._throw_away(lambda repository: [repository.get(experiment_id)])

    def delete_campaign(self, campaign_id: str) -> None:
        """`delete` for every experiment of a campaign.

        Raises:
            NotFoundError: there is no such campaign.
        """
        self._throw_away(lambda repository: repository.campaign(campaign_id))

    def delete_those_of(self, experiment_ids: Sequence[str]) -> None:
        """`delete` for all of these that are there."""
        self._throw_away(lambda repository: repository.there(experiment_ids))

    def restore(self, experiment_id: str) -> None:
        """Take an experiment out of the trash; what was stopped then can be resumed.

        Raises:
            NotFoundError: it does not lie there (any more).
        """
        with self._services.database.write() as session:
            experiment = ExperimentRepository(session).get(experiment_id, deleted=True)
            experiment.deleted_at = None
            _note(session, "experiment.restored", experiment)
        self._publish(experiment, "experiment")

    def remove(self, experiment_id: str) -> None:
        """Remove an experiment that lies in the trash: its runs, curves, checkpoints and files.

        A worker that still trains one of its runs is cut off.

        Raises:
            NotFoundError: it does not lie there (any more).
        """
        with self._services.database.write() as session:
            repository = ExperimentRepository(session)
            experiment = repository.get(experiment_id, deleted=True)
            run_ids = [run.id for run in experiment.runs]
            checkpoints = CheckpointRepository(session).archives(run_ids)
            _note(session, "experiment.removed", experiment)
            repository.delete(experiment)
            session.flush()
            archive_ids = LooseArchives(session).let_go(list(checkpoints))
        # Rows first: a row without its file would be a lie, a file without its row is only in the way.
        for run_id in run_ids:
            self._services.links.cut(run_id)
        remove_archives(self._services, archive_ids)
        forget_recordings(self._services, checkpoints.values())
        self._publish(experiment, "deleted")

    def _throw_away(self, find: Callable[[ExperimentRepository], Sequence[tables.Experiment]]) -> None:
        with self._services.database.write() as session:
            repository = ExperimentRepository(session)
            experiments = find(repository)
            stopped = [
                run
                for experiment in experiments
                for run in repository.lock_runs(experiment.id)
                if states.allows(run.state, "stop")
            ]
            for run in stopped:
                stop_run(session, run)
            for experiment in experiments:
                experiment.deleted_at = time.time()
                _note(session, "experiment.deleted", experiment)
        for run in stopped:
            self._runs.announce_stopped(run)
        for experiment in experiments:
            self._publish(experiment, "deleted")

    def _publish(self, experiment: tables.Experiment, kind: ChangeKind) -> None:
        self._services.bus.belongs(experiment.id, experiment.project_id)
        self._services.bus.publish(Change(experiment_id=experiment.id, run_id=None, kind=kind))


def _note(session: Session, action: str, experiment: tables.Experiment, details: str | None = None) -> None:
    AuditRepository(session).add(
        action, target=experiment.id, name=experiment.name, project_id=experiment.project_id, details=details
    )


def _views(session: Session, experiments: Sequence[tables.Experiment]) -> list[Experiment]:
    run_ids = [run.id for experiment in experiments for run in experiment.runs]
    latest = RunRepository(session).latest_metrics(run_ids, SHOWN)
    final = CheckpointRepository(session).final_evaluations(run_ids)
    views = []
    for experiment in experiments:
        stored = read_training(experiment.training)
        views.append(
            Experiment(
                id=experiment.id,
                project_id=experiment.project_id,
                name=experiment.name,
                created_at=experiment.created_at,
                training=stored.training,
                unreadable=list(stored.unreadable),
                lacking=list(stored.lacking),
                state=aggregate_state([run.state for run in experiment.runs]),
                runs=[run_view(run, stored.training, latest.get(run.id, {})) for run in experiment.runs],
                parallel_runs=experiment.parallel_runs,
                campaign=experiment.campaign,
                study_id=experiment.study_id,
                success=success_over_runs([final[run.id] for run in experiment.runs if run.id in final]),
            )
        )
    return views

"""What a person may do with an experiment."""

from collections.abc import Callable, Sequence

from sqlalchemy.orm import Session

from server.arenas.references import without_geometry
from server.checkpoints.archives import LooseArchives, remove_archives
from server.checkpoints.repository import CheckpointRepository
from server.checkpoints.views import success_over_runs
from server.database import tables
from server.errors import ConflictError, RefusedFieldError
from server.events.changes import Change
from server.experiments.pace import seconds_left
from server.experiments.repository import ExperimentRepository, aggregate_state
from server.experiments.schemas import (
    Experiment,
    ExperimentCreate,
    ExperimentPatch,
    ExperimentState,
    ListedExperiment,
)
from server.experiments.stored import read_training
from server.ids import new_id
from server.paging import Window
from server.runs import states
from server.runs.repository import RunRepository
from server.runs.service import RunService, resume_run, stop_run
from server.runs.views import SHOWN, run_view
from server.schemas import Page
from server.services import Services
from workers.archive_size import refuse_too_large
from workers.errors import MemoryTooLargeError
from workers.protocol import queues_of


class ExperimentService:
    """Launches, reads, stops, resumes and deletes experiments."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._runs = RunService(services)

    def create(self, request: ExperimentCreate) -> Experiment:
        """Queue one run a seed, and wake workers for them.

        Raises:
            UnusableArenaError: it trains on an imported arena that is not here.
            RefusedFieldError: its checkpoints would be larger than this installation takes.
        """
        try:
            refuse_too_large(request.training, self._services.settings.max_checkpoint_bytes)
        except MemoryTooLargeError as error:
            raise RefusedFieldError(
                ("body", "training", "algorithm", request.training.algorithm.name, "replay_size"), str(error)
            ) from error
        training = without_geometry(request.training, self._services.arenas)
        experiment = tables.Experiment(id=new_id(), name=request.name, training=training.model_dump(mode="json"))
        experiment.runs = [tables.Run(id=new_id(), seed=seed) for seed in sorted(request.seeds)]
        with self._services.database.write() as session:
            ExperimentRepository(session).add(experiment)
        for run in experiment.runs:
            for queue in queues_of(request.training):
                self._services.doorbell.ring(run.id, run.attempt, queue)
        self._publish(experiment.id, "experiment")
        return self.get(experiment.id)

    def get(self, experiment_id: str) -> Experiment:
        """The experiment as it is now.

        Raises:
            NotFoundError: there is none.
        """
        with self._services.database.read() as session:
            return _views(session, [ExperimentRepository(session).get(experiment_id)])[0]

    def page(self, *, query: str, state: ExperimentState | None, window: Window) -> Page[ListedExperiment]:
        """Experiments whose name contains `query` and that are in `state`, the newest first."""
        with self._services.database.read() as session:
            found, total = ExperimentRepository(session).page(query=query.strip(), state=state, window=window)
            return Page(items=[_listed(experiment) for experiment in _views(session, found)], total=total)

    def rename(self, experiment_id: str, patch: ExperimentPatch) -> Experiment:
        """Give the experiment another name.

        Raises:
            NotFoundError: there is none.
        """
        with self._services.database.write() as session:
            ExperimentRepository(session).get(experiment_id).name = patch.name
        self._publish(experiment_id, "experiment")
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
        for run in runs:
            self._runs.announce_queued(run)
        return self.get(experiment_id)

    def delete(self, experiment_id: str) -> None:
        """Remove the experiment, its runs, curves, checkpoints and files. A worker that still trains one of them is cut off.

        Raises:
            NotFoundError: there is none.
        """
        self._delete(lambda repository: [repository.get(experiment_id)])

    def delete_campaign(self, campaign_id: str) -> None:
        """`delete` for every experiment of a campaign.

        Raises:
            NotFoundError: there is no such campaign.
        """
        self._delete(lambda repository: repository.campaign(campaign_id))

    def _delete(self, find: Callable[[ExperimentRepository], Sequence[tables.Experiment]]) -> None:
        with self._services.database.write() as session:
            repository = ExperimentRepository(session)
            experiments = find(repository)
            run_ids = [run.id for experiment in experiments for run in experiment.runs]
            checkpoint_ids = CheckpointRepository(session).ids(run_ids)
            LooseArchives(session).doom(checkpoint_ids)
            for experiment in experiments:
                repository.delete(experiment)
        # Rows first: a row without its file would be a lie, a file without its row is only in the way.
        for run_id in run_ids:
            self._services.links.cut(run_id)
        remove_archives(self._services, checkpoint_ids)
        for experiment in experiments:
            self._publish(experiment.id, "deleted")

    def _publish(self, experiment_id: str, kind: str) -> None:
        self._services.bus.publish(Change.model_validate({"experiment_id": experiment_id, "run_id": None, "kind": kind}))


def _listed(experiment: Experiment) -> ListedExperiment:
    task, algorithm, runs = experiment.training.task, experiment.training.algorithm, experiment.runs
    return ListedExperiment(
        id=experiment.id,
        name=experiment.name,
        created_at=experiment.created_at,
        arena=task.arena.name,
        movers=task.arena.movers.count,
        robot=task.robot.name,
        algorithm=algorithm.name,
        network=algorithm.network.name,
        reward=task.reward.in_short,
        unreadable=experiment.unreadable,
        state=experiment.state,
        states=sorted({run.state for run in runs}),
        runs=len(runs),
        progress=min(1.0, sum(run.step for run in runs) / max(1, sum(run.total_steps for run in runs))),
        seconds_left=seconds_left(runs),
        campaign=experiment.campaign,
        success=experiment.success,
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
                name=experiment.name,
                created_at=experiment.created_at,
                training=stored.training,
                unreadable=list(stored.unreadable),
                state=aggregate_state([run.state for run in experiment.runs]),
                runs=[run_view(run, stored.training, latest.get(run.id, {})) for run in experiment.runs],
                campaign=experiment.campaign,
                success=success_over_runs([final[run.id] for run in experiment.runs if run.id in final]),
            )
        )
    return views

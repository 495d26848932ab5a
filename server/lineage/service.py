"""What a person sees of where trainings begin: policies to start from, a training's parent and children."""

from collections.abc import Collection, Iterator
from typing import Literal

from sqlalchemy.orm import Session

from server.checkpoints.repository import CheckpointRepository
from server.checkpoints.views import evaluation_view, policy_title
from server.database import tables
from server.errors import NotFoundError
from server.estimates import success_estimate
from server.experiments.repository import ExperimentRepository
from server.experiments.stored import training_of
from server.lineage.repository import LineageRepository
from server.lineage.schemas import Child, Lineage, Parent, StartPolicy
from server.policies.service import find
from server.runs.repository import RunRepository
from server.security.principal import Principal
from server.services import Services
from workers.shipped.library import ShippedPolicy, shipped_policies
from workers.start import StartFrom

_RUNS = 20
_CHILDREN = 100


class LineageService:
    """Reads what trainings begin with."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def policies(self, part: str, visible: Collection[str] | None) -> list[StartPolicy]:
        """Policies of such a name: of the newest runs the best and the last, then those that ship.

        Args:
            part: of the training's name or the policy's title, in any case; empty for all.
            visible: projects whose runs may be seen; None for all.
        """
        with self._services.database.read() as session:
            runs = LineageRepository(session).runs_with_checkpoints(part, visible, _RUNS)
            found = [policy for run in runs for policy in _of_run(session, run)]
        shipped = [policy for policy in shipped_policies() if part.lower() in policy.card.title.lower()]
        return [*found, *map(_shipped, shipped)]

    def policy(self, checkpoint_id: str) -> StartPolicy:
        """The policy of a checkpoint.

        Raises:
            NotFoundError: there is no such checkpoint.
        """
        with self._services.database.read() as session:
            row = LineageRepository(session).checkpoint(checkpoint_id)
            if row is None:
                raise NotFoundError.of("checkpoint", checkpoint_id)
            return _policy(row[1], row[0], "other")

    def of_experiment(self, experiment_id: str, principal: Principal) -> Lineage:
        """Where an experiment comes from, and what came of any of its runs.

        Raises:
            NotFoundError: there is no such experiment.
        """
        with self._services.database.read() as session:
            experiment = ExperimentRepository(session).get(experiment_id)
            return _lineage(session, experiment, [run.id for run in experiment.runs], principal)

    def of_run(self, run_id: str, principal: Principal) -> Lineage:
        """Where a run comes from, and what came of it.

        Raises:
            NotFoundError: there is no such run.
        """
        with self._services.database.read() as session:
            return _lineage(session, RunRepository(session).get(run_id).experiment, [run_id], principal)


def _lineage(session: Session, experiment: tables.Experiment, run_ids: Collection[str], principal: Principal) -> Lineage:
    start = training_of(experiment).start_from
    children = LineageRepository(session).children(run_ids, principal.visible, _CHILDREN)
    return Lineage(
        parent=None if start is None else _parent(session, start, principal),
        children=[Child(id=child.id, name=child.name, seed=seed, step=step) for child, seed, step in children],
    )


def _parent(session: Session, start: StartFrom, principal: Principal) -> Parent:
    if start.source == "shipped":
        try:
            find(start.name)
        except NotFoundError:
            return Parent(start_from=start, state="gone", run_id=None, step=None)
        return Parent(start_from=start, state="there", run_id=None, step=None)
    row = LineageRepository(session).checkpoint(start.name)
    if row is None:
        return Parent(start_from=start, state="gone", run_id=None, step=None)
    checkpoint, run = row
    if principal.role_in(run.experiment.project_id) is None:
        return Parent(start_from=start, state="hidden", run_id=None, step=None)
    return Parent(start_from=start, state="there", run_id=run.id, step=checkpoint.step)


def _of_run(session: Session, run: tables.Run) -> Iterator[StartPolicy]:
    checkpoints = CheckpointRepository(session)
    best, last = checkpoints.best(run.id), checkpoints.last(run.id)
    if best is not None:
        yield _policy(run, best[0], "best", best[1])
    if last is not None and (best is None or last.id != best[0].id):
        yield _policy(run, last, "last")


def _policy(
    run: tables.Run,
    checkpoint: tables.Checkpoint,
    kind: Literal["best", "last", "other"],
    evaluation: tables.Evaluation | None = None,
) -> StartPolicy:
    title = policy_title(run, checkpoint)
    return StartPolicy(
        start_from=StartFrom(source="checkpoint", name=checkpoint.id, sha256=checkpoint.sha256, title=title),
        kind=kind,
        experiment_id=run.experiment_id,
        success=None if evaluation is None else evaluation_view(evaluation).success,
    )


def _shipped(policy: ShippedPolicy) -> StartPolicy:
    card = policy.card
    first, *_ = card.results
    return StartPolicy(
        start_from=StartFrom(source="shipped", name=card.name, sha256=None, title=card.title),
        kind="shipped",
        experiment_id=None,
        success=success_estimate([first.figures.arrivals], [first.figures.episodes], trained=True),
    )

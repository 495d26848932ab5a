"""Experiments in SQL: lists with filter, search and pages; the state of an experiment from those of its runs."""

from collections.abc import Collection, Sequence

from sqlalchemy import ColumnElement, case, func, select
from sqlalchemy.orm import Session, joinedload, selectinload

from server.database import tables
from server.database.tables import RunState
from server.errors import NotFoundError
from server.experiments.schemas import ExperimentState
from server.paging import Window

# While any run is in one of these, that is what the experiment is; the first that applies.
UNFINISHED: tuple[RunState, ...] = ("running", "stopping", "queued")


def aggregate_state(states: Collection[RunState]) -> ExperimentState:
    """The state of runs together: what is still going on, else how all ended, else `mixed`."""
    for state in UNFINISHED:
        if state in states:
            return state
    distinct = set(states)
    return distinct.pop() if len(distinct) == 1 else "mixed"


def _aggregate_state_sql() -> ColumnElement[str]:
    """`aggregate_state` over the runs of a group."""
    unfinished = [(func.sum(case((tables.Run.state == state, 1), else_=0)) > 0, state) for state in UNFINISHED]
    uniform = (func.min(tables.Run.state) == func.max(tables.Run.state), func.min(tables.Run.state))
    return case(*unfinished, uniform, else_="mixed")


class ExperimentRepository:
    """Reads and writes experiments within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def add(self, experiment: tables.Experiment) -> None:
        """Add an experiment with its runs."""
        self._session.add(experiment)

    def get(self, experiment_id: str) -> tables.Experiment:
        """The experiment with its runs.

        Raises:
            NotFoundError: there is none.
        """
        found = self.get_many([experiment_id])
        return found[0]

    def get_many(self, experiment_ids: Sequence[str]) -> list[tables.Experiment]:
        """The experiments with their runs, in the order asked for.

        Raises:
            NotFoundError: one of them is missing.
        """
        query = (
            select(tables.Experiment)
            .where(tables.Experiment.id.in_(experiment_ids))
            .options(selectinload(tables.Experiment.runs))
        )
        found = {experiment.id: experiment for experiment in self._session.scalars(query)}
        for experiment_id in experiment_ids:
            if experiment_id not in found:
                raise NotFoundError.of("experiment", experiment_id)
        return [found[experiment_id] for experiment_id in experiment_ids]

    def lock_runs(self, experiment_id: str) -> Sequence[tables.Run]:
        """The experiment's runs with the experiment itself, by seed, locked where the database has row locks.

        Raises:
            NotFoundError: there is no such experiment.
        """
        query = (
            select(tables.Run)
            .where(tables.Run.experiment_id == experiment_id)
            .options(joinedload(tables.Run.experiment))
            .order_by(tables.Run.seed)
            .with_for_update(of=tables.Run)
        )
        runs = self._session.scalars(query).all()
        if not runs:
            raise NotFoundError.of("experiment", experiment_id)
        return runs

    def page(self, *, query: str, state: ExperimentState | None, window: Window) -> tuple[Sequence[tables.Experiment], int]:
        """Experiments whose name contains `query` (in any case) and that are in `state`, newest first; how many in all."""
        wanted = select(tables.Experiment.id)
        if query:
            wanted = wanted.where(func.lower(tables.Experiment.name).contains(query.lower(), autoescape=True))
        if state is not None:
            in_state = (
                select(tables.Run.experiment_id).group_by(tables.Run.experiment_id).having(_aggregate_state_sql() == state)
            )
            wanted = wanted.where(tables.Experiment.id.in_(in_state))
        total = self._session.scalar(select(func.count()).select_from(wanted.subquery())) or 0
        rows = (
            select(tables.Experiment)
            .where(tables.Experiment.id.in_(wanted))
            .options(selectinload(tables.Experiment.runs))
            .order_by(tables.Experiment.created_at.desc(), tables.Experiment.id)
            .limit(window.limit)
            .offset(window.offset)
        )
        return self._session.scalars(rows).all(), total

    def campaign(self, campaign_id: str) -> Sequence[tables.Experiment]:
        """The experiments of a campaign with their runs; those that were deleted are missing.

        Raises:
            NotFoundError: none is left.
        """
        query = (
            select(tables.Experiment)
            .where(tables.Experiment.campaign == campaign_id)
            .options(selectinload(tables.Experiment.runs))
            .order_by(tables.Experiment.created_at, tables.Experiment.id)
        )
        found = self._session.scalars(query).all()
        if not found:
            raise NotFoundError.of("campaign", campaign_id)
        return found

    def campaigns(self) -> list[tuple[str, float]]:
        """Every campaign of which an experiment is left, with the time of its launch, the newest first."""
        launched = func.min(tables.Experiment.created_at)
        query = (
            select(tables.Experiment.campaign, launched)
            .where(tables.Experiment.campaign.is_not(None))
            .group_by(tables.Experiment.campaign)
            .order_by(launched.desc(), tables.Experiment.campaign)
        )
        return [(campaign, at) for campaign, at in self._session.execute(query) if campaign is not None]

    def unfinished_campaign(self) -> str | None:
        """A campaign with a run that has not ended."""
        query = (
            select(tables.Experiment.campaign)
            .join(tables.Run, tables.Run.experiment_id == tables.Experiment.id)
            .where(tables.Experiment.campaign.is_not(None), tables.Run.state.in_(UNFINISHED))
        )
        return self._session.scalars(query).first()

    def delete(self, experiment: tables.Experiment) -> None:
        """Remove the experiment with everything that hangs on it."""
        self._session.delete(experiment)

"""Experiments in SQL: lists with filter, search and pages; the state of an experiment from those of its runs."""

from collections.abc import Collection, Sequence

from sqlalchemy import ColumnElement, case, func, select
from sqlalchemy.orm import Session, joinedload, selectinload

from server.database import tables
from server.database.tables import RunState
from server.errors import NotFoundError
from server.experiments.schemas import ExperimentState
from server.workbench.keys import KeyRepository

# Among these of the whole service is looked for runs of a kind.
_LAST_RUNS = 200
# While any run is in one of these, that is what the experiment is; the first that applies.
UNFINISHED: tuple[RunState, ...] = ("running", "stopping", "queued")


def aggregate_state(states: Collection[RunState]) -> ExperimentState:
    """The state of runs together: what is still going on, else how all ended, else `mixed`."""
    for state in UNFINISHED:
        if state in states:
            return state
    distinct = set(states)
    return distinct.pop() if len(distinct) == 1 else "mixed"


def aggregate_state_sql() -> ColumnElement[str]:
    """`aggregate_state` over the runs of a group."""
    unfinished = [(func.sum(case((tables.Run.state == state, 1), else_=0)) > 0, state) for state in UNFINISHED]
    uniform = (func.min(tables.Run.state) == func.max(tables.Run.state), func.min(tables.Run.state))
    return case(*unfinished, uniform, else_="mixed")


class ExperimentRepository:
    """Reads and writes experiments within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def add(self, experiment: tables.Experiment) -> None:
        """Add an experiment with its runs, and write its settings down key by key."""
        self._session.add(experiment)
        self._session.flush()
        KeyRepository(self._session).write_down([experiment])

    def speeds(self, algorithm: str, network: str, metric: str) -> Sequence[float]:
        """The newest value of a metric of the runs of an algorithm with a network, among those that ended last."""
        last = (
            select(tables.Run.id, tables.Run.experiment_id)
            .where(tables.Run.finished_at.is_not(None))
            .order_by(tables.Run.finished_at.desc())
            .limit(_LAST_RUNS)
            .subquery()
        )
        trained = tables.Experiment.training["algorithm"]
        query = (
            select(tables.LatestMetric.value)
            .join(last, last.c.id == tables.LatestMetric.run_id)
            .join(tables.Experiment, tables.Experiment.id == last.c.experiment_id)
            .where(
                tables.LatestMetric.name == metric,
                tables.LatestMetric.value > 0.0,
                trained["name"].as_string() == algorithm,
                trained["network"]["name"].as_string() == network,
            )
        )
        return self._session.scalars(query).all()

    def get(self, experiment_id: str, *, deleted: bool = False) -> tables.Experiment:
        """The experiment with its runs; one in the trash where it is `deleted`.

        Raises:
            NotFoundError: there is none.
        """
        found = self.get_many([experiment_id], deleted=deleted)
        return found[0]

    def get_many(self, experiment_ids: Sequence[str], *, deleted: bool = False) -> list[tables.Experiment]:
        """The experiments with their runs, in the order asked for; those in the trash where they are `deleted`.

        Raises:
            NotFoundError: one of them is missing.
        """
        query = (
            select(tables.Experiment)
            .where(tables.Experiment.id.in_(experiment_ids), tables.Experiment.deleted_at.is_not(None) == deleted)
            .options(selectinload(tables.Experiment.runs))
        )
        found = {experiment.id: experiment for experiment in self._session.scalars(query)}
        for experiment_id in experiment_ids:
            if experiment_id not in found:
                raise NotFoundError.of("experiment", experiment_id)
        return [found[experiment_id] for experiment_id in experiment_ids]

    def there(self, experiment_ids: Sequence[str]) -> Sequence[tables.Experiment]:
        """Those of the experiments that are there and not in the trash."""
        row = tables.Experiment
        return self._session.scalars(select(row).where(row.id.in_(experiment_ids), row.deleted_at.is_(None))).all()

    def lock_runs(self, experiment_id: str) -> Sequence[tables.Run]:
        """The experiment's runs with the experiment itself, by seed, locked where the database has row locks.

        Raises:
            NotFoundError: there is no such experiment.
        """
        query = (
            select(tables.Run)
            .join(tables.Run.experiment)
            .where(tables.Run.experiment_id == experiment_id, tables.Experiment.deleted_at.is_(None))
            .options(joinedload(tables.Run.experiment))
            .order_by(tables.Run.seed)
            .with_for_update(of=tables.Run)
        )
        runs = self._session.scalars(query).all()
        if not runs:
            raise NotFoundError.of("experiment", experiment_id)
        return runs

    def campaign(self, campaign_id: str) -> Sequence[tables.Experiment]:
        """The experiments of a campaign with their runs; those that were deleted are missing.

        Raises:
            NotFoundError: none is left.
        """
        query = (
            select(tables.Experiment)
            .where(tables.Experiment.campaign == campaign_id, tables.Experiment.deleted_at.is_(None))
            .options(selectinload(tables.Experiment.runs))
            .order_by(tables.Experiment.created_at, tables.Experiment.id)
        )
        found = self._session.scalars(query).all()
        if not found:
            raise NotFoundError.of("campaign", campaign_id)
        return found

    def campaign_runs(self, campaign_id: str) -> Sequence[tables.Run]:
        """The runs of a campaign by id, without what they were to train.

        Raises:
            NotFoundError: none is left.
        """
        query = (
            select(tables.Run)
            .join(tables.Experiment, tables.Experiment.id == tables.Run.experiment_id)
            .where(tables.Experiment.campaign == campaign_id, tables.Experiment.deleted_at.is_(None))
            .order_by(tables.Run.id)
        )
        found = self._session.scalars(query).all()
        if not found:
            raise NotFoundError.of("campaign", campaign_id)
        return found

    def campaigns(self, visible: Collection[str] | None = None) -> list[tuple[str, float]]:
        """Every campaign of which an experiment is left, with the time of its launch, the newest first.

        Only those of which all is in `visible` projects, where they are given.
        """
        launched = func.min(tables.Experiment.created_at)
        query = (
            select(tables.Experiment.campaign, launched)
            .where(tables.Experiment.campaign.is_not(None), tables.Experiment.deleted_at.is_(None))
            .group_by(tables.Experiment.campaign)
            .order_by(launched.desc(), tables.Experiment.campaign)
        )
        if visible is not None:
            elsewhere = select(tables.Experiment.campaign).where(
                tables.Experiment.campaign.is_not(None), tables.Experiment.project_id.not_in(visible)
            )
            query = query.where(tables.Experiment.campaign.not_in(elsewhere))
        return [(campaign, at) for campaign, at in self._session.execute(query) if campaign is not None]

    def unfinished_campaign(self) -> str | None:
        """A campaign with a run that has not ended."""
        query = (
            select(tables.Experiment.campaign)
            .join(tables.Run, tables.Run.experiment_id == tables.Experiment.id)
            .where(tables.Experiment.campaign.is_not(None), tables.Run.state.in_(UNFINISHED))
        )
        return self._session.scalars(query).first()

    def deleted_before(self, moment: float, limit: int) -> list[str]:
        """The ids of experiments that lie in the trash since before `moment`, the longest first."""
        deleted = tables.Experiment.deleted_at
        query = select(tables.Experiment.id).where(deleted < moment).order_by(deleted).limit(limit)
        return list(self._session.scalars(query))

    def delete(self, experiment: tables.Experiment) -> None:
        """Remove the experiment with everything that hangs on it."""
        self._session.delete(experiment)

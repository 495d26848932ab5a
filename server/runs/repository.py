"""Runs and what hangs on them, in SQL."""

from collections import defaultdict
from collections.abc import Collection, Iterator, Sequence
from typing import NamedTuple, Self

from sqlalchemy import bindparam, func, select
from sqlalchemy.orm import Session, contains_eager, joinedload

from server.database import tables
from server.errors import NotFoundError
from server.http.paging import Window
from server.runs.shares import Shares
from server.runs.states import ACTIVE
from workers.reporting import EventLevel

_TURN = tables.Run.priority.desc(), tables.Run.queued_at, tables.Run.id
"""Which run of one person is claimed first."""
# The first can be trained nearly always; each is read with all of its settings.
_AT_FIRST = 2
_AT_ONCE = 50
_RUN = select(tables.Run).where(tables.Run.id == bindparam("run")).options(joinedload(tables.Run.experiment))
_LOCKED_RUN = _RUN.with_for_update(of=tables.Run)


class PointsState(NamedTuple):
    """As long as it is the same, so are the run's points.

    Reports move the number of the last item; what cuts a run back moves its step, and its next attempt's number; what thins
    them says when.
    """

    run_id: str
    attempt: int
    last_seq: int
    step: int
    thinned_at: float | None
    thinned_from: int | None
    thinned_to: int | None

    @classmethod
    def of(cls, run: tables.Run) -> Self:
        """That of a run that is at hand."""
        return cls(run.id, run.attempt, run.last_seq, run.step, run.thinned_at, run.thinned_from, run.thinned_to)


class RunRepository:
    """Reads and writes runs within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def get(self, run_id: str, *, for_update: bool = False) -> tables.Run:
        """The run with its experiment; `for_update` locks the row where the database has row locks.

        Raises:
            NotFoundError: there is none, or it lies in the trash.
        """
        run = self.find(run_id, for_update=for_update)
        if run is None or run.experiment.deleted_at is not None:
            raise NotFoundError.of("run", run_id)
        return run

    def find(self, run_id: str, *, for_update: bool = False) -> tables.Run | None:
        """As `get`; None if there is none."""
        return self._session.scalar(_LOCKED_RUN if for_update else _RUN, {"run": run_id})

    def check(self, run_id: str) -> None:
        """Refuse a run that is not there, without reading what it is.

        Raises:
            NotFoundError: there is none, or it lies in the trash.
        """
        self.points_state(run_id)

    def points_state(self, run_id: str) -> PointsState:
        """What a run's points depend on.

        Raises:
            NotFoundError: there is no such run, or it lies in the trash.
        """
        run, experiment = tables.Run, tables.Experiment
        columns = (run.id, run.attempt, run.last_seq, run.step, run.thinned_at, run.thinned_from, run.thinned_to)
        query = select(*columns).join(experiment, experiment.id == run.experiment_id)
        row = self._session.execute(query.where(run.id == run_id, experiment.deleted_at.is_(None))).one_or_none()
        if row is None:
            raise NotFoundError.of("run", run_id)
        return PointsState(*row)

    def several(
        self, run_ids: Collection[str], *, for_update: bool = False, with_experiments: bool = False
    ) -> dict[str, tables.Run]:
        """Those of the runs that there are, by id.

        Rows are locked in the order of their ids, so that two who want some of the same don't wait for one another.
        """
        query = select(tables.Run).where(tables.Run.id.in_(run_ids)).order_by(tables.Run.id)
        if with_experiments:
            query = query.options(joinedload(tables.Run.experiment))
        if for_update:
            query = query.with_for_update(of=tables.Run)
        return {run.id: run for run in self._session.scalars(query)}

    def any_thinned(self, run_ids: Collection[str]) -> bool:
        """Whether curves of one of these runs were thinned."""
        query = select(tables.Run.id).where(tables.Run.id.in_(run_ids), tables.Run.thinned_at.is_not(None)).limit(1)
        return self._session.scalar(query) is not None

    def latest_metrics(self, run_ids: Collection[str], names: Collection[str]) -> dict[str, dict[str, float]]:
        """The newest value of each of `names`, by run and name; what a run never reported is absent."""
        query = select(tables.LatestMetric).where(
            tables.LatestMetric.run_id.in_(run_ids), tables.LatestMetric.name.in_(names)
        )
        latest: dict[str, dict[str, float]] = defaultdict(dict)
        for metric in self._session.scalars(query):
            latest[metric.run_id][metric.name] = metric.value
        return latest

    def events(self, run_id: str, window: Window | None = None) -> Sequence[tables.RunEvent]:
        """The run's event log, or a part of it, oldest first."""
        query = select(tables.RunEvent).where(tables.RunEvent.run_id == run_id).order_by(tables.RunEvent.id)
        return self._session.scalars(query if window is None else query.limit(window.limit).offset(window.offset)).all()

    def count_events(self, run_id: str) -> int:
        """How long the run's event log is."""
        query = select(func.count()).select_from(tables.RunEvent).where(tables.RunEvent.run_id == run_id)
        return self._session.scalars(query).one()

    def add_event(self, run_id: str, level: EventLevel, message: str, step: int = 0) -> None:
        """Append a line to the run's event log."""
        self._session.add(tables.RunEvent(run_id=run_id, level=level, message=message, step=step))

    def queued(self) -> Sequence[tables.Run]:
        """The runs that wait for a worker, with their experiments, by priority, then by how long they wait."""
        query = select(tables.Run).where(tables.Run.state == "queued").options(joinedload(tables.Run.experiment))
        return self._session.scalars(query.order_by(*_TURN)).all()

    def claimed_under(self, claim_id: str) -> str | None:
        """The id of the run that a worker has under this claim."""
        query = select(tables.Run.id).where(tables.Run.state.in_(ACTIVE), tables.Run.claim_id == claim_id)
        return self._session.scalar(query)

    def in_turn(self, shares: Shares) -> Iterator[tables.Run]:
        """Those that wait for no limit, in the order in which they would be given away now; read as far as asked for."""
        priority, *rest = _TURN
        query = (
            select(tables.Run)
            .join(tables.Run.experiment)
            .where(tables.Run.state == "queued", shares.allowed())
            .options(contains_eager(tables.Run.experiment))
            .order_by(priority, *shares.places(), *rest)
        )
        offset, wanted = 0, _AT_FIRST
        while runs := self._session.scalars(query.offset(offset).limit(wanted)).all():
            yield from runs
            offset, wanted = offset + len(runs), _AT_ONCE

    def take(self, run_id: str) -> tables.Run | None:
        """The run, locked, if it waits still; None where it does not, or another transaction is about to give it away."""
        query = select(tables.Run).where(tables.Run.id == run_id, tables.Run.state == "queued")
        locked = query.with_for_update(of=tables.Run, skip_locked=True)
        return self._session.scalar(locked.execution_options(populate_existing=True))

    def highest_priority(self) -> int | None:
        """Of the runs that wait; None where none does."""
        return self._session.scalar(select(func.max(tables.Run.priority)).where(tables.Run.state == "queued"))

    def active_attempts(self) -> list[tuple[str, int]]:
        """Id and attempt of every run that a worker has."""
        query = select(tables.Run.id, tables.Run.attempt).where(tables.Run.state.in_(ACTIVE))
        return [(run_id, attempt) for run_id, attempt in self._session.execute(query)]

    def count_by_state(self) -> dict[str, int]:
        """How many runs are in each state; a state without any is absent."""
        rows = self._session.execute(select(tables.Run.state, func.count()).group_by(tables.Run.state))
        return {row[0]: row[1] for row in rows}

    def trained_by(self, workers: Collection[str], visible: Collection[str] | None = None) -> dict[str, str]:
        """The run that each of `workers` trains now, by worker; of `visible` projects only, where they are given."""
        query = select(tables.Run.worker, tables.Run.id).where(
            tables.Run.state.in_(("running", "stopping")), tables.Run.worker.in_(workers)
        )
        if visible is not None:
            query = query.join(tables.Experiment).where(tables.Experiment.project_id.in_(visible))
        return {worker: run_id for worker, run_id in self._session.execute(query) if worker is not None}

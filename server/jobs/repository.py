"""Jobs in SQL."""

from collections.abc import Collection, Sequence

from sqlalchemy import case, delete, func, select
from sqlalchemy.orm import Session

from server.database import tables
from server.errors import NotFoundError
from server.http.paging import Window
from workers.job_protocol import KINDS, JobKind

OPEN: frozenset[tables.JobState] = frozenset({"queued", "running"})
"""States of jobs that are yet to end."""

_EVALUATE: tuple[JobKind, ...] = ("evaluate",)

LONG = len(KINDS)
"""Priority of what goes on for minutes: behind everything that takes seconds."""

AHEAD = LONG + 1
"""Priority of what nobody waits for yet: behind everything else."""

_WATCHED: tuple[JobKind, ...] = ("view", "play")


class JobRepository:
    """Reads and writes jobs within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def get(self, job_id: str, *, for_update: bool = False) -> tables.Job:
        """The job; `for_update` locks the row where the database has row locks.

        Raises:
            NotFoundError: there is none.
        """
        job = self._session.get(tables.Job, job_id, with_for_update=for_update)
        if job is None:
            raise NotFoundError.of("job", job_id)
        return job

    def several(self, job_ids: Collection[str]) -> dict[str, tables.Job]:
        """Those of the jobs that are known still, by id."""
        return {job.id: job for job in self._session.scalars(select(tables.Job).where(tables.Job.id.in_(job_ids)))}

    def open_of(self, key: str) -> tables.Job | None:
        """The job by which that comes out which `key` says, while it is open."""
        return self._session.scalar(select(tables.Job).where(tables.Job.key == key, tables.Job.state.in_(OPEN)))

    def claimed_under(self, claim_id: str) -> tables.Job | None:
        """The job that a worker has under this claim."""
        return self._session.scalar(select(tables.Job).where(tables.Job.state == "running", tables.Job.claim_id == claim_id))

    def take(self, job_id: str) -> tables.Job | None:
        """The job, locked, if it waits still; None where it does not, or another transaction is about to give it away."""
        query = select(tables.Job).where(tables.Job.id == job_id, tables.Job.state == "queued")
        return self._session.scalar(query.with_for_update(skip_locked=True).execution_options(populate_existing=True))

    def queued(self, kinds: Collection[JobKind], limit: int, *, long: bool = True) -> Sequence[tables.Job]:
        """The first jobs of these kinds that wait; without those that go on for minutes where `long` is not set."""
        query = select(tables.Job).where(tables.Job.state == "queued", tables.Job.kind.in_(kinds))
        if not long:
            query = query.where(tables.Job.priority < LONG)
        return self._session.scalars(query.order_by(tables.Job.priority, tables.Job.created_at).limit(limit)).all()

    def running(self, *, for_update: bool = False, ids: Collection[str] | None = None) -> Sequence[tables.Job]:
        """The jobs that workers have, of these ids where any are given."""
        query = select(tables.Job).where(tables.Job.state == "running").order_by(tables.Job.id)
        if ids is not None:
            query = query.where(tables.Job.id.in_(ids))
        return self._session.scalars(query.with_for_update() if for_update else query).all()

    def evaluations(self, limit: int) -> tuple[Sequence[tables.Job], Sequence[tables.Job]]:
        """Evaluations that workers have, and the first that wait, in the order of their turn."""
        row = tables.Job
        query = select(row).where(row.kind == "evaluate", row.state == "running").order_by(row.started_at).limit(limit)
        return self._session.scalars(query).all(), self.queued(_EVALUATE, limit)

    def open_of_kind(self, kind: JobKind) -> Sequence[tables.Job]:
        """Those of a kind that are yet to end."""
        query = select(tables.Job).where(tables.Job.kind == kind, tables.Job.state.in_(OPEN))
        return self._session.scalars(query.with_for_update()).all()

    def count_queued(self) -> int:
        """How many wait."""
        return self._session.scalar(select(func.count()).where(tables.Job.state == "queued")) or 0

    def count_ahead(self) -> int:
        """How many of those that nobody waits for yet are to be done."""
        query = select(func.count()).where(tables.Job.state == "queued", tables.Job.priority == AHEAD)
        return self._session.scalar(query) or 0

    def awaited(self, before: float) -> bool:
        """Whether anything that somebody waits for is queued since before then; not views, which have their own places."""
        row = tables.Job
        query = select(row.id).where(
            row.state == "queued", row.priority < AHEAD, row.kind.not_in(_WATCHED), row.created_at < before
        )
        return self._session.scalar(query.limit(1)) is not None

    def page(self, window: Window) -> tuple[Sequence[tables.Job], int]:
        """Some of the jobs, those under way first, then those that wait in the order of their turn, then what has ended."""
        rank = case((tables.Job.state == "running", 0), (tables.Job.state == "queued", 1), else_=2)
        ended = case((rank == 2, tables.Job.finished_at), else_=None)
        query = select(tables.Job).order_by(rank, ended.desc(), tables.Job.priority, tables.Job.created_at, tables.Job.id)
        total = self._session.scalar(select(func.count()).select_from(tables.Job)) or 0
        return self._session.scalars(query.offset(window.offset).limit(window.limit)).all(), total

    def forget(self, before: float) -> None:
        """Delete what ended before a moment (seconds since the epoch)."""
        self._session.execute(delete(tables.Job).where(tables.Job.state.not_in(OPEN), tables.Job.finished_at < before))

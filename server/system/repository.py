"""Workers that have been heard of, in SQL."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import cast

from sqlalchemy import ColumnElement, Table, bindparam, delete, select, update
from sqlalchemy.orm import Session

from server.database import tables
from server.queueing.activity import with_work
from server.runs.states import ACTIVE
from sim.extending.discovery import UsedExtension, missing
from workers.protocol import HEARTBEAT_SECONDS, Extensions, ExtensionState, Machine, Queue

SILENCE_SECONDS = 3 * HEARTBEAT_SECONDS
"""A worker that was silent for longer is not counted on."""

_WORKERS = cast("Table", tables.Worker.__table__)
_TAKE_UP = (
    update(_WORKERS)
    .where(_WORKERS.c.name == bindparam("worker"))
    .values(last_run_id=bindparam("run"))
    .returning(_WORKERS.c.drained_at)
)


@dataclass(frozen=True, slots=True)
class SeenWorker:
    """What every page shows of a worker, without what it said of its machine and its week; as `tables.Worker` has it."""

    name: str
    queue: Queue
    last_seen: float
    drained_at: float | None
    trouble: str | None
    extensions: list[dict[str, str | None]] | None


class WorkerRepository:
    """Reads and writes workers within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def seen_since(self, moment: float) -> list[SeenWorker]:
        """The workers heard of since `moment` (seconds since the epoch), by name."""
        worker = tables.Worker
        query = select(worker.name, worker.queue, worker.last_seen, worker.drained_at, worker.trouble, worker.extensions)
        found = self._session.execute(query.where(worker.last_seen >= moment).order_by(worker.name))
        return [SeenWorker(*row) for row in found]

    def seen(
        self,
        name: str,
        queue: Queue,
        moment: float,
        trouble: str | None = None,
        extensions: Extensions = (),
        machine: Machine | None = None,
    ) -> None:
        """Note that a worker of this queue has just been heard of, on what, and why it takes up no run where it does not.

        The time since it was last heard of counts as worked, if it has a run.
        """
        worker = self._session.get(tables.Worker, name)
        if worker is None:
            worker = tables.Worker(name=name)
            self._session.add(worker)
        elif self._has_run(name):
            worked = min(max(moment - worker.last_seen, 0.0), SILENCE_SECONDS)
            worker.activity = with_work(worker.activity or {}, moment, worked)
        worker.queue, worker.last_seen, worker.trouble = queue, moment, trouble
        worker.extensions = [extension.model_dump() for extension in extensions]
        worker.machine = machine.model_dump() if machine is not None else None

    def takes_up(self, name: str, run_id: str) -> bool:
        """Note which run a worker takes up; whether it was asked to take up no more."""
        return self._session.scalar(_TAKE_UP, {"worker": name, "run": run_id}) is not None

    def _has_run(self, name: str) -> bool:
        query = select(tables.Run.id).where(tables.Run.state.in_(ACTIVE), tables.Run.worker == name).limit(1)
        return self._session.scalar(query) is not None

    def remove(self, names: Collection[str]) -> None:
        """Forget workers."""
        self._session.execute(delete(tables.Worker).where(tables.Worker.name.in_(names)))

    def drain(self, names: Collection[str], moment: float | None) -> None:
        """Ask workers to finish their runs and take up no more; None takes it back."""
        self._session.execute(update(tables.Worker).where(tables.Worker.name.in_(names)).values(drained_at=moment))

    def is_drained(self, name: str) -> bool:
        """Whether this worker was asked to take up no more."""
        query = select(tables.Worker.drained_at).where(tables.Worker.name == name)
        return self._session.scalar(query) is not None

    def fit(
        self, queues: Collection[Queue], since: float, until: float, needed: Collection[UsedExtension] = ()
    ) -> Sequence[str]:
        """The workers of these queues that were heard of between these moments, take up runs and have these extensions."""
        query = select(tables.Worker).where(tables.Worker.queue.in_(queues), *_there(since, until))
        return [worker.name for worker in self._session.scalars(query) if not missing(needed, versions_on(worker))]

    def idle(self, since: float, until: float) -> Sequence[tables.Worker]:
        """The workers heard of between these moments that could take up a run.

        One heard of in the future was heard before the clock was set back, and not since.
        """
        busy = select(tables.Run.worker).where(tables.Run.state.in_(ACTIVE), tables.Run.worker.is_not(None))
        query = select(tables.Worker).where(*_there(since, until), tables.Worker.name.not_in(busy))
        return self._session.scalars(query).all()


def extensions_on(worker: tables.Worker | SeenWorker) -> Extensions:
    """What a worker said of its extensions; a row of an earlier version says nothing."""
    return tuple(ExtensionState.model_validate(found) for found in worker.extensions or ())


def versions_on(worker: tables.Worker) -> dict[str, str | None]:
    """The extensions that a worker has: names to versions."""
    return {found.name: found.version for found in extensions_on(worker)}


def _there(since: float, until: float) -> tuple[ColumnElement[bool], ...]:
    return tables.Worker.last_seen.between(since, until), tables.Worker.trouble.is_(None), tables.Worker.drained_at.is_(None)

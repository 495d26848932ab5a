"""The service at a glance."""

import time
from collections.abc import Collection

from sqlalchemy.orm import Session

from server.audit.repository import AuditRepository
from server.errors import NotFoundError
from server.runs.repository import RunRepository
from server.services import Services
from server.system.repository import SeenWorker, WorkerRepository, extensions_on
from server.system.schemas import Status, Version, WorkerStatus
from server.version import commit, version
from workers.protocol import found_extensions

# A worker that was silent for longer has gone.
_LATELY_SECONDS = 60.0


def running_version() -> Version:
    """What is running."""
    return Version(version=version(), commit=commit())


def workers_lately(session: Session) -> list[SeenWorker]:
    """The workers that are there."""
    return WorkerRepository(session).seen_since(time.time() - _LATELY_SECONDS)


def drain(services: Services, worker: str) -> Status:
    """Ask a worker, all of its processes, to finish its runs, take up no more, and end.

    Raises:
        NotFoundError: no such worker was heard of lately.
    """
    with services.database.write() as session:
        names = [known.name for known in workers_lately(session) if known.name.partition("/")[0] == worker.partition("/")[0]]
        if not names:
            raise NotFoundError.of("worker", worker)
        WorkerRepository(session).drain(names, time.time())
        AuditRepository(session).add("worker.drained", name=worker)
    return status(services)


def status(services: Services, visible: Collection[str] | None = None) -> Status:
    """Workers heard of lately, and how many runs wait and go on; which runs, only of `visible` projects where given."""
    with services.database.read() as session:
        workers = workers_lately(session)
        runs = RunRepository(session)
        trained = runs.trained_by([worker.name for worker in workers], visible)
        counts = runs.count_by_state()
    return Status(
        version=version(),
        commit=commit(),
        workers=[
            WorkerStatus(
                name=worker.name,
                last_seen=worker.last_seen,
                run_id=trained.get(worker.name),
                draining=worker.drained_at is not None,
                trouble=worker.trouble,
                extensions=list(extensions_on(worker)),
            )
            for worker in workers
        ],
        queued=counts.get("queued", 0),
        running=counts.get("running", 0) + counts.get("stopping", 0),
        extensions=list(found_extensions()),
    )

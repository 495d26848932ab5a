"""The service at a glance."""

import time
from collections.abc import Sequence

from sqlalchemy.orm import Session

from server.database import tables
from server.runs.repository import RunRepository
from server.services import Services
from server.system.repository import WorkerRepository
from server.system.schemas import Status, Version, WorkerStatus
from server.version import commit, version

# A worker that was silent for longer has gone.
_LATELY_SECONDS = 60.0


def running_version() -> Version:
    """What is running."""
    return Version(version=version(), commit=commit())


def workers_lately(session: Session) -> Sequence[tables.Worker]:
    """The workers that are there."""
    return WorkerRepository(session).seen_since(time.time() - _LATELY_SECONDS)


def status(services: Services) -> Status:
    """Workers heard of lately, and how many runs wait and go on."""
    with services.database.read() as session:
        workers = workers_lately(session)
        runs = RunRepository(session)
        trained = runs.trained_by([worker.name for worker in workers])
        counts = runs.count_by_state()
    return Status(
        version=version(),
        commit=commit(),
        workers=[
            WorkerStatus(
                name=worker.name,
                last_seen=worker.last_seen,
                run_id=trained.get(worker.name),
                trouble=worker.trouble,
            )
            for worker in workers
        ],
        queued=counts.get("queued", 0),
        running=counts.get("running", 0) + counts.get("stopping", 0),
    )

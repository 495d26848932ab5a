"""Jobs' rows as JSON shows them."""

import time
from collections.abc import Sequence

from server.database import tables
from server.jobs.board import Board
from server.jobs.schemas import Job
from sim.extending.discovery import UsedExtension

# Of a job that is hardly begun nothing can be said.
_SAYS_SOMETHING = 0.02


def seconds_left(job: tables.Job, progress: float) -> float | None:
    """How long it will go on, at its pace so far; None where that is not known."""
    if job.state != "running" or job.started_at is None or progress < _SAYS_SOMETHING:
        return None
    return max(0.0, time.time() - job.started_at) * (1.0 - progress) / progress


def job_view(job: tables.Job, board: Board, lacking: Sequence[UsedExtension]) -> Job:
    """A job in JSON; `lacking` are the extensions that it waits for."""
    progress = 1.0 if job.state == "done" else board.progress(job.id)
    return Job(
        id=job.id,
        kind=job.kind,
        title=job.title,
        state=job.state,
        worker=job.worker,
        attempt=job.attempt,
        progress=progress,
        seconds_left=seconds_left(job, progress),
        error=job.error,
        waits_for=list(lacking),
        created_at=job.created_at,
        started_at=job.started_at,
        finished_at=job.finished_at,
    )

"""Waits for a job as long as its asker does: at once where its result is kept, and taken back where all askers have left."""

import asyncio
import time
from functools import partial
from pathlib import Path

from server.errors import JobFailedError, JobTimeoutError, NoWorkerError
from server.jobs.asked import Asked
from server.jobs.names import result_name
from server.jobs.needed import nobody_for
from server.jobs.repository import OPEN
from server.jobs.service import JobService
from server.outage import patiently
from server.services import Services

_LOOK_SECONDS = 1.0
# A machine that is busy training needs longer than the seconds that these jobs take.
TIMEOUT_SECONDS = 120.0
# A worker may be about to start, or to come back.
NO_WORKER_SECONDS = 15.0
_COME_AGAIN = 10.0


async def result_of(services: Services, asked: Asked) -> Path:
    """The file that comes out of a job; made now if it is not kept.

    Raises:
        JobFailedError: it can't be done.
        JobTimeoutError: it took too long.
        NoWorkerError: nobody is there to do it.
        BusyError: as many jobs wait as may.
    """
    lane, name = services.lanes.jobs, result_name(asked.spec.kind, asked.key)
    path = await lane.run(services.results.find, name)
    if path is None:
        await _until_done(services, await lane.run(JobService(services).ask, asked))
        path = await lane.run(services.results.find, name)
    if path is None:
        raise JobFailedError("what came out of it is not there any more: try again")
    return path


async def _until_done(services: Services, job_id: str) -> None:
    service, board, lane = JobService(services), services.board, services.lanes.jobs
    deadline = time.monotonic() + TIMEOUT_SECONDS
    nobody_since = time.monotonic()
    try:
        with board.asking(job_id) as ended:
            while True:
                job = await lane.run(service.find, job_id)
                if job.state not in OPEN:
                    break
                if board.closed:
                    raise JobTimeoutError("The server is about to end: try again later.", retry_after=_COME_AGAIN)
                now = time.monotonic()
                lacking = await lane.run(service.lacking, job)
                if job.state == "running" or (board.workers() and not lacking):
                    nobody_since = now
                if now - nobody_since > NO_WORKER_SECONDS:
                    raise NoWorkerError(nobody_for("does such work", lacking), retry_after=_COME_AGAIN)
                if now > deadline:
                    raise JobTimeoutError(
                        f"It took longer than {TIMEOUT_SECONDS:.0f} s: the machine is busy; try again later.",
                        retry_after=_COME_AGAIN,
                    )
                try:
                    async with asyncio.timeout(_LOOK_SECONDS):
                        await ended.wait()
                except TimeoutError:
                    continue
    except BaseException:
        # This request was cancelled, because its client has left, or has waited long enough.
        if not board.wanted(job_id):
            board.start(patiently(partial(lane.run, service.cancel, job_id)))
        raise
    if job.state != "done":
        raise JobFailedError(job.error or "it was cancelled")

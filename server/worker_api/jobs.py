"""Routes by which workers take up jobs and bring what comes out of them."""

import asyncio
import contextlib
import hashlib
import sys
import time
from collections.abc import AsyncIterator, Iterator
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from typing import Annotated, BinaryIO

from fastapi import APIRouter, Depends, Query, Request, Response
from fastapi.responses import StreamingResponse
from pydantic import ValidationError

from server.errors import CorruptUploadError, NotFoundError, TooLargeError
from server.jobs.names import result_name
from server.jobs.repository import AHEAD
from server.jobs.service import JobService
from server.replays.ahead import draw_ahead, key_of_evaluation
from server.security.permissions import WORK
from server.services import Services, ServicesDep
from server.worker_api.errors import MalformedUploadError
from workers.job_protocol import JobClaim, JobClaimRequest, JobEnd, JobOrders, JobReport, Measurement, ReplayJob
from workers.play_protocol import PlaySeen
from workers.protocol import MAX_INTEGER

router = APIRouter(prefix="/api/worker/jobs", tags=["worker"], include_in_schema=False)

MAX_RESULT_BYTES = 512 * 2**20
"""Of one recording or bundle."""
_BLOCK = 256 * 1024


async def _service(services: ServicesDep) -> JobService:
    return JobService(services)


JobServiceDep = Annotated[JobService, Depends(_service)]
AttemptQuery = Annotated[int, Query(ge=1, le=MAX_INTEGER)]
Sha256Query = Annotated[str, Query(pattern="^[0-9a-f]{64}$")]
RevisionQuery = Annotated[int, Query(ge=-1, le=MAX_INTEGER)]
"""Of a playground's orders: the newest that the worker has."""


@router.post("/claim", response_model=None, dependencies=[WORK])
async def claim_job(
    body: JobClaimRequest, request: Request, service: JobServiceDep, services: ServicesDep
) -> JobClaim | Response:
    """The next job; 204 where none came while the worker waited. A worker that has left gets none."""
    deadline = time.monotonic() + body.wait_seconds
    gone = asyncio.create_task(_until_gone(request))
    try:
        while not gone.done() and not services.board.closed:
            services.board.heard(body.worker, {one.name: one.version for one in body.extensions})
            with services.board.listening() as bell:
                claim = await services.lanes.jobs.run(service.claim, body)
                if claim is not None:
                    return claim
                remaining = deadline - time.monotonic()
                if remaining <= 0.0:
                    break
                rung = asyncio.create_task(bell.wait())
                await asyncio.wait({gone, rung}, timeout=remaining, return_when=asyncio.FIRST_COMPLETED)
                rung.cancel()
        return Response(status_code=204)
    finally:
        gone.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await gone


@router.get("/{job_id}/archive", dependencies=[WORK])
async def get_archive(
    job_id: str, attempt: AttemptQuery, service: JobServiceDep, services: ServicesDep
) -> StreamingResponse:
    """The archive of the job's policy."""
    lane = services.lanes.jobs
    try:
        blocks = await lane.run(service.archive, job_id, attempt)
    except NotFoundError as error:
        # It would be missed by the next worker too.
        await lane.run(service.end, job_id, attempt, JobEnd(outcome="failed", error=error.message))
        raise
    return StreamingResponse(lane.each(blocks), media_type="application/zip")


@router.get("/{job_id}/recordings/{number}", dependencies=[WORK])
async def get_recording(
    job_id: str, number: int, attempt: AttemptQuery, service: JobServiceDep, services: ServicesDep
) -> StreamingResponse:
    """What a film's policy of that number did."""
    lane = services.lanes.jobs
    try:
        file = await lane.run(service.recording, job_id, attempt, number)
    except NotFoundError as error:
        # Whoever asked for the film has it driven again.
        await lane.run(service.end, job_id, attempt, JobEnd(outcome="failed", error=error.message))
        raise
    return StreamingResponse(lane.each(_blocks(file)), media_type="application/octet-stream")


def _blocks(file: BinaryIO) -> Iterator[bytes]:
    with file:
        while block := file.read(_BLOCK):
            yield block


@router.get("/{job_id}/bag", dependencies=[WORK])
async def get_bag(job_id: str, attempt: AttemptQuery, service: JobServiceDep, services: ServicesDep) -> Response:
    """The robot's recording that the job reads."""
    lane = services.lanes.jobs
    try:
        content = await lane.run(service.bag, job_id, attempt)
    except NotFoundError as error:
        await lane.run(service.end, job_id, attempt, JobEnd(outcome="failed", error=error.message))
        raise
    return Response(content, media_type="application/octet-stream")


@router.post("/{job_id}/report", dependencies=[WORK])
async def report_job(
    job_id: str,
    attempt: AttemptQuery,
    body: JobReport,
    service: JobServiceDep,
    services: ServicesDep,
    revision: RevisionQuery = -1,
) -> JobOrders:
    """A sign of life; 409 where the job is no longer this attempt's."""
    await services.lanes.jobs.run(service.report, job_id, attempt, body.progress)
    return _orders(services, job_id, revision)


@router.post("/{job_id}/frames", dependencies=[WORK])
async def take_frames(
    job_id: str,
    attempt: AttemptQuery,
    request: Request,
    service: JobServiceDep,
    services: ServicesDep,
    revision: RevisionQuery = -1,
) -> JobOrders:
    """Moments of a view; answered as a report."""
    frames = await request.body()
    await services.lanes.jobs.run(service.report, job_id, attempt, 0.0)
    return _orders(services, job_id, revision, frames)


@router.post("/{job_id}/seen", dependencies=[WORK])
async def take_seen(
    job_id: str,
    attempt: AttemptQuery,
    seen: PlaySeen,
    service: JobServiceDep,
    services: ServicesDep,
    revision: RevisionQuery = -1,
) -> JobOrders:
    """What a playground's worker sees coming; answered as a report."""
    await services.lanes.jobs.run(service.report, job_id, attempt, 0.0)
    play = services.drivers.orders(job_id, revision, seen)
    return JobOrders(watch=services.drivers.frames(job_id), play=play)


def _orders(services: Services, job_id: str, revision: int, frames: bytes | None = None) -> JobOrders:
    watch = services.drivers.frames(job_id, frames)
    return JobOrders(watch=watch, play=services.drivers.orders(job_id, revision))


# The store has a cap of its own.
@router.put("/{job_id}/result", status_code=204, max_body_size=sys.maxsize, dependencies=[WORK])
async def put_result(
    job_id: str, attempt: AttemptQuery, sha256: Sha256Query, request: Request, service: JobServiceDep, services: ServicesDep
) -> None:
    """What came out of a job; refused where it is not what its checksum says."""
    lane = services.lanes.jobs
    job = await lane.run(service.current, job_id, attempt)
    async with _arrived(services, request, sha256) as torn:
        if job.kind == "evaluate":
            await lane.run(_keep_evaluation, services, job_id, attempt, torn.read_bytes())
        else:
            job = await lane.run(service.current, job_id, attempt)
            keep = partial(services.results.keep, torn, result_name(job.kind, job.key), ahead=job.priority == AHEAD)
            await lane.run(keep)
            if job.kind == "replay" and job.priority == AHEAD:
                await lane.run(draw_ahead, services, ReplayJob.model_validate(job.spec))


@router.put("/{job_id}/recording", status_code=204, max_body_size=sys.maxsize, dependencies=[WORK])
async def put_recording(
    job_id: str, attempt: AttemptQuery, sha256: Sha256Query, request: Request, service: JobServiceDep, services: ServicesDep
) -> None:
    """What the robots of an evaluation did, once its result is known; refused where it is not what its checksum says."""
    lane = services.lanes.jobs
    await lane.run(service.current, job_id, attempt)
    async with _arrived(services, request, sha256) as torn:
        await lane.run(service.current, job_id, attempt)
        if (key := await lane.run(key_of_evaluation, services, job_id)) is not None:
            await lane.run(services.results.keep, torn, result_name("replay", key))


@asynccontextmanager
async def _arrived(services: Services, request: Request, sha256: str) -> AsyncIterator[Path]:
    """The file that a request brings, as long as the block lasts.

    Raises:
        TooLargeError: it is larger than may be.
        CorruptUploadError: it is not what its checksum says.
    """
    lane = services.lanes.jobs
    torn = await lane.run(services.results.begin)
    try:
        digest, size = hashlib.sha256(), 0
        with torn.open("wb") as file:
            async for block in request.stream():
                size += len(block)
                if size > MAX_RESULT_BYTES:
                    raise TooLargeError(f"The result is larger than {MAX_RESULT_BYTES} bytes.")
                digest.update(block)
                await lane.run(file.write, block)
        if digest.hexdigest() != sha256:
            raise CorruptUploadError("What arrived does not have the SHA-256 that was announced: send it again.")
        yield torn
    finally:
        torn.unlink(missing_ok=True)


@router.post("/{job_id}/end", status_code=204, dependencies=[WORK])
async def end_job(job_id: str, attempt: AttemptQuery, body: JobEnd, service: JobServiceDep, services: ServicesDep) -> None:
    """The worker's last word."""
    await services.lanes.jobs.run(service.end, job_id, attempt, body)


def _keep_evaluation(services: Services, job_id: str, attempt: int, data: bytes) -> None:
    try:
        measurement = Measurement.model_validate_json(data)
    except ValidationError as error:
        raise MalformedUploadError(f"This is no evaluation: {error.errors()[0]['msg']}") from error
    JobService(services).evaluated(job_id, attempt, measurement)


async def _until_gone(request: Request) -> None:
    """Until the worker has closed the connection; the body has been read."""
    while (await request.receive())["type"] != "http.disconnect":
        pass

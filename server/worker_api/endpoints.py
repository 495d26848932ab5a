"""Routes for workers; the access checks let nobody in here without the workers' token."""

import asyncio
import contextlib
import sys
from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Depends, Path, Query, Request, WebSocket
from fastapi.responses import StreamingResponse
from pydantic import ValidationError
from starlette.websockets import WebSocketDisconnect

from server.checkpoints.archives import give_up_archives
from server.errors import TooLargeError
from server.ids import new_id
from server.run_log.service import LogService
from server.security.permissions import WORK
from server.security.principal import Principal, PrincipalDep, principal_of
from server.services import Services, ServicesDep
from server.worker_api.attempts import FencedError
from server.worker_api.batches import read_batch
from server.worker_api.errors import MalformedUploadError
from server.worker_api.ingest import Ingest, Report
from server.worker_api.links import OpenLink, OpenLinks
from server.worker_api.service import WorkerService
from workers.errors import FrameError
from workers.protocol import (
    CLOSE_FENCED,
    CLOSE_NOT_UNDERSTOOD,
    MAX_INTEGER,
    Batch,
    CheckpointUpload,
    Claim,
    ClaimRequest,
    Heartbeat,
    HeartbeatAnswer,
    LogBatch,
)

# Pages have no business here, so the routes stay out of the OpenAPI description that their types are made from.
router = APIRouter(prefix="/api/worker", tags=["worker"], include_in_schema=False)


async def _service(services: ServicesDep) -> WorkerService:
    return WorkerService(services)


WorkerServiceDep = Annotated[WorkerService, Depends(_service)]
# RFC 6455: the request violates the server's policy.
_POLICY_VIOLATION = 1008

AttemptQuery = Annotated[int, Query(ge=1, le=MAX_INTEGER)]
StepPath = Annotated[int, Path(ge=0, le=MAX_INTEGER)]


@router.post("/heartbeat", dependencies=[WORK])
async def heartbeat(body: Heartbeat, service: WorkerServiceDep, services: ServicesDep) -> HeartbeatAnswer:
    """A worker is there, and hears what it should do."""
    return await services.lanes.workers.run(service.heartbeat, body)


@router.post("/runs/{run_id}/claim", dependencies=[WORK])
async def claim_run(
    run_id: str, body: ClaimRequest, service: WorkerServiceDep, services: ServicesDep, principal: PrincipalDep
) -> Claim:
    """Take up a run; 409 where it is not to be had."""
    return await services.lanes.workers.run(service.claim, run_id, body, principal)


@router.post("/runs/{run_id}/log", status_code=204, dependencies=[WORK])
async def append_log(
    run_id: str,
    attempt: AttemptQuery,
    body: LogBatch,
    service: WorkerServiceDep,
    services: ServicesDep,
    principal: PrincipalDep,
) -> None:
    """What the trainer of an attempt has printed."""
    lane = services.lanes.workers
    await lane.run(service.check_claimed, run_id, principal)
    await lane.run(LogService(services).append, run_id, attempt, body)


# The file store has a cap of its own, which the settings say.
@router.put("/runs/{run_id}/checkpoints/{step}", status_code=204, max_body_size=sys.maxsize, dependencies=[WORK])
async def put_checkpoint(
    run_id: str,
    step: StepPath,
    attempt: AttemptQuery,
    request: Request,
    services: ServicesDep,
    service: WorkerServiceDep,
    principal: PrincipalDep,
) -> None:
    """One line of JSON (`CheckpointUpload`), then the archive."""
    stream = request.stream()
    upload, archive = await _split(stream, services.settings.max_body_bytes)
    lane = services.lanes.workers
    await lane.run(service.check_claimed, run_id, principal)
    archive_id = new_id()
    await lane.run(service.announce, run_id, attempt, upload.after_seq, archive_id)
    file = await services.files.write(archive_id, archive, upload.sha256)
    registered = False
    try:
        registered = await lane.run(service.register, run_id, attempt, step, file, upload)
    finally:
        if not registered:
            await lane.run(give_up_archives, services, [file.id])


@router.get("/checkpoints/{checkpoint_id}", dependencies=[WORK])
async def get_checkpoint(
    checkpoint_id: str, service: WorkerServiceDep, services: ServicesDep, principal: PrincipalDep
) -> StreamingResponse:
    """The archive of a checkpoint, for the worker that has its run."""
    lane = services.lanes.workers
    return StreamingResponse(
        lane.each(await lane.run(service.download, checkpoint_id, principal)), media_type="application/zip"
    )


@router.get("/runs/{run_id}/start", dependencies=[WORK])
async def get_start(
    run_id: str, service: WorkerServiceDep, services: ServicesDep, principal: PrincipalDep
) -> StreamingResponse:
    """The archive of the policy that a run begins with, for the worker that has the run."""
    lane = services.lanes.workers
    return StreamingResponse(lane.each(await lane.run(service.start, run_id, principal)), media_type="application/zip")


@router.websocket("/runs/{run_id}/link", dependencies=[WORK])
async def link(websocket: WebSocket, run_id: str, attempt: AttemptQuery, services: ServicesDep) -> None:
    """The link of a run: batches and frames come in, orders go out (`workers.protocol`)."""
    await websocket.accept()
    assert isinstance(services.links, OpenLinks)
    opened = OpenLink(websocket)
    principal = principal_of(websocket)
    try:
        await services.lanes.workers.run(WorkerService(services).check_claimed, run_id, principal)
        opened.tell(await services.links.ingest.receive(Report(run_id, attempt, Batch())))
    except FencedError:
        await websocket.close(CLOSE_FENCED, "this attempt is over")
        return
    services.leases.renew(run_id, attempt)
    services.links.add(run_id, opened)
    detach = services.live.attach(run_id, opened.watch)
    writer = asyncio.create_task(opened.write())
    revoked = asyncio.create_task(_cut_once_revoked(websocket, services, principal))
    try:
        await _receive(websocket, run_id, attempt, services, services.links.ingest, opened)
    finally:
        detach()
        services.links.remove(run_id, opened)
        revoked.cancel()
        writer.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await writer


async def _cut_once_revoked(websocket: WebSocket, services: Services, principal: Principal) -> None:
    await services.gate.until_changed(principal)
    with contextlib.suppress(RuntimeError, WebSocketDisconnect):
        await websocket.close(_POLICY_VIOLATION, "this token was revoked")


async def _receive(
    websocket: WebSocket, run_id: str, attempt: int, services: Services, ingest: Ingest, opened: OpenLink
) -> None:
    """Take in what the worker sends until the link ends."""
    try:
        while True:
            message = await websocket.receive()
            if message["type"] == "websocket.disconnect":
                return
            services.leases.renew(run_id, attempt)
            if (frame := message.get("bytes")) is not None:
                services.live.frames(run_id, frame)
            else:
                batch, refused = read_batch(message["text"])
                damaged = None
                if batch.final is not None and batch.final.outcome == "damaged":
                    # Here and not with the other reports: reading an archive takes longer than storing them.
                    damaged = await services.lanes.workers.run(WorkerService(services).damaged, run_id)
                with services.instruments.ingest.time():
                    orders = await ingest.receive(Report(run_id, attempt, batch, refused, damaged))
                opened.tell(orders)
    except FencedError:
        opened.fence()
        # The worker answers the close; waiting for that lets it arrive.
        while (await websocket.receive())["type"] != "websocket.disconnect":
            pass
    except (ValidationError, FrameError) as error:
        await websocket.close(CLOSE_NOT_UNDERSTOOD, str(error)[:100])
    except (WebSocketDisconnect, RuntimeError):
        return


async def _split(stream: AsyncIterator[bytes], limit: int) -> tuple[CheckpointUpload, AsyncIterator[bytes]]:
    """The first line of a body, and the rest."""
    head = b""
    async for block in stream:
        head += block
        if b"\n" in head:
            break
        if len(head) > limit:
            raise TooLargeError(f"The description of a checkpoint is larger than {limit} bytes.")
    line, found, start = head.partition(b"\n")
    try:
        upload = CheckpointUpload.model_validate_json(line)
    except ValidationError as error:
        raise MalformedUploadError(f"The first line does not describe a checkpoint: {error}") from error
    if not found:
        raise MalformedUploadError("There is nothing after the first line.")

    async def rest() -> AsyncIterator[bytes]:
        yield start
        async for block in stream:
            yield block

    return upload, rest()

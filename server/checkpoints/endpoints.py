"""Routes of checkpoints."""

import re
from typing import Annotated

from fastapi import APIRouter, Depends, Header, Query
from fastapi.responses import StreamingResponse

from server.checkpoints.schemas import CheckpointPage, CheckpointSteps, Episodes
from server.checkpoints.service import CheckpointService, Rest
from server.http.conditional import NOT_MODIFIED, KeptDep
from server.http.paging import WindowDep
from server.http.problems import NOT_FOUND, Responses
from server.security.permissions import view
from server.services import ServicesDep

router = APIRouter(tags=["checkpoints"])

_ZIP: Responses = {200: {"content": {"application/zip": {"schema": {"type": "string", "format": "binary"}}}}}

# What a run's list is made of: of runs themselves only whether they are there, and they go with their experiment.
LISTED_FROM = ("experiments", "checkpoints", "evaluations")


async def _service(services: ServicesDep) -> CheckpointService:
    return CheckpointService(services)


CheckpointServiceDep = Annotated[CheckpointService, Depends(_service)]


@router.get("/api/runs/{run_id}/checkpoints", responses=NOT_FOUND | NOT_MODIFIED, dependencies=[view("run_id")])
def list_checkpoints(
    run_id: str,
    service: CheckpointServiceDep,
    services: ServicesDep,
    kept: KeptDep,
    window: WindowDep,
    step: Annotated[int | None, Query(ge=0, le=2**62, description="Only that of this step.")] = None,
) -> CheckpointPage:
    """The run's checkpoints, the newest first."""
    kept.unless(services.database.writes.of(*LISTED_FROM), run_id, window, step)
    return service.of_run(run_id, window, step)


@router.get("/api/runs/{run_id}/checkpoints/steps", responses=NOT_FOUND | NOT_MODIFIED, dependencies=[view("run_id")])
def list_checkpoint_steps(
    run_id: str, service: CheckpointServiceDep, services: ServicesDep, kept: KeptDep
) -> CheckpointSteps:
    """The way of a run by its checkpoints, the oldest first."""
    kept.unless(services.database.writes.of(*LISTED_FROM), run_id)
    return service.steps(run_id)


@router.get(
    "/api/checkpoints/{checkpoint_id}/download",
    response_class=StreamingResponse,
    responses=NOT_FOUND | NOT_MODIFIED | _ZIP,
    dependencies=[view("checkpoint_id")],
)
async def download_checkpoint(
    checkpoint_id: str,
    service: CheckpointServiceDep,
    services: ServicesDep,
    kept: KeptDep,
    wanted: Annotated[str | None, Header(alias="Range", max_length=100)] = None,
    only_if: Annotated[str | None, Header(alias="If-Range", max_length=100)] = None,
) -> StreamingResponse:
    """The archive: weights as safetensors, manifest as JSON, and the state to resume.

    `ETag` is its SHA-256. With that as `If-Range` and `Range: bytes=N-` a download that broke off goes on.
    """
    lane = services.lanes.downloads
    validators = kept.unless_file((await lane.run(service.described, checkpoint_id)).sha256)
    download = await lane.run(service.take_home, checkpoint_id, _rest(wanted, only_if))
    archive, start = download.archive, download.start
    headers = {
        "Content-Disposition": f'attachment; filename="{archive.file_name}"',
        "Content-Length": str(archive.size - start),
        **validators,
        "Accept-Ranges": "bytes",
    }
    if start:
        headers["Content-Range"] = f"bytes {start}-{archive.size - 1}/{archive.size}"
    blocks = lane.each(download.blocks)
    return StreamingResponse(blocks, 206 if start else 200, media_type="application/zip", headers=headers)


def _rest(wanted: str | None, only_if: str | None) -> Rest | None:
    """From which byte on; all of it where anything else is asked for, as RFC 9110 (14.2) allows."""
    match = re.fullmatch(r"bytes=(\d{1,15})-", wanted or "")
    return Rest(int(match[1]), only_if.strip('"')) if match and only_if else None


@router.get(
    "/api/checkpoints/{checkpoint_id}/episodes",
    responses=NOT_FOUND | NOT_MODIFIED,
    dependencies=[view("checkpoint_id")],
)
def list_episodes(checkpoint_id: str, service: CheckpointServiceDep, kept: KeptDep) -> Episodes:
    """Every episode behind the checkpoint's figures."""
    kept.unless(checkpoint_id, service.evaluated_at(checkpoint_id))
    return service.episodes(checkpoint_id)

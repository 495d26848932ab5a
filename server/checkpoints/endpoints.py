"""Routes of checkpoints."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query
from fastapi.responses import StreamingResponse

from server.checkpoints.schemas import CheckpointPage, Episodes
from server.checkpoints.service import CheckpointService
from server.paging import WindowDep
from server.problems import NOT_FOUND, Responses
from server.security.permissions import view
from server.services import ServicesDep

router = APIRouter(tags=["checkpoints"])

_ZIP: Responses = {200: {"content": {"application/zip": {"schema": {"type": "string", "format": "binary"}}}}}


def _service(services: ServicesDep) -> CheckpointService:
    return CheckpointService(services)


CheckpointServiceDep = Annotated[CheckpointService, Depends(_service)]


@router.get("/api/runs/{run_id}/checkpoints", responses=NOT_FOUND, dependencies=[view("run_id")])
def list_checkpoints(
    run_id: str,
    service: CheckpointServiceDep,
    window: WindowDep,
    step: Annotated[int | None, Query(ge=0, le=2**62, description="Only that of this step.")] = None,
) -> CheckpointPage:
    """The run's checkpoints, the newest first."""
    return service.of_run(run_id, window, step)


@router.get(
    "/api/checkpoints/{checkpoint_id}/download",
    response_class=StreamingResponse,
    responses=NOT_FOUND | _ZIP,
    dependencies=[view("checkpoint_id")],
)
async def download_checkpoint(checkpoint_id: str, service: CheckpointServiceDep, services: ServicesDep) -> StreamingResponse:
    """The archive: weights as safetensors, manifest as JSON, and the state to resume."""
    lane = services.lanes.downloads
    download = await lane.run(service.take_home, checkpoint_id)
    headers = {
        "Content-Disposition": f'attachment; filename="{download.archive.file_name}"',
        "Content-Length": str(download.archive.size),
        "ETag": f'"{download.archive.sha256}"',
    }
    return StreamingResponse(lane.each(download.blocks), media_type="application/zip", headers=headers)


@router.get("/api/checkpoints/{checkpoint_id}/episodes", responses=NOT_FOUND, dependencies=[view("checkpoint_id")])
def list_episodes(checkpoint_id: str, service: CheckpointServiceDep) -> Episodes:
    """Every episode behind the checkpoint's figures."""
    return service.episodes(checkpoint_id)

"""Routes of a run's log."""

from typing import Annotated

from fastapi import APIRouter, Query
from fastapi.responses import StreamingResponse

from server.http.problems import NOT_FOUND, Responses
from server.run_log.schemas import RunLog
from server.run_log.service import LogService
from server.security.permissions import view
from server.services import ServicesDep

router = APIRouter(prefix="/api/runs", tags=["runs"])

_TEXT: Responses = {200: {"content": {"text/plain": {"schema": {"type": "string"}}}}}


@router.get("/{run_id}/log", responses=NOT_FOUND, dependencies=[view("run_id")])
def get_log(
    run_id: str,
    services: ServicesDep,
    search: Annotated[str, Query(max_length=200, description="Only lines that hold this, whatever its case.")] = "",
    limit: Annotated[int, Query(ge=1, le=5_000, description="Lines at most, the last of all.")] = 500,
) -> RunLog:
    """What the trainer printed and what happened, in one stream."""
    return LogService(services).end(run_id, limit, search)


@router.get(
    "/{run_id}/log/text",
    response_class=StreamingResponse,
    responses=NOT_FOUND | _TEXT,
    dependencies=[view("run_id")],
)
async def download_log(run_id: str, services: ServicesDep) -> StreamingResponse:
    """All that is kept of it, as text."""
    lane = services.lanes.downloads
    blocks = await lane.run(LogService(services).text, run_id)
    headers = {"Content-Disposition": f'attachment; filename="mapless-{run_id}.log"'}
    return StreamingResponse(lane.each(blocks), media_type="text/plain; charset=utf-8", headers=headers)

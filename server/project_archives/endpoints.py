"""Routes of whole projects, out and in."""

import sys

from fastapi import APIRouter, Request
from fastapi.responses import StreamingResponse

from server.http.problems import NOT_FOUND, Responses
from server.project_archives.arriving import ProjectArrival
from server.project_archives.leaving import leaving
from server.project_archives.schemas import ProjectImport
from server.security.permissions import edit, view
from server.security.principal import PrincipalDep
from server.services import ServicesDep

router = APIRouter(prefix="/api/projects/{project_id}", tags=["projects"])

_CONTENT = {"application/x-tar": {"schema": {"type": "string", "format": "binary"}}}
_TAR: Responses = {200: {"content": _CONTENT}}
_BODY = {"requestBody": {"required": True, "content": _CONTENT}}


@router.get("/export", response_class=StreamingResponse, responses=NOT_FOUND | _TAR, dependencies=[view("project_id")])
async def export_project(project_id: str, services: ServicesDep) -> StreamingResponse:
    """All of the project in one file, checkpoints included, for another server."""
    lane = services.lanes.downloads
    file = await lane.run(leaving, services, project_id)
    headers = {"Content-Disposition": f'attachment; filename="{file.name}"'}
    return StreamingResponse(lane.each(file.blocks), media_type=file.media_type, headers=headers)


# Each checkpoint in it has the file store's cap.
@router.post(
    "/import",
    responses=NOT_FOUND,
    max_body_size=sys.maxsize,
    openapi_extra=_BODY,
    dependencies=[edit("project_id")],
)
async def import_project(project_id: str, request: Request, services: ServicesDep, principal: PrincipalDep) -> ProjectImport:
    """Take what another server exported, with the same ids: each run whole, or not at all; sent again, it goes on.

    Evaluations of shipped policies and baselines, which everybody sees, are taken from administrators of the installation.
    """
    arrival = ProjectArrival(services, project_id, of_everybodys=principal.administrates)
    return await arrival.take(request.stream())

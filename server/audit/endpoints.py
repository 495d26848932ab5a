"""Routes of the audit log."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query
from fastapi.responses import StreamingResponse

from server.audit.repository import AuditFilter
from server.audit.schemas import AuditEntry
from server.audit.service import AuditService
from server.http.paging import WindowDep
from server.http.problems import Responses
from server.schemas import Page
from server.security.permissions import ADMINISTRATE
from server.services import ServicesDep

router = APIRouter(prefix="/api/audit", tags=["audit"])

_CSV: Responses = {200: {"content": {"text/csv": {"schema": {"type": "string"}}}}}


async def _filter(
    actor: Annotated[str | None, Query(max_length=120)] = None,
    action: Annotated[str | None, Query(max_length=40, description="KIND.DEED, or all of a KIND.")] = None,
    target: Annotated[str | None, Query(max_length=64, description="Id of what it was done to.")] = None,
    project: Annotated[str | None, Query(max_length=16, description="Its id.")] = None,
    since: Annotated[float | None, Query(description="Seconds since the epoch, included.")] = None,
    until: Annotated[float | None, Query(description="Seconds since the epoch, not included.")] = None,
) -> AuditFilter:
    return AuditFilter(actor, action, target, project, since, until)


FilterDep = Annotated[AuditFilter, Depends(_filter)]


@router.get("", dependencies=[ADMINISTRATE])
def list_audit_entries(wanted: FilterDep, window: WindowDep, services: ServicesDep) -> Page[AuditEntry]:
    """Who did what, the newest first."""
    return AuditService(services).page(wanted, window)


@router.get("/csv", response_class=StreamingResponse, responses=_CSV, dependencies=[ADMINISTRATE])
async def export_audit_entries(wanted: FilterDep, services: ServicesDep) -> StreamingResponse:
    """The same as a table for a spreadsheet, all of it."""
    headers = {"Content-Disposition": 'attachment; filename="mapless-audit.csv"'}
    blocks = services.lanes.downloads.each(AuditService(services).csv(wanted))
    return StreamingResponse(blocks, media_type="text/csv", headers=headers)

"""Routes of a run."""

from typing import Annotated

from fastapi import APIRouter, Depends

from server.http.paging import PartDep
from server.http.problems import CONFLICT, NOT_FOUND
from server.runs.schemas import RunDetail, RunEvent
from server.runs.service import RunService
from server.security.permissions import edit, view
from server.services import ServicesDep

router = APIRouter(prefix="/api/runs", tags=["runs"])


async def _service(services: ServicesDep) -> RunService:
    return RunService(services)


RunServiceDep = Annotated[RunService, Depends(_service)]


@router.get("/{run_id}", responses=NOT_FOUND, dependencies=[view("run_id")])
def get_run(run_id: str, service: RunServiceDep) -> RunDetail:
    """A run with what it trains."""
    return service.get(run_id)


@router.post("/{run_id}/stop", responses=NOT_FOUND | CONFLICT, dependencies=[edit("run_id")])
def stop_run(run_id: str, service: RunServiceDep) -> RunDetail:
    """End the run: its worker writes a checkpoint first."""
    return service.stop(run_id)


@router.post("/{run_id}/resume", responses=NOT_FOUND | CONFLICT, dependencies=[edit("run_id")])
def resume_run(run_id: str, service: RunServiceDep) -> RunDetail:
    """Go on from the last checkpoint."""
    return service.resume(run_id)


@router.get("/{run_id}/events", responses=NOT_FOUND, dependencies=[view("run_id")])
def list_events(run_id: str, service: RunServiceDep, part: PartDep) -> list[RunEvent]:
    """The run's event log, oldest first."""
    events, total = service.events(run_id, part)
    part.counted(total)
    return events

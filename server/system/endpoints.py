"""Routes of the service itself."""

from typing import Annotated

from fastapi import APIRouter, Depends, Request, Response, status

from server.http.problems import NOT_FOUND
from server.security.permissions import ADMINISTRATE, OPEN, SIGNED_IN
from server.security.principal import PrincipalDep
from server.services import ServicesDep
from server.system import service
from server.system.readiness import ReadinessProbe
from server.system.schemas import Readiness, Status, Version, WorkerName

router = APIRouter(tags=["system"])


async def _readiness(request: Request) -> ReadinessProbe:
    probe: ReadinessProbe = request.app.state.readiness
    return probe


ReadinessDep = Annotated[ReadinessProbe, Depends(_readiness)]


@router.get("/api/version", dependencies=[SIGNED_IN])
def get_version() -> Version:
    """What is running."""
    return service.running_version()


@router.get("/api/status", dependencies=[SIGNED_IN])
def get_status(services: ServicesDep, principal: PrincipalDep) -> Status:
    """Workers heard of lately, and how many runs wait and go on."""
    return service.status(services, principal.visible)


@router.post("/api/workers/drain", responses=NOT_FOUND, dependencies=[ADMINISTRATE])
def drain_worker(request: WorkerName, services: ServicesDep) -> Status:
    """Let a worker finish its runs, take up no more, and end."""
    return service.drain(services, request.worker)


@router.api_route("/healthz", methods=["GET", "HEAD"], include_in_schema=False, dependencies=[OPEN])
async def check_health() -> dict[str, str]:
    """The process is alive and answers; open to everybody."""
    return {"status": "ok"}


@router.api_route("/readyz", methods=["GET", "HEAD"], include_in_schema=False, dependencies=[OPEN])
async def check_readiness(probe: ReadinessDep, response: Response) -> Readiness:
    """Whether database, store, sweeper and threads answer, 503 where one does not; open to everybody, tells no more."""
    readiness = await probe.ask()
    if not readiness.ready:
        response.status_code = status.HTTP_503_SERVICE_UNAVAILABLE
    return readiness

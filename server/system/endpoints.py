"""Routes of the service itself."""

from fastapi import APIRouter

from server.services import ServicesDep
from server.system import service
from server.system.schemas import Status, Version

router = APIRouter(tags=["system"])


@router.get("/api/version")
def get_version() -> Version:
    """What is running."""
    return service.running_version()


@router.get("/api/status")
def get_status(services: ServicesDep) -> Status:
    """Workers heard of lately, and how many runs wait and go on."""
    return service.status(services)


@router.api_route("/healthz", methods=["GET", "HEAD"], include_in_schema=False)
def check_health(services: ServicesDep) -> dict[str, str]:
    """Answers once the database does; open to everybody, and tells nothing."""
    services.database.ping()
    return {"status": "ok"}

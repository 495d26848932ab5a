"""Routes of suites of one's own."""

from fastapi import APIRouter

from server.http.paging import PartDep
from server.http.problems import CONFLICT, NOT_FOUND
from server.security.permissions import ADMINISTRATE, LAUNCH, SIGNED_IN
from server.services import ServicesDep
from server.suites import service
from server.suites.schemas import NewScenario, OwnSuite, OwnSuiteName

router = APIRouter(prefix="/api/suites", tags=["evaluations"])


@router.get("", dependencies=[SIGNED_IN])
def list_own_suites(services: ServicesDep, part: PartDep) -> list[OwnSuite]:
    """Suites that people have put together, by name."""
    return part.of(service.every(services))


@router.post("", status_code=201, responses=CONFLICT, dependencies=[LAUNCH])
def make_own_suite(suite: OwnSuiteName, services: ServicesDep) -> OwnSuite:
    """Begin a suite."""
    return service.make(services, suite.name)


@router.post("/{suite_id}/scenarios", responses=NOT_FOUND | CONFLICT, dependencies=[LAUNCH])
async def add_own_scenario(suite_id: str, scenario: NewScenario, services: ServicesDep) -> OwnSuite:
    """Add an arena of the gallery, with its start and target, to a suite."""
    return await services.lanes.reviews.run(service.add_scenario, services, suite_id, scenario.sha256)


@router.delete("/{suite_id}/scenarios/{sha256}", responses=NOT_FOUND, dependencies=[LAUNCH])
def remove_own_scenario(suite_id: str, sha256: str, services: ServicesDep) -> OwnSuite:
    """Take a scenario out of a suite."""
    return service.remove_scenario(services, suite_id, sha256)


@router.delete("/{suite_id}", status_code=204, responses=NOT_FOUND, dependencies=[ADMINISTRATE])
def delete_own_suite(suite_id: str, services: ServicesDep) -> None:
    """Forget a suite; what was measured on it stays."""
    service.delete(services, suite_id)

"""Routes of the reproduction."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query, status

from server.database.tables import DEFAULT_PROJECT
from server.http.conditional import NOT_MODIFIED, KeptDep
from server.http.problems import CONFLICT, NOT_FOUND
from server.reproduction.schemas import CampaignCreate, Reproduction
from server.reproduction.service import ReproductionService
from server.security.permissions import LAUNCH, edit, view
from server.security.principal import PrincipalDep
from server.services import ServicesDep

router = APIRouter(prefix="/api/reproduction", tags=["reproduction"])


async def _service(services: ServicesDep) -> ReproductionService:
    return ReproductionService(services)


ReproductionServiceDep = Annotated[ReproductionService, Depends(_service)]


@router.get("", responses=NOT_FOUND | NOT_MODIFIED, dependencies=[view("campaign")])
def get_reproduction(
    service: ReproductionServiceDep,
    kept: KeptDep,
    principal: PrincipalDep,
    campaign: Annotated[str | None, Query(max_length=16, description="Its id; the newest without it.")] = None,
) -> Reproduction:
    """The paper and ours, side by side."""
    kept.unless(service.state(campaign, principal.visible))
    return service.get(campaign, principal.visible)


@router.post("", status_code=status.HTTP_201_CREATED, responses=NOT_FOUND | CONFLICT, dependencies=[LAUNCH])
def launch_reproduction(
    request: CampaignCreate,
    service: ReproductionServiceDep,
    principal: PrincipalDep,
    project: Annotated[
        str, Query(max_length=16, description="Id of the project that it is launched into.")
    ] = DEFAULT_PROJECT,
) -> Reproduction:
    """Launch every row of the paper's tables, all seeds, as one campaign."""
    principal.require("editor", project)
    return service.launch(request, project)


@router.delete(
    "/{campaign_id}", status_code=status.HTTP_204_NO_CONTENT, responses=NOT_FOUND, dependencies=[edit("campaign_id")]
)
def delete_reproduction(campaign_id: str, service: ReproductionServiceDep) -> None:
    """Delete a campaign: its experiments, runs, curves and checkpoints."""
    service.delete(campaign_id)


@router.post("/{campaign_id}/stop", responses=NOT_FOUND | CONFLICT, dependencies=[edit("campaign_id")])
def stop_reproduction(campaign_id: str, service: ReproductionServiceDep) -> Reproduction:
    """End every run of the campaign that has not ended."""
    return service.stop(campaign_id)


@router.post("/{campaign_id}/resume", responses=NOT_FOUND | CONFLICT, dependencies=[edit("campaign_id")])
def resume_reproduction(campaign_id: str, service: ReproductionServiceDep) -> Reproduction:
    """Go on with every run of the campaign that was stopped or has failed."""
    return service.resume(campaign_id)


@router.post("/{campaign_id}/seeds", responses=NOT_FOUND | CONFLICT, dependencies=[edit("campaign_id")])
def add_seeds_to_reproduction(campaign_id: str, service: ReproductionServiceDep) -> Reproduction:
    """Train the rows whose intervals are wider than their margins with five more seeds each, up to forty."""
    return service.add_seeds(campaign_id)

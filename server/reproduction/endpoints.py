"""Routes of the reproduction."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query, status

from server.problems import CONFLICT, NOT_FOUND
from server.reproduction.schemas import CampaignCreate, Reproduction
from server.reproduction.service import ReproductionService
from server.services import ServicesDep

router = APIRouter(prefix="/api/reproduction", tags=["reproduction"])


def _service(services: ServicesDep) -> ReproductionService:
    return ReproductionService(services)


ReproductionServiceDep = Annotated[ReproductionService, Depends(_service)]


@router.get("", responses=NOT_FOUND)
def get_reproduction(
    service: ReproductionServiceDep,
    campaign: Annotated[str | None, Query(max_length=16, description="Its id; the newest without it.")] = None,
) -> Reproduction:
    """The paper and ours, side by side."""
    return service.get(campaign)


@router.post("", status_code=status.HTTP_201_CREATED, responses=CONFLICT)
def launch_reproduction(request: CampaignCreate, service: ReproductionServiceDep) -> Reproduction:
    """Launch every row of the paper's tables, all seeds, as one campaign."""
    return service.launch(request)


@router.delete("/{campaign_id}", status_code=status.HTTP_204_NO_CONTENT, responses=NOT_FOUND)
def delete_reproduction(campaign_id: str, service: ReproductionServiceDep) -> None:
    """Delete a campaign: its experiments, runs, curves and checkpoints."""
    service.delete(campaign_id)


@router.post("/{campaign_id}/stop", responses=NOT_FOUND | CONFLICT)
def stop_reproduction(campaign_id: str, service: ReproductionServiceDep) -> Reproduction:
    """End every run of the campaign that has not ended."""
    return service.stop(campaign_id)


@router.post("/{campaign_id}/resume", responses=NOT_FOUND | CONFLICT)
def resume_reproduction(campaign_id: str, service: ReproductionServiceDep) -> Reproduction:
    """Go on with every run of the campaign that was stopped or has failed."""
    return service.resume(campaign_id)

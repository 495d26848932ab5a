"""Routes of where trainings begin."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query

from server.http.paging import PartDep
from server.http.problems import NOT_FOUND
from server.lineage.schemas import Lineage, StartPolicy
from server.lineage.service import LineageService
from server.security.permissions import SIGNED_IN, view
from server.security.principal import PrincipalDep
from server.services import ServicesDep

router = APIRouter(tags=["lineage"])


async def _service(services: ServicesDep) -> LineageService:
    return LineageService(services)


LineageServiceDep = Annotated[LineageService, Depends(_service)]


@router.get("/api/training/starts", dependencies=[SIGNED_IN])
def list_start_policies(
    service: LineageServiceDep,
    principal: PrincipalDep,
    part: PartDep,
    search: Annotated[str, Query(max_length=120, description="Part of a training's name, or of a policy's title.")] = "",
) -> list[StartPolicy]:
    """Policies that a training may begin with: of one's newest runs the best and the last, and those that ship."""
    return part.of(service.policies(search, principal.visible))


@router.get("/api/checkpoints/{checkpoint_id}/start", responses=NOT_FOUND, dependencies=[view("checkpoint_id")])
def get_start_policy(checkpoint_id: str, service: LineageServiceDep) -> StartPolicy:
    """A checkpoint as a policy that a training may begin with."""
    return service.policy(checkpoint_id)


@router.get("/api/experiments/{experiment_id}/lineage", responses=NOT_FOUND, dependencies=[view("experiment_id")])
def get_experiment_lineage(experiment_id: str, service: LineageServiceDep, principal: PrincipalDep) -> Lineage:
    """What it began with, and what began with a checkpoint of it."""
    return service.of_experiment(experiment_id, principal)


@router.get("/api/runs/{run_id}/lineage", responses=NOT_FOUND, dependencies=[view("run_id")])
def get_run_lineage(run_id: str, service: LineageServiceDep, principal: PrincipalDep) -> Lineage:
    """What it began with, and what began with a checkpoint of this run alone."""
    return service.of_run(run_id, principal)

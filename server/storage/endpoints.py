"""Routes of disk use and rules for checkpoints."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query

from server.http.paging import WindowDep
from server.http.problems import NOT_FOUND
from server.security.permissions import SIGNED_IN, edit, view
from server.security.principal import PrincipalDep
from server.services import ServicesDep
from server.storage.rule import KeepRule
from server.storage.schemas import RuleChange, Storage, Thinning
from server.storage.service import StorageService

router = APIRouter(tags=["storage"])


async def _service(services: ServicesDep) -> StorageService:
    return StorageService(services)


StorageServiceDep = Annotated[StorageService, Depends(_service)]


@router.get("/api/storage", dependencies=[SIGNED_IN])
def list_storage(service: StorageServiceDep, principal: PrincipalDep, window: WindowDep) -> Storage:
    """What experiments take of the disk, the largest first."""
    return service.page(principal, window)


@router.get("/api/experiments/{experiment_id}/thinning", responses=NOT_FOUND, dependencies=[view("experiment_id")])
def preview_thinning(
    experiment_id: str,
    service: StorageServiceDep,
    last: Annotated[int | None, Query(ge=1, le=10_000, description="So many newest ones stay; all if not given.")] = None,
    every: Annotated[int | None, Query(ge=1, le=10_000, description="Each so many-th as well; goes with `last`.")] = None,
    best: Annotated[bool, Query(description="The best one as well.")] = True,
) -> Thinning:
    """What a rule would take of an experiment, and leave; nothing is changed."""
    return service.preview(experiment_id, KeepRule(last=last, every=every if last is not None else None, best=best))


@router.put("/api/experiments/{experiment_id}/thinning", responses=NOT_FOUND, dependencies=[edit("experiment_id")])
def change_thinning(experiment_id: str, change: RuleChange, service: StorageServiceDep) -> Thinning:
    """Give an experiment a rule: what it takes goes after some days, and what was to go otherwise stays."""
    return service.change(experiment_id, change.rule)


@router.post("/api/experiments/{experiment_id}/thinning/free", responses=NOT_FOUND, dependencies=[edit("experiment_id")])
def free_storage(experiment_id: str, service: StorageServiceDep) -> Thinning:
    """Remove what goes of an experiment now, not after its days: it begins at once, and pages hear of it as it goes on."""
    service.free(experiment_id)
    return service.state(experiment_id)

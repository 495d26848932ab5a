"""Routes of the gallery."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query, status

from server.arenas.schemas import MAX_UPLOAD_BYTES, ArenaSummary, ArenaUpload, ArenaView
from server.arenas.service import ArenaService
from server.problems import CONFLICT, NOT_FOUND
from server.security.permissions import ADMINISTRATE, LAUNCH, SIGNED_IN
from server.services import ServicesDep
from sim.config import ArenaConfig, ArenaName

router = APIRouter(prefix="/api/arenas", tags=["arenas"])


def _service(services: ServicesDep) -> ArenaService:
    return ArenaService(services)


ArenaServiceDep = Annotated[ArenaService, Depends(_service)]


@router.get("", dependencies=[SIGNED_IN])
def list_arenas(service: ArenaServiceDep) -> list[ArenaSummary]:
    """Every arena that can be trained on."""
    return service.gallery()


@router.get("/fixed", dependencies=[SIGNED_IN])
def get_fixed_arena(name: ArenaName, service: ArenaServiceDep) -> ArenaView:
    """A built-in arena."""
    return service.fixed(ArenaConfig(name=name))


@router.get("/generated", responses=NOT_FOUND, dependencies=[SIGNED_IN])
def get_generated_arena(
    name: Annotated[str, Query(max_length=64)],
    service: ArenaServiceDep,
    difficulty: Annotated[float, Query(ge=0.0, le=1.0)] = 0.5,
    seed: Annotated[int, Query(ge=0, le=2**31 - 1)] = 0,
) -> ArenaView:
    """The first of a family's maps."""
    return service.generated(name, difficulty, seed)


@router.get("/imported/{sha256}", responses=NOT_FOUND, dependencies=[SIGNED_IN])
def get_imported_arena(sha256: str, service: ArenaServiceDep) -> ArenaView:
    """An imported arena."""
    return service.imported(sha256)


@router.post("/imported", responses=CONFLICT, max_body_size=MAX_UPLOAD_BYTES, dependencies=[LAUNCH])
def upload_arena(upload: ArenaUpload, service: ArenaServiceDep) -> ArenaView:
    """Look at an arena's files, or import them."""
    return service.upload(upload)


@router.delete(
    "/imported/{sha256}", status_code=status.HTTP_204_NO_CONTENT, responses=NOT_FOUND | CONFLICT, dependencies=[ADMINISTRATE]
)
def delete_arena(sha256: str, service: ArenaServiceDep) -> None:
    """Remove an imported arena that no training uses."""
    service.delete(sha256)

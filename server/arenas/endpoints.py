"""Routes of the gallery."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query, status

from server.arenas.schemas import (
    MAX_REVIEW_BYTES,
    MAX_UPLOAD_BYTES,
    ArenaReview,
    ArenaReviewRequest,
    ArenaSummary,
    ArenaUpload,
    ArenaView,
)
from server.arenas.service import ArenaService
from server.http.conditional import NOT_MODIFIED, KeptDep
from server.http.paging import PartDep
from server.http.problems import CONFLICT, NOT_FOUND
from server.security.permissions import ADMINISTRATE, LAUNCH, SIGNED_IN
from server.services import ServicesDep
from sim.config import ArenaConfig, ArenaName

router = APIRouter(prefix="/api/arenas", tags=["arenas"])


async def _service(services: ServicesDep) -> ArenaService:
    return ArenaService(services)


ArenaServiceDep = Annotated[ArenaService, Depends(_service)]


@router.get("", dependencies=[SIGNED_IN])
def list_arenas(service: ArenaServiceDep, part: PartDep) -> list[ArenaSummary]:
    """Every arena that can be trained on."""
    return part.of(service.gallery())


@router.get("/fixed", responses=NOT_MODIFIED, dependencies=[SIGNED_IN])
def get_fixed_arena(name: ArenaName, service: ArenaServiceDep, kept: KeptDep) -> ArenaView:
    """A built-in arena."""
    kept.unless(name)
    return service.fixed(ArenaConfig(name=name))


@router.get("/generated", responses=NOT_FOUND | NOT_MODIFIED, dependencies=[SIGNED_IN])
def get_generated_arena(
    name: Annotated[str, Query(max_length=64)],
    service: ArenaServiceDep,
    kept: KeptDep,
    difficulty: Annotated[float, Query(ge=0.0, le=1.0)] = 0.5,
    seed: Annotated[int, Query(ge=0, le=2**31 - 1)] = 0,
) -> ArenaView:
    """The first of a family's maps."""
    kept.unless(name, difficulty, seed)
    return service.generated(name, difficulty, seed)


@router.get("/imported/{sha256}", responses=NOT_FOUND | NOT_MODIFIED, dependencies=[SIGNED_IN])
def get_imported_arena(sha256: str, service: ArenaServiceDep, kept: KeptDep) -> ArenaView:
    """An imported arena."""
    kept.unless(sha256, service.uses(sha256))
    return service.imported(sha256)


@router.post("/imported", responses=CONFLICT, max_body_size=MAX_UPLOAD_BYTES, dependencies=[LAUNCH])
def upload_arena(upload: ArenaUpload, service: ArenaServiceDep) -> ArenaView:
    """Look at an arena's files, or import them."""
    return service.upload(upload)


@router.post("/reviews", max_body_size=MAX_REVIEW_BYTES, dependencies=[LAUNCH])
async def review_arena(request: ArenaReviewRequest, services: ServicesDep) -> ArenaReview:
    """Look an arena over while it is drawn: whether it can be kept, and what a robot would not get to."""
    return await services.lanes.reviews.run(ArenaService.review, request)


@router.delete(
    "/imported/{sha256}", status_code=status.HTTP_204_NO_CONTENT, responses=NOT_FOUND | CONFLICT, dependencies=[ADMINISTRATE]
)
def delete_arena(sha256: str, service: ArenaServiceDep) -> None:
    """Remove an imported arena that no training uses."""
    service.delete(sha256)

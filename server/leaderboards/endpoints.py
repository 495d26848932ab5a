"""Routes of leaderboards."""

from fastapi import APIRouter

from server.leaderboards import service
from server.leaderboards.schemas import Leaderboard, Leaderboards
from server.problems import NOT_FOUND
from server.security.permissions import SIGNED_IN
from server.security.principal import PrincipalDep
from server.services import ServicesDep

router = APIRouter(prefix="/api/leaderboards", tags=["leaderboards"])


@router.get("", dependencies=[SIGNED_IN])
def list_leaderboards(services: ServicesDep, principal: PrincipalDep) -> Leaderboards:
    """Every suite on which something was measured."""
    return service.boards(services, principal.visible)


@router.get("/{suite_hash}", responses=NOT_FOUND, dependencies=[SIGNED_IN])
def get_leaderboard(suite_hash: str, services: ServicesDep, principal: PrincipalDep) -> Leaderboard:
    """Everything that was measured on a suite, the best first, and what can't be told from the best."""
    return service.board(services, suite_hash, principal.visible)

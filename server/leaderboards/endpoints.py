"""Routes of leaderboards."""

from fastapi import APIRouter

from server.http.conditional import NOT_MODIFIED, KeptDep
from server.http.paging import PartDep
from server.http.problems import NOT_FOUND
from server.leaderboards import service
from server.leaderboards.schemas import Leaderboard, Leaderboards
from server.security.permissions import SIGNED_IN
from server.security.principal import PrincipalDep
from server.services import ServicesDep

router = APIRouter(prefix="/api/leaderboards", tags=["leaderboards"])

# Not of runs, though their last figures are read: those move with their evaluations, the rest at every report.
MADE_OF = ("experiments", "checkpoints", "evaluations", "policy_evaluations", "uploaded_policies")


@router.get("", responses=NOT_MODIFIED, dependencies=[SIGNED_IN])
def list_leaderboards(services: ServicesDep, principal: PrincipalDep, kept: KeptDep, part: PartDep) -> Leaderboards:
    """Every suite on which something was measured."""
    kept.unless(services.database.writes.of(*MADE_OF), principal.visible, part.limit, part.offset)
    return Leaderboards(suites=part.of(service.boards(services, principal.visible).suites))


@router.get("/{suite_hash}", responses=NOT_FOUND | NOT_MODIFIED, dependencies=[SIGNED_IN])
def get_leaderboard(
    suite_hash: str, services: ServicesDep, principal: PrincipalDep, kept: KeptDep, part: PartDep
) -> Leaderboard:
    """Everything that was measured on a suite, the best first, and what can't be told from the best."""
    kept.unless(services.database.writes.of(*MADE_OF), suite_hash, principal.visible, part.limit, part.offset)
    board = service.board(services, suite_hash, principal.visible)
    return board.model_copy(update={"entries": part.of(board.entries)})

"""The route of the matrix of families and policies."""

from fastapi import APIRouter

from server.field import service
from server.field.schemas import FieldMatrix
from server.security.permissions import SIGNED_IN
from server.security.principal import PrincipalDep
from server.services import ServicesDep

router = APIRouter(prefix="/api/field", tags=["policies"])


@router.get("", dependencies=[SIGNED_IN])
def get_field(services: ServicesDep, principal: PrincipalDep) -> FieldMatrix:
    """Success in every family at difficulty 1, the hardest first, of shipped policies, baselines and asked evaluations."""
    return service.matrix(services, principal.visible)

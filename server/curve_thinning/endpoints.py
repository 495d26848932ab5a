"""Routes of rules for curves."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query

from server.curve_thinning.rule import CurveRule
from server.curve_thinning.schemas import CurveRuleChange, CurveThinning
from server.curve_thinning.service import CurveThinningService
from server.http.problems import NOT_FOUND
from server.security.permissions import edit, view
from server.services import ServicesDep

router = APIRouter(prefix="/api/experiments/{experiment_id}/curve-thinning", tags=["storage"])


async def _service(services: ServicesDep) -> CurveThinningService:
    return CurveThinningService(services)


CurveThinningServiceDep = Annotated[CurveThinningService, Depends(_service)]


@router.get("", responses=NOT_FOUND, dependencies=[view("experiment_id")])
def preview_curve_thinning(
    experiment_id: str,
    service: CurveThinningServiceDep,
    points: Annotated[
        int | None, Query(ge=100, le=2_000, description="So many of each metric at most; all if not given.")
    ] = None,
    after_days: Annotated[float, Query(ge=0.0, le=3_650.0, description="Days after a run's end from which on.")] = 30.0,
) -> CurveThinning:
    """What a rule would do to the curves of an experiment's runs, and how much that frees; nothing is changed."""
    return service.preview(experiment_id, CurveRule(points=points, after_days=after_days))


@router.put("", responses=NOT_FOUND, dependencies=[edit("experiment_id")])
def change_curve_rule(experiment_id: str, change: CurveRuleChange, service: CurveThinningServiceDep) -> CurveThinning:
    """Give an experiment a rule for curves: it is applied after some days, unless another one comes before."""
    return service.change(experiment_id, change.rule)


@router.post("/now", responses=NOT_FOUND, dependencies=[edit("experiment_id")])
def thin_curves_now(experiment_id: str, service: CurveThinningServiceDep) -> CurveThinning:
    """Thin now what the rule takes, not after its days: it begins at once, and pages hear of it as it goes on."""
    return service.hasten(experiment_id)

"""Routes of evaluations that people ask for."""

from fastapi import APIRouter

from server.evaluations import service
from server.evaluations.schemas import AskedEpisodes, AskedEvaluation, AskedEvaluationPage, EvaluationRequest
from server.paging import WindowDep
from server.problems import BUSY, CONFLICT, NOT_FOUND
from server.security.permissions import ADMINISTRATE
from server.services import ServicesDep

router = APIRouter(prefix="/api/evaluations", tags=["evaluations"])


@router.post("", status_code=202, responses=NOT_FOUND | BUSY, dependencies=[ADMINISTRATE])
def ask_for_evaluation(request: EvaluationRequest, services: ServicesDep) -> AskedEvaluation:
    """Measure a policy on a suite; a worker does it, and the answer says where it stands."""
    return service.ask(services, request)


@router.get("", dependencies=[ADMINISTRATE])
def list_evaluations(window: WindowDep, services: ServicesDep) -> AskedEvaluationPage:
    """Some of the evaluations that were asked for, the newest first."""
    return service.some(services, window)


@router.get("/{evaluation_id}", responses=NOT_FOUND, dependencies=[ADMINISTRATE])
def get_evaluation(evaluation_id: str, services: ServicesDep) -> AskedEvaluation:
    """One of them, with its progress and the time that is left."""
    return service.one(services, evaluation_id)


@router.get("/{evaluation_id}/episodes", responses=NOT_FOUND, dependencies=[ADMINISTRATE])
def list_evaluation_episodes(evaluation_id: str, services: ServicesDep) -> AskedEpisodes:
    """Every episode behind its figures, in the suite's order."""
    return service.episodes(services, evaluation_id)


@router.delete("/{evaluation_id}", status_code=204, responses=NOT_FOUND | CONFLICT, dependencies=[ADMINISTRATE])
def delete_evaluation(evaluation_id: str, services: ServicesDep) -> None:
    """Forget one that has ended."""
    service.delete(services, evaluation_id)

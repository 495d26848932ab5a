"""Routes of evaluations that people ask for."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from server.evaluations import service
from server.evaluations.export import MEDIA, ExportFormat
from server.evaluations.repository import Wanted
from server.evaluations.schemas import (
    AskedEpisodes,
    AskedEvaluation,
    AskedEvaluationPage,
    EvaluationRequest,
    EvaluationWays,
)
from server.http.conditional import NOT_MODIFIED, KeptDep
from server.http.paging import WindowDep
from server.http.problems import CONFLICT, NOT_FOUND, Responses
from server.security.permissions import LAUNCH, SIGNED_IN, edit, view
from server.security.principal import PrincipalDep
from server.services import ServicesDep

router = APIRouter(prefix="/api/evaluations", tags=["evaluations"])

_FILES: Responses = {
    200: {
        "content": {
            media: {"schema": {"type": "object" if media == MEDIA["json"] else "string"}} for media in MEDIA.values()
        }
    }
}


@router.post("", status_code=202, responses=NOT_FOUND, dependencies=[LAUNCH])
def ask_for_evaluations(request: EvaluationRequest, services: ServicesDep, principal: PrincipalDep) -> list[AskedEvaluation]:
    """Measure policies on suites, each on every one; workers do it, and the answers say where they stand."""
    return service.ask(services, request, principal)


@router.get("", dependencies=[SIGNED_IN])
def list_evaluations(
    window: WindowDep,
    services: ServicesDep,
    principal: PrincipalDep,
    suite_hash: Annotated[str | None, Query(max_length=64)] = None,
    run: Annotated[str | None, Query(max_length=64, description="Of that run's policies only.")] = None,
) -> AskedEvaluationPage:
    """Some of the evaluations that were asked for, the newest first."""
    return service.some(services, window, Wanted(principal.visible, suite_hash, run))


@router.get("/{evaluation_id}", responses=NOT_FOUND, dependencies=[view("evaluation_id")])
def get_evaluation(evaluation_id: str, services: ServicesDep) -> AskedEvaluation:
    """One of them, with its progress and the time that is left."""
    return service.one(services, evaluation_id)


@router.get("/{evaluation_id}/episodes", responses=NOT_FOUND | NOT_MODIFIED, dependencies=[view("evaluation_id")])
def list_evaluation_episodes(evaluation_id: str, services: ServicesDep, kept: KeptDep) -> AskedEpisodes:
    """Every episode behind its figures, in the suite's order."""
    kept.unless(evaluation_id, service.measured_on(services, evaluation_id))
    return service.episodes(services, evaluation_id)


@router.get(
    "/{evaluation_id}/export",
    response_class=Response,
    responses=NOT_FOUND | NOT_MODIFIED | _FILES,
    dependencies=[view("evaluation_id")],
)
def export_evaluation(
    evaluation_id: str,
    services: ServicesDep,
    kept: KeptDep,
    wanted: Annotated[
        ExportFormat,
        Query(
            alias="format",
            description="csv: an episode in a row, with its return by the reward's terms where these were kept. "
            "json: the same with the figures. latex (booktabs), markdown: the figures with N and 95 % intervals.",
        ),
    ] = "csv",
) -> Response:
    """An evaluation as a file."""
    headers = kept.unless(evaluation_id, wanted, service.measured_on(services, evaluation_id))
    file = service.export(services, evaluation_id, wanted)
    headers = {**headers, "Content-Disposition": f'attachment; filename="{file.name}"'}
    return Response(file.content, media_type=MEDIA[wanted], headers=headers)


@router.get("/{evaluation_id}/ways", responses=NOT_FOUND, dependencies=[view("evaluation_id")])
def list_evaluation_ways(
    evaluation_id: str,
    services: ServicesDep,
    arena: Annotated[int | None, Query(ge=0, le=100_000, description="Null for that with the lowest success.")] = None,
) -> EvaluationWays:
    """Where its robots drove in one of the suite's arenas."""
    return service.ways(services, evaluation_id, arena)


@router.post("/{evaluation_id}/cancel", responses=NOT_FOUND, dependencies=[edit("evaluation_id")])
def cancel_evaluation(evaluation_id: str, services: ServicesDep) -> AskedEvaluation:
    """Call it off; one that has ended stays as it is."""
    return service.cancel(services, evaluation_id)


@router.delete("/{evaluation_id}", status_code=204, responses=NOT_FOUND | CONFLICT, dependencies=[edit("evaluation_id")])
def delete_evaluation(evaluation_id: str, services: ServicesDep) -> None:
    """Forget one that has ended."""
    service.delete(services, evaluation_id)

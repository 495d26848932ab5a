"""The route of a run's curves."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from server.http.conditional import NOT_MODIFIED, KeptDep
from server.http.problems import NOT_FOUND
from server.metrics.schemas import Metrics
from server.metrics.service import Known, MetricService
from server.security.permissions import view
from server.services import ServicesDep

router = APIRouter(tags=["metrics"])


@router.get(
    "/api/runs/{run_id}/metrics", response_model=Metrics, responses=NOT_FOUND | NOT_MODIFIED, dependencies=[view("run_id")]
)
def get_metrics(
    run_id: str,
    services: ServicesDep,
    kept: KeptDep,
    names: Annotated[str, Query(max_length=4_000, description="Comma-separated; all if empty.")] = "",
    points: Annotated[int, Query(ge=2, le=100_000, description="Points of a series at most.")] = 1_000,
    since: Annotated[
        int | None,
        Query(ge=0, le=2**62, description="The newest step that is known: only the points from there on are wanted."),
    ] = None,
    attempt: Annotated[
        int | None, Query(ge=0, le=2**31, description="Whose points are known; with another one's `since` is of no use.")
    ] = None,
) -> Response:
    """The run's series, by name.

    Who follows a run that goes on asks with the newest step and the attempt of the answer before: what is known from that
    step on gives way to what comes.
    """
    wanted = {name.strip() for name in names.split(",") if name.strip()}
    known = None if since is None or attempt is None else Known(since, attempt)
    metrics = MetricService(services)
    headers = kept.unless(metrics.state(run_id), sorted(wanted), points, known)
    curves = metrics.of_run(run_id, wanted or None, points, known)
    return Response(curves, media_type="application/json", headers=headers)

"""The route of a run's curves."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from server.metrics.schemas import Metrics
from server.metrics.service import MetricService
from server.problems import NOT_FOUND
from server.security.permissions import view
from server.services import ServicesDep

router = APIRouter(tags=["metrics"])


@router.get("/api/runs/{run_id}/metrics", response_model=Metrics, responses=NOT_FOUND, dependencies=[view("run_id")])
def get_metrics(
    run_id: str,
    services: ServicesDep,
    names: Annotated[str, Query(max_length=4_000, description="Comma-separated; all if empty.")] = "",
    points: Annotated[int, Query(ge=2, le=100_000, description="Points of a series at most.")] = 1_000,
) -> Response:
    """The run's series, by name."""
    wanted = {name.strip() for name in names.split(",") if name.strip()}
    curves = MetricService(services).of_run(run_id, wanted or None, points)
    return Response(curves, media_type="application/json")

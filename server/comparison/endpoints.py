"""Routes of the comparison."""

from typing import Annotated

from fastapi import APIRouter, Query, Response

from server.comparison.grid import Across
from server.comparison.schemas import Comparison, Curves, Profiles, ReportedMetrics
from server.comparison.service import ComparisonService
from server.http.conditional import NOT_MODIFIED, KeptDep
from server.http.problems import NOT_FOUND
from server.security.permissions import view
from server.services import ServicesDep

router = APIRouter(prefix="/api/compare", tags=["comparison"])

ExperimentIds = Annotated[
    list[str], Query(alias="experiment", min_length=1, max_length=50, description="Ids of the experiments, in order.")
]

Margin = Annotated[float, Query(gt=0.0, le=0.5, description="Success rates that differ by less are equivalent, 0 to 1.")]
Base = Annotated[
    str | None,
    Query(
        max_length=64,
        description="Id of the one that the others are held against; without it the first with seeds enough for a verdict.",
    ),
]
EveryPair = Annotated[bool, Query(alias="pairs", description="Judge every pair, of 12 experiments at most.")]
Metric = Annotated[str, Query(max_length=64, description="Of the metric.")]
Horizontal = Annotated[
    Across, Query(alias="x", description="What the grid is of: steps, time under way, CPU time, or episodes.")
]
LogarithmicX = Annotated[
    bool,
    Query(alias="log", description="For a logarithmic axis: a grid that is resampled grows by equal factors."),
]
GridSteps = Annotated[int, Query(ge=2, le=10_000, description="Places of the grid at most.")]


@router.get("", responses=NOT_FOUND | NOT_MODIFIED, dependencies=[view("experiment")])
def compare(
    experiment_ids: ExperimentIds,
    services: ServicesDep,
    kept: KeptDep,
    margin: Margin = 0.02,
    base: Base = None,
    every_pair: EveryPair = False,
) -> Comparison:
    """Final figures side by side, with intervals and verdicts, and what differs in the configurations."""
    ids, service = list(dict.fromkeys(experiment_ids)), ComparisonService(services)
    kept.unless(service.state(ids), margin, base, every_pair)
    return service.compare(ids, margin, base, every_pair=every_pair)


@router.get("/profiles", responses=NOT_FOUND | NOT_MODIFIED, dependencies=[view("experiment")])
def compare_profiles(experiment_ids: ExperimentIds, services: ServicesDep, kept: KeptDep) -> Profiles:
    """How many attempts of the final evaluations reach each score."""
    ids, service = list(dict.fromkeys(experiment_ids)), ComparisonService(services)
    kept.unless(service.state(ids))
    return service.profiles(ids)


@router.get("/curves", response_model=Curves, responses=NOT_FOUND | NOT_MODIFIED, dependencies=[view("experiment")])
def compare_curves(
    experiment_ids: ExperimentIds,
    services: ServicesDep,
    kept: KeptDep,
    name: Metric = "eval/success_rate",
    points: GridSteps = 400,
    lines: Annotated[
        int | None,
        Query(
            ge=0, le=2_500, description="Single runs at most, as many of each experiment; all without it. Means are of all."
        ),
    ] = None,
    across: Horizontal = "steps",
    logarithmic: LogarithmicX = False,
    since: Annotated[
        str | None,
        Query(
            max_length=64,
            description="`follow` of the answer that is known, to the same question: only what is beyond is wanted.",
        ),
    ] = None,
) -> Response:
    """One metric of every run on one grid, and each experiment's mean and interval.

    Who follows runs that report asks with `follow` of the answer before: what is known beyond `since` of the next one gives
    way to what comes. Where a run has begun, or was cut back, it is whole.
    """
    ids, service = list(dict.fromkeys(experiment_ids)), ComparisonService(services)
    question = (service.state(ids), name, points, lines, across, logarithmic, since)
    headers = kept.unless(*question)

    def read() -> bytes:
        curves = service.curves(ids, name, points, lines, across, logarithmic=logarithmic, since=since)
        return curves.model_dump_json().encode()

    return Response(services.curves.get(question, read), media_type="application/json", headers=headers)


@router.get("/metrics", responses=NOT_FOUND | NOT_MODIFIED, dependencies=[view("experiment")])
def compare_metrics(experiment_ids: ExperimentIds, services: ServicesDep, kept: KeptDep) -> ReportedMetrics:
    """Which metrics the runs of the experiments have reported: what there are curves of."""
    ids, service = list(dict.fromkeys(experiment_ids)), ComparisonService(services)
    kept.unless(service.state(ids))
    return service.metrics(ids)

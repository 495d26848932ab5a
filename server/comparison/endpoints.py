"""Routes of the comparison."""

from typing import Annotated

from fastapi import APIRouter, Query

from server.comparison.grid import Across
from server.comparison.schemas import Comparison, Curves, Profiles, ReportedMetrics
from server.comparison.service import ComparisonService
from server.http.problems import INVALID, NOT_FOUND
from server.security.permissions import view
from server.services import ServicesDep

router = APIRouter(prefix="/api/compare", tags=["comparison"])

ExperimentIds = Annotated[
    list[str], Query(alias="experiment", min_length=1, max_length=50, description="Ids of the experiments, in order.")
]

Margin = Annotated[float, Query(gt=0.0, le=0.5, description="Success rates that differ by less are equivalent, 0 to 1.")]
Base = Annotated[
    str | None, Query(max_length=64, description="Id of the one that the others are held against; the first without it.")
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


@router.get("", responses=INVALID | NOT_FOUND, dependencies=[view("experiment")])
def compare(
    experiment_ids: ExperimentIds,
    services: ServicesDep,
    margin: Margin = 0.02,
    base: Base = None,
    every_pair: EveryPair = False,
) -> Comparison:
    """Final figures side by side, with intervals and verdicts, and what differs in the configurations."""
    return ComparisonService(services).compare(list(dict.fromkeys(experiment_ids)), margin, base, every_pair=every_pair)


@router.get("/profiles", responses=NOT_FOUND, dependencies=[view("experiment")])
def compare_profiles(experiment_ids: ExperimentIds, services: ServicesDep) -> Profiles:
    """How many attempts of the final evaluations reach each score."""
    return ComparisonService(services).profiles(list(dict.fromkeys(experiment_ids)))


@router.get("/curves", responses=NOT_FOUND, dependencies=[view("experiment")])
def compare_curves(
    experiment_ids: ExperimentIds,
    services: ServicesDep,
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
) -> Curves:
    """One metric of every run on one grid, and each experiment's mean and interval."""
    ids = list(dict.fromkeys(experiment_ids))
    return ComparisonService(services).curves(ids, name, points, lines, across, logarithmic=logarithmic)


@router.get("/metrics", responses=NOT_FOUND, dependencies=[view("experiment")])
def compare_metrics(experiment_ids: ExperimentIds, services: ServicesDep) -> ReportedMetrics:
    """Which metrics the runs of the experiments have reported: what there are curves of."""
    return ComparisonService(services).metrics(list(dict.fromkeys(experiment_ids)))

"""Routes of data that leave."""

from collections.abc import Callable
from typing import Annotated

from fastapi import APIRouter, Query
from fastapi.responses import StreamingResponse

from server.comparison.endpoints import ExperimentIds, GridSteps, Margin, Metric
from server.data_export.files import OutgoingFile
from server.data_export.parquet import MEDIA_TYPE
from server.data_export.service import DataExportService, DataFormat, TableFormat
from server.http.conditional import NOT_MODIFIED, KeptDep
from server.http.problems import NOT_FOUND, NOT_INSTALLED, Responses
from server.security.permissions import view
from server.services import Services, ServicesDep

router = APIRouter(tags=["data export"])

_FILES: Responses = {
    200: {
        "content": {
            "text/csv": {"schema": {"type": "string"}},
            "application/json": {"schema": {"type": "object"}},
            MEDIA_TYPE: {"schema": {"type": "string", "format": "binary"}},
            "application/octet-stream": {"schema": {"type": "string", "format": "binary"}},
            "application/zip": {"schema": {"type": "string", "format": "binary"}},
        }
    }
}

WantedFormat = Annotated[
    DataFormat,
    Query(
        alias="format",
        description="csv: every point in a row, run, seed, metric, step, wall_time (seconds since the epoch) and value, "
        "which is empty where it was not finite. parquet: the same rows, with types and units in "
        "the schema. json: configuration, seeds, final evaluations with their episodes. "
        "tensorboard: an event file, or a zip of one for each run.",
    ),
]


@router.get(
    "/api/runs/{run_id}/export",
    response_class=StreamingResponse,
    responses=NOT_FOUND | NOT_MODIFIED | NOT_INSTALLED | _FILES,
    dependencies=[view("run_id")],
)
async def export_run(run_id: str, services: ServicesDep, kept: KeptDep, wanted: WantedFormat = "csv") -> StreamingResponse:
    """The run's data as a file."""
    service = DataExportService(services)
    state = service.state_of_run if wanted == "json" else service.points_of_run
    headers = kept.unless(wanted, await services.lanes.downloads.run(state, run_id))
    return await _send(services, lambda: service.run(run_id, wanted), headers)


@router.get(
    "/api/experiments/{experiment_id}/export",
    response_class=StreamingResponse,
    responses=NOT_FOUND | NOT_MODIFIED | NOT_INSTALLED | _FILES,
    dependencies=[view("experiment_id")],
)
async def export_experiment(
    experiment_id: str, services: ServicesDep, kept: KeptDep, wanted: WantedFormat = "csv"
) -> StreamingResponse:
    """The data of all runs of the experiment as a file."""
    service = DataExportService(services)
    state = service.state_of_experiment if wanted == "json" else service.points_of_experiment
    headers = kept.unless(wanted, await services.lanes.downloads.run(state, experiment_id))
    return await _send(services, lambda: service.experiment(experiment_id, wanted), headers)


@router.get(
    "/api/compare/export",
    response_class=StreamingResponse,
    responses=NOT_FOUND | NOT_MODIFIED | NOT_INSTALLED | _FILES,
    dependencies=[view("experiment")],
)
async def export_comparison(
    experiment_ids: ExperimentIds,
    services: ServicesDep,
    kept: KeptDep,
    wanted: Annotated[
        TableFormat,
        Query(
            alias="format",
            description="csv, parquet: a zip of the tables figures, curves and seeds. json: all of it in one.",
        ),
    ] = "csv",
    margin: Margin = 0.02,
    name: Metric = "eval/success_rate",
    points: GridSteps = 400,
) -> StreamingResponse:
    """The figures of a comparison and the curves of one metric as a file."""
    ids, service = list(dict.fromkeys(experiment_ids)), DataExportService(services)
    state = await services.lanes.downloads.run(service.state_of_comparison, ids)
    headers = kept.unless(wanted, state, margin, name, points)
    return await _send(services, lambda: service.comparison(ids, margin, name, points, wanted), headers)


async def _send(services: Services, find: Callable[[], OutgoingFile], headers: dict[str, str]) -> StreamingResponse:
    lane = services.lanes.downloads
    file = await lane.run(find)
    headers = {**headers, "Content-Disposition": f'attachment; filename="{file.name}"'}
    return StreamingResponse(lane.each(file.blocks), media_type=file.media_type, headers=headers)

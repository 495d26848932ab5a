"""Routes of what is printed of a comparison."""

from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.responses import HTMLResponse, PlainTextResponse

from server.comparison.endpoints import Base, EveryPair, ExperimentIds, Horizontal, LogarithmicX, Margin
from server.http.problems import NOT_FOUND
from server.printing.look import Look, smoothing_of, zoom_of
from server.printing.service import SUFFIXES, PrintingService, TextFormat, Wanted
from server.printing.tables import TableName
from server.security.permissions import view
from server.services import ServicesDep

router = APIRouter(prefix="/api/compare", tags=["comparison"])

_MEDIA = {"latex": "application/x-tex", "markdown": "text/markdown", "csv": "text/csv"}
# Curves of a report.
_MOST_CURVES = 24

Metrics = Annotated[
    list[str],
    Query(
        alias="name",
        max_length=_MOST_CURVES,
        description="Metrics whose curves are drawn; those that the page shows at first without.",
    ),
]
LogarithmicY = Annotated[
    list[str],
    Query(alias="ylog", max_length=_MOST_CURVES, description="Metrics whose values are drawn on a logarithmic axis."),
]
_NUMBER = r"-?\d{1,18}(\.\d{1,18})?(e[+-]?\d{1,3})?"
Smoothing = Annotated[
    list[Annotated[str, Query(pattern=f"^{_NUMBER}~.{{1,64}}$")]],
    Query(
        alias="smooth",
        max_length=_MOST_CURVES,
        description='How much of the past is in a metric\'s curves, up to 0.99, as "0.8~train/return".',
    ),
]
Hidden = Annotated[
    list[str], Query(alias="hide", max_length=60, description="Ids of the experiments whose curves are not drawn.")
]
Zoom = Annotated[
    str | None,
    Query(pattern=f"^{_NUMBER}~{_NUMBER}$", description='What is drawn of x, as "19000~36000"; all of it without.'),
]


@router.get(
    "/table",
    response_class=PlainTextResponse,
    responses=NOT_FOUND,
    dependencies=[view("experiment")],
)
def compare_table(
    experiment_ids: ExperimentIds,
    services: ServicesDep,
    table: Annotated[TableName, Query(description="Which of the tables.")] = "verdicts",
    text_format: Annotated[
        TextFormat, Query(alias="format", description="LaTeX with booktabs, Markdown, or CSV.")
    ] = "latex",
    margin: Margin = 0.02,
    base: Base = None,
    every_pair: EveryPair = False,
) -> PlainTextResponse:
    """A table of the comparison as one would print it: N, seeds, intervals."""
    wanted = Wanted(list(dict.fromkeys(experiment_ids)), margin, base, every_pair)
    text = PrintingService(services).table(wanted, table, text_format)
    name = f"mapless-{table}.{SUFFIXES[text_format]}"
    headers = {"Content-Disposition": f'attachment; filename="{name}"'}
    return PlainTextResponse(text, media_type=f"{_MEDIA[text_format]}; charset=utf-8", headers=headers)


@router.get("/report", response_class=HTMLResponse, responses=NOT_FOUND, dependencies=[view("experiment")])
def compare_report(
    request: Request,
    experiment_ids: ExperimentIds,
    services: ServicesDep,
    names: Metrics = [],  # noqa: B006 (FastAPI copies it)
    margin: Margin = 0.02,
    base: Base = None,
    every_pair: EveryPair = False,
    across: Horizontal = "steps",
    logarithmic: LogarithmicX = False,
    log_names: LogarithmicY = [],  # noqa: B006
    smoothing: Smoothing = [],  # noqa: B006
    hidden: Hidden = [],  # noqa: B006
    zoom: Zoom = None,
) -> HTMLResponse:
    """The whole comparison as one HTML file that needs no script and opens offline."""
    wanted = Wanted(list(dict.fromkeys(experiment_ids)), margin, base, every_pair)
    look = Look(
        list(dict.fromkeys(names)),
        across,
        logarithmic,
        list(dict.fromkeys(log_names)),
        smoothing_of(smoothing),
        list(dict.fromkeys(hidden)),
        zoom_of(zoom),
    )
    text = PrintingService(services).report(wanted, look, str(request.base_url).rstrip("/"))
    headers = {"Content-Disposition": 'attachment; filename="mapless-comparison.html"'}
    return HTMLResponse(text, headers=headers)

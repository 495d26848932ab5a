"""Routes of the list of experiments."""

from typing import Annotated

from fastapi import APIRouter, Depends, Query

from server.experiments.schemas import ExperimentState
from server.http.conditional import NOT_MODIFIED, KeptDep
from server.http.paging import MAX_PAGE, Offset, PartDep, Window, WindowDep
from server.http.problems import CONFLICT, NOT_FOUND
from server.security.permissions import LAUNCH, SIGNED_IN, edit, view
from server.security.principal import PrincipalDep
from server.services import ServicesDep
from server.workbench.actions import ActionService
from server.workbench.language import MAX_LENGTH
from server.workbench.repository import Wanted
from server.workbench.schemas import (
    Action,
    ActionDone,
    ExperimentMarks,
    Groups,
    KnownKeys,
    ListedPage,
    MatchingIds,
    MoreSeeds,
    Notes,
    Place,
    SavedViewEdit,
    SavedViews,
)
from server.workbench.service import WorkbenchService
from server.workbench.views import ViewService

router = APIRouter(tags=["workbench"])

_MAX_COLUMNS = 40


async def _service(services: ServicesDep) -> WorkbenchService:
    return WorkbenchService(services)


WorkbenchServiceDep = Annotated[WorkbenchService, Depends(_service)]


async def _actions(services: ServicesDep) -> ActionService:
    return ActionService(services)


async def _views(services: ServicesDep) -> ViewService:
    return ViewService(services)


ActionServiceDep = Annotated[ActionService, Depends(_actions)]
ViewServiceDep = Annotated[ViewService, Depends(_views)]
QueryText = Annotated[
    str,
    Query(
        max_length=MAX_LENGTH,
        description="Part of the name, or what is asked of settings and metrics: `algorithm = ppo train/return > 50`.",
        examples=["corridor", "algorithm = ppo, sac gamma >= 0.99 -tag = old"],
    ),
]
Columns = Annotated[
    list[str], Query(max_length=_MAX_COLUMNS, description="Keys of settings and metrics that the rows should have.")
]
OfProject = Annotated[str | None, Query(max_length=16, description="Id of the project; all without it.")]
KeyName = Annotated[str, Query(min_length=1, max_length=160)]


@router.get("/api/experiments", responses=NOT_MODIFIED, dependencies=[SIGNED_IN])
def list_experiments(
    service: WorkbenchServiceDep,
    principal: PrincipalDep,
    kept: KeptDep,
    window: WindowDep,
    query: QueryText = "",
    state: ExperimentState | None = None,
    project: OfProject = None,
    place: Place = "live",
    sort: Annotated[
        str, Query(min_length=1, max_length=161, description="A key; with a minus before it the largest first.")
    ] = "-created",
    column: Columns = [],  # noqa: B006 (FastAPI copies it)
    after: Annotated[
        str | None, Query(max_length=2_000, description="`next` of the part before; with the same query and order.")
    ] = None,
) -> ListedPage:
    """Experiments in short, the newest first where nothing else is asked for."""
    wanted = Wanted(query=query, state=state, project_id=project, place=place, visible=principal.visible)
    kept.unless(service.state(), wanted, sort, column, window, after)
    return service.page(wanted, sort=sort, columns=column, window=window, after=after)


@router.get("/api/workbench/groups", responses=NOT_MODIFIED, dependencies=[SIGNED_IN])
def list_groups(
    service: WorkbenchServiceDep,
    principal: PrincipalDep,
    kept: KeptDep,
    by: KeyName,
    query: QueryText = "",
    project: OfProject = None,
    place: Place = "live",
    column: Columns = [],  # noqa: B006
    limit: Annotated[int, Query(ge=1, le=MAX_PAGE, description="Groups at most.")] = MAX_PAGE,
    offset: Offset = 0,
) -> Groups:
    """The experiments that a query finds by the values of one key, with intervals over all runs of each group."""
    wanted = Wanted(query=query, project_id=project, place=place, visible=principal.visible)
    kept.unless(service.state(), wanted, by, column, limit, offset)
    return service.groups(wanted, by=by, columns=column, window=Window(limit, offset))


@router.get("/api/workbench/ids", dependencies=[SIGNED_IN])
def list_ids(
    service: WorkbenchServiceDep,
    principal: PrincipalDep,
    query: QueryText = "",
    project: OfProject = None,
    place: Place = "live",
) -> MatchingIds:
    """The ids of what a query finds, as many as one action may be about."""
    return service.ids(Wanted(query=query, project_id=project, place=place, visible=principal.visible))


@router.get("/api/workbench/keys", responses=NOT_MODIFIED, dependencies=[SIGNED_IN])
def list_keys(service: WorkbenchServiceDep, principal: PrincipalDep, kept: KeptDep) -> KnownKeys:
    """Everything that experiments can be filtered, sorted and grouped by."""
    kept.unless(service.state(), principal.visible)
    return service.keys(principal.visible)


@router.get("/api/workbench/values", dependencies=[SIGNED_IN])
def list_values(
    service: WorkbenchServiceDep,
    principal: PrincipalDep,
    key: KeyName,
    part: Annotated[str, Query(max_length=200)] = "",
) -> list[str]:
    """Some values that a key has, the most frequent first."""
    return service.values(key, part, principal.visible)


@router.post("/api/workbench/actions", responses=CONFLICT, dependencies=[LAUNCH])
def act(action: Action, service: ActionServiceDep, principal: PrincipalDep) -> ActionDone:
    """Do one thing to several experiments, and say which were left out, and why."""
    return service.act(action, principal)


@router.get("/api/experiments/{experiment_id}/marks", responses=NOT_FOUND, dependencies=[view("experiment_id")])
def get_marks(experiment_id: str, service: ActionServiceDep) -> ExperimentMarks:
    """Tags, star and notes of an experiment."""
    return service.marks(experiment_id)


@router.put("/api/experiments/{experiment_id}/notes", responses=NOT_FOUND, dependencies=[edit("experiment_id")])
def put_notes(experiment_id: str, notes: Notes, service: ActionServiceDep) -> ExperimentMarks:
    """Replace an experiment's notes."""
    return service.write_notes(experiment_id, notes.notes)


@router.post(
    "/api/experiments/{experiment_id}/seeds",
    status_code=204,
    responses=NOT_FOUND | CONFLICT,
    dependencies=[edit("experiment_id")],
)
def add_seeds(experiment_id: str, more: MoreSeeds, service: ActionServiceDep) -> None:
    """Train an experiment with more seeds."""
    service.add_seeds(experiment_id, more.seeds)


@router.get("/api/workbench/views", dependencies=[SIGNED_IN])
def list_views(service: ViewServiceDep, part: PartDep) -> SavedViews:
    """The named views of the table, by name."""
    return SavedViews(items=part.of(service.all().items))


@router.put("/api/workbench/views", responses=CONFLICT, dependencies=[LAUNCH])
def save_view(edit: SavedViewEdit, service: ViewServiceDep) -> SavedViews:
    """Keep a view under a name; one of that name is replaced."""
    return service.save(edit)


@router.delete("/api/workbench/views/{view_id}", status_code=204, responses=NOT_FOUND, dependencies=[LAUNCH])
def remove_view(view_id: str, service: ViewServiceDep) -> None:
    """Forget a view."""
    service.remove(view_id)

"""Routes of the live view: its settings, the page inside its frame, and the two sockets of that page."""

import asyncio
from functools import partial
from typing import Annotated

from fastapi import APIRouter, Depends, Request, WebSocket
from fastapi.responses import HTMLResponse, RedirectResponse, Response
from starlette.concurrency import run_in_threadpool

from server.arenas.references import with_geometry
from server.errors import NotFoundError
from server.live.bridge import bridge, until_one_ends
from server.live.hub import TooManyViewsError
from server.live.page import HEADERS, VISER_PROTOCOL, live_page, own_websocket
from server.live.settings import LiveSettings, LiveState
from server.live.themes import Theme
from server.problems import NOT_FOUND
from server.runs.repository import RunRepository
from server.runs.schemas import RunDetail
from server.runs.service import RunService
from server.services import Services, ServicesDep
from sim.errors import ArenaError
from workers.config import TrainingConfig

router = APIRouter(tags=["live"])

# RFC 6455 and its registry: what a socket is closed with.
_POLICY_VIOLATION = 1008
_TRY_AGAIN_LATER = 1013
# Bytes; ours are of one byte a character.
_MAX_REASON = 120

_DISPLAY_SECONDS = 0.25


async def _run(run_id: str, services: ServicesDep) -> RunDetail:
    return await run_in_threadpool(RunService(services).get, run_id)


RunDep = Annotated[RunDetail, Depends(_run)]


@router.get("/api/runs/{run_id}/live", responses=NOT_FOUND)
async def get_live(run: RunDep, services: ServicesDep) -> LiveState:
    """What the live view of a run shows, and whether it has anything to show."""
    return _state(run, services)


@router.put("/api/runs/{run_id}/live", responses=NOT_FOUND)
async def change_live(run: RunDep, settings: LiveSettings, services: ServicesDep) -> LiveState:
    """Change what the live view of a run shows, for everyone who watches it."""
    services.live.configure(run.id, settings)
    return _state(run, services)


@router.get("/live/{run_id}/", include_in_schema=False)
async def choose_theme(run: RunDep, request: Request) -> Response:
    """On to the page in the look that the query asks for."""
    dark = "darkMode" in request.query_params
    return RedirectResponse(f"/live/{run.id}/dark/?darkMode" if dark else f"/live/{run.id}/light/")


@router.get("/live/{run_id}/{theme}/", include_in_schema=False)
async def show_page(run: RunDep, theme: Theme, request: Request) -> Response:
    """The page inside the live view's frame.

    viser's client would connect to any server that `websocket` names, and play any file of `playbackPath`: both can bring
    scripts along, so values that are not the page's own are taken out of the address.
    """
    path = f"/live/{run.id}/{theme}"
    query = request.query_params
    servers = query.getlist("websocket")
    foreign = any(not own_websocket(server, request.headers.get("host", ""), path) for server in servers)
    if foreign or "playbackPath" in query:
        return RedirectResponse(f"{path}/?darkMode" if theme == "dark" else f"{path}/")
    return HTMLResponse(live_page(theme), headers=HEADERS)


@router.websocket("/live/{run_id}")
@router.websocket("/live/{run_id}/{theme}")
async def stream_scene(websocket: WebSocket, run_id: str, services: ServicesDep, theme: Theme = "light") -> None:
    """The socket of viser itself, bridged to the scene of the run; whoever holds it counts as a watcher."""
    training = await _training(run_id, services)
    if training is None or VISER_PROTOCOL not in websocket.scope.get("subprotocols", []):
        await websocket.close(_POLICY_VIOLATION)
        return
    try:
        async with services.live.watch(run_id, training.task, theme) as view:
            await bridge(websocket, view.port)
    except (TooManyViewsError, ArenaError) as error:
        await websocket.close(_TRY_AGAIN_LATER, str(error)[:_MAX_REASON])


@router.websocket("/live/{run_id}/{theme}/display")
async def stream_display(websocket: WebSocket, run_id: str, theme: Theme, services: ServicesDep) -> None:
    """The numbers of the head-up display, a few times a second where they change."""
    if await _training(run_id, services) is None:
        await websocket.close(_POLICY_VIOLATION)
        return
    await websocket.accept()
    await until_one_ends(partial(_send_scores, websocket, run_id, theme, services), partial(_wait_for_the_end, websocket))


async def _send_scores(websocket: WebSocket, run_id: str, theme: Theme, services: Services) -> None:
    told = ""
    while True:
        score = services.live.score(run_id, theme).model_dump_json()
        if score != told:
            await websocket.send_text(score)
            told = score
        await asyncio.sleep(_DISPLAY_SECONDS)


async def _wait_for_the_end(websocket: WebSocket) -> None:
    while (await websocket.receive())["type"] != "websocket.disconnect":
        pass


async def _training(run_id: str, services: Services) -> TrainingConfig | None:
    """What the run trains; None if there is no such run."""

    def read() -> TrainingConfig:
        with services.database.read() as session:
            training = TrainingConfig.model_validate(RunRepository(session).get(run_id).experiment.training)
        return with_geometry(training, services.arenas)

    try:
        return await run_in_threadpool(read)
    except NotFoundError:
        return None


def _state(run: RunDetail, services: Services) -> LiveState:
    return LiveState(**services.live.settings(run.id).model_dump(), status=services.live.status(run.id))

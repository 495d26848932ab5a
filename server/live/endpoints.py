"""Routes of the live view: its settings, the page inside its frame, and the two sockets of that page."""

import asyncio
from contextlib import AsyncExitStack
from functools import partial
from typing import Annotated

from fastapi import APIRouter, Depends, Request, WebSocket
from fastapi.responses import HTMLResponse, RedirectResponse, Response
from starlette.concurrency import run_in_threadpool

from server.errors import NotFoundError
from server.http.problems import MAX_REASON, NOT_FOUND, TRY_AGAIN_LATER
from server.jobs.service import JobService
from server.live.bridge import PLAY, WATCH, bridge, until_one_ends
from server.live.hub import TooManyViewsError
from server.live.page import HEADERS, VISER_PROTOCOL, live_page, own_websocket
from server.live.settings import LiveSettings, LiveState
from server.live.watched import CHECKPOINT_PREFIX, Watched, checkpoint_view, policy_view, watched
from server.security.permissions import SIGNED_IN, view
from server.security.principal import Principal, PrincipalDep, principal_of
from server.services import Services, ServicesDep
from sim.errors import ArenaError
from workers.scene.themes import Theme

router = APIRouter(tags=["live"])

# RFC 6455: what a socket is closed with that nobody may open.
_POLICY_VIOLATION = 1008

_DISPLAY_SECONDS = 0.25
# What a playground's page says beside the picture must not be seen to be behind it.
_MOMENT_SECONDS = 0.1


async def _watched(run_id: str, services: ServicesDep) -> Watched:
    return await run_in_threadpool(watched, services, run_id)


async def _watched_policy(name: str, services: ServicesDep) -> Watched:
    return await run_in_threadpool(watched, services, policy_view(name))


async def _watched_checkpoint(checkpoint_id: str, services: ServicesDep) -> Watched:
    return await run_in_threadpool(watched, services, checkpoint_view(checkpoint_id))


WatchedDep = Annotated[Watched, Depends(_watched)]
WatchedPolicyDep = Annotated[Watched, Depends(_watched_policy)]
WatchedCheckpointDep = Annotated[Watched, Depends(_watched_checkpoint)]


@router.get("/api/runs/{run_id}/live", responses=NOT_FOUND, dependencies=[view("run_id")])
async def get_live(subject: WatchedDep, services: ServicesDep, principal: PrincipalDep) -> LiveState:
    """What the live view of a run shows, and whether it has anything to show."""
    return _state(subject, services, principal)


@router.put("/api/runs/{run_id}/live", responses=NOT_FOUND, dependencies=[view("run_id")])
async def change_live(
    subject: WatchedDep, settings: LiveSettings, services: ServicesDep, principal: PrincipalDep
) -> LiveState:
    """Change what the live view of a run shows: mode and speed for everyone who watches it, the rest for oneself."""
    services.live.configure(subject.id, settings, principal.person)
    return _state(subject, services, principal)


@router.get("/api/policies/{name}/live", responses=NOT_FOUND, dependencies=[SIGNED_IN])
async def get_policy_live(subject: WatchedPolicyDep, services: ServicesDep, principal: PrincipalDep) -> LiveState:
    """What the live view of a shipped policy shows."""
    return _state(subject, services, principal)


@router.put("/api/policies/{name}/live", responses=NOT_FOUND, dependencies=[SIGNED_IN])
async def change_policy_live(
    subject: WatchedPolicyDep, settings: LiveSettings, services: ServicesDep, principal: PrincipalDep
) -> LiveState:
    """Change what the live view of a shipped policy shows: speed for everyone who watches it, the rest for oneself."""
    services.live.configure(subject.id, settings, principal.person)
    return _state(subject, services, principal)


@router.get("/api/checkpoints/{checkpoint_id}/live", responses=NOT_FOUND, dependencies=[view("checkpoint_id")])
async def get_checkpoint_live(subject: WatchedCheckpointDep, services: ServicesDep, principal: PrincipalDep) -> LiveState:
    """What the live view of a checkpoint shows."""
    return _state(subject, services, principal)


@router.put("/api/checkpoints/{checkpoint_id}/live", responses=NOT_FOUND, dependencies=[view("checkpoint_id")])
async def change_checkpoint_live(
    subject: WatchedCheckpointDep, settings: LiveSettings, services: ServicesDep, principal: PrincipalDep
) -> LiveState:
    """Change what the live view of a checkpoint shows: speed for everyone who watches it, the rest for oneself."""
    services.live.configure(subject.id, settings, principal.person)
    return _state(subject, services, principal)


@router.get("/live/{run_id}/", include_in_schema=False, dependencies=[view("run_id")])
async def choose_theme(subject: WatchedDep, request: Request) -> Response:
    """On to the page in the look that the query asks for."""
    dark = "darkMode" in request.query_params
    return RedirectResponse(f"/live/{subject.id}/dark/?darkMode" if dark else f"/live/{subject.id}/light/")


@router.get("/live/{run_id}/{theme}/", include_in_schema=False, dependencies=[view("run_id")])
async def show_page(subject: WatchedDep, theme: Theme, request: Request, services: ServicesDep) -> Response:
    """The page inside the live view's frame.

    viser's client would connect to any server that `websocket` names, and play any file of `playbackPath`: both can bring
    scripts along, so values that are not the page's own are taken out of the address.
    """
    path = f"/live/{subject.id}/{theme}"
    query = request.query_params
    servers = query.getlist("websocket")
    ours = services.settings.path_prefix + path
    foreign = any(not own_websocket(server, request.headers.get("host", ""), ours) for server in servers)
    if foreign or "playbackPath" in query:
        return RedirectResponse(f"{path}/?darkMode" if theme == "dark" else f"{path}/")
    return HTMLResponse(live_page(theme), headers=HEADERS)


@router.websocket("/live/{run_id}", dependencies=[view("run_id")])
@router.websocket("/live/{run_id}/{theme}", dependencies=[view("run_id")])
async def stream_scene(websocket: WebSocket, run_id: str, services: ServicesDep, theme: Theme = "light") -> None:
    """The socket of viser itself, bridged to the scene of the run; whoever holds it counts as a watcher."""
    subject = await _found(run_id, services)
    if subject is None or VISER_PROTOCOL not in websocket.scope.get("subprotocols", []):
        await websocket.close(_POLICY_VIOLATION)
        return
    try:
        async with AsyncExitStack() as stack:
            if subject.driven is not None:
                await stack.enter_async_context(services.drivers.driving(JobService(services), run_id, subject.driven))
            view = await stack.enter_async_context(
                services.live.watch(run_id, subject.task, theme, subject.stage, _person(subject, websocket))
            )
            await until_one_ends(
                partial(bridge, websocket, view, PLAY if subject.stage is not None else WATCH),
                partial(services.gate.until_changed, principal_of(websocket)),
            )
    except (TooManyViewsError, ArenaError) as error:
        await websocket.close(TRY_AGAIN_LATER, str(error)[:MAX_REASON])


@router.websocket("/live/{run_id}/{theme}/display", dependencies=[view("run_id")])
async def stream_display(websocket: WebSocket, run_id: str, theme: Theme, services: ServicesDep) -> None:
    """The numbers of the head-up display, a few times a second where they change."""
    subject = await _found(run_id, services)
    if subject is None:
        await websocket.close(_POLICY_VIOLATION)
        return
    await websocket.accept()
    await until_one_ends(
        partial(_send_scores, websocket, subject, theme, services),
        partial(_wait_for_the_end, websocket),
        partial(services.gate.until_changed, principal_of(websocket)),
    )


async def _send_scores(websocket: WebSocket, subject: Watched, theme: Theme, services: Services) -> None:
    told = ""
    pause = _DISPLAY_SECONDS if subject.moment is None else _MOMENT_SECONDS
    while True:
        score = services.live.score(subject.id, theme, _person(subject, websocket))
        if subject.driven is not None and (refusal := services.drivers.refusal(subject.id)) is not None:
            score = score.model_copy(update={"refusal": refusal})
        if subject.id.startswith(CHECKPOINT_PREFIX):
            score = score.model_copy(update={"checkpoint": True})
        if subject.moment is not None:
            score = score.model_copy(update={"moment": subject.moment().model_dump(mode="json")})
        text = score.model_dump_json()
        if text != told:
            await websocket.send_text(text)
            told = text
        await asyncio.sleep(pause)


async def _wait_for_the_end(websocket: WebSocket) -> None:
    while (await websocket.receive())["type"] != "websocket.disconnect":
        pass


async def _found(identifier: str, services: Services) -> Watched | None:
    try:
        return await run_in_threadpool(watched, services, identifier)
    except NotFoundError:
        return None


def _state(subject: Watched, services: Services, principal: Principal) -> LiveState:
    settings = services.live.settings(subject.id, principal.person)
    return LiveState(**settings.model_dump(), status=services.live.status(subject.id))


def _person(subject: Watched, websocket: WebSocket) -> str:
    """Whose scene it is: what is in a playground is everybody's."""
    return "" if subject.stage is not None else principal_of(websocket).person

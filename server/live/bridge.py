"""Carries viser's WebSocket between a browser and the scene's own port: everything down, little up.

What moves does not come through that port, but from the view itself, in viser's words.

Up goes the camera, and of a playground what its owner clicks and drags.

viser believes every message of a client: some write attributes of its controls unchecked, one opens a public tunnel. So
what comes from browsers is let through by name.
"""

import contextlib
from collections.abc import Awaitable, Callable
from functools import partial
from typing import TYPE_CHECKING, Annotated, Any, Literal, TypeAlias

import anyio
import msgspec
from fastapi import WebSocket
from starlette.websockets import WebSocketDisconnect
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from server.live.page import VISER_PROTOCOL
from workers.scene.gate import KEY

if TYPE_CHECKING:
    from server.live.hub import View
    from server.live.picture import Sight

# A camera's pose takes about 300 bytes.
_MAX_MESSAGE = 4096
_Number = Annotated[float, msgspec.Meta(ge=-1e6, le=1e6)]
_Point = tuple[_Number, _Number, _Number]


# RuntimeError: Starlette's word for sending to a browser that has left.
_GONE = (ConnectionClosed, WebSocketDisconnect, RuntimeError)


class _Camera(msgspec.Struct, tag="ViewerCameraMessage"):
    """Where somebody looks from."""


class _Watched(msgspec.Struct):
    """All that somebody who only watches may send: the same, whose tag could be left out where there is no other."""

    type: Literal["ViewerCameraMessage"]


class _Click(msgspec.Struct, tag="ScenePointerMessage", forbid_unknown_fields=True):
    """Somebody clicked into the scene."""

    event_type: Literal["click"]
    ray_origin: _Point
    ray_direction: _Point
    screen_pos: Annotated[tuple[tuple[_Number, _Number], ...], msgspec.Meta(min_length=1, max_length=2)]
    modifier: None = None


class _Drag(msgspec.Struct, tag="TransformControlsUpdateMessage", forbid_unknown_fields=True):
    """Somebody drags what has handles."""

    name: Literal["/world/handle"]
    wxyz: tuple[_Number, _Number, _Number, _Number]
    position: _Point
    owner: Literal[""] = ""


class _DragStart(msgspec.Struct, tag="TransformControlsDragStartMessage", forbid_unknown_fields=True):
    """Somebody takes hold of them."""

    name: Literal["/world/handle"]
    owner: Literal[""] = ""


class _DragEnd(msgspec.Struct, tag="TransformControlsDragEndMessage", forbid_unknown_fields=True):
    """Somebody lets go of them."""

    name: Literal["/world/handle"]
    owner: Literal[""] = ""


class _Grab(msgspec.Struct, tag="SceneNodeDragMessage", forbid_unknown_fields=True):
    """Somebody drags the thing itself, or the disc below it."""

    name: Literal["/world/grab", "/world/hold"]
    phase: Literal["start", "update", "end"]
    start_position: _Point
    end_position: _Point
    start_screen_pos: tuple[_Number, _Number]
    end_screen_pos: tuple[_Number, _Number]
    button: Literal["left"]
    instance_index: None = None
    modifier: None = None
    owner: Literal[""] = ""


Allowed: TypeAlias = "msgspec.msgpack.Decoder[Any]"
"""What a browser may send."""

WATCH: Allowed = msgspec.msgpack.Decoder(_Watched)
PLAY: Allowed = msgspec.msgpack.Decoder(_Camera | _Click | _Drag | _DragStart | _DragEnd | _Grab)


async def bridge(browser: WebSocket, view: "View", allowed: Allowed = WATCH) -> None:
    """Connects an unaccepted WebSocket of a browser with a scene, until one of them leaves."""
    async with connect(
        f"ws://127.0.0.1:{view.port}",
        subprotocols=[VISER_PROTOCOL],  # type: ignore[list-item]
        additional_headers=KEY,
        compression=None,
        max_size=None,
        # What changes piles up in the scene, which merges it, and not here.
        max_queue=4,
        proxy=None,
        ping_interval=None,
    ) as scene:
        await browser.accept(subprotocol=VISER_PROTOCOL)
        with contextlib.closing(view.look()) as sight:
            await until_one_ends(
                partial(_down, scene, browser, sight), partial(_move, sight, browser), partial(_up, browser, scene, allowed)
            )
    with contextlib.suppress(RuntimeError, WebSocketDisconnect):
        await browser.close()


async def until_one_ends(*ways: Callable[[], Awaitable[None]]) -> None:
    """Runs the ways of a connection side by side until the first ends; a connection that is gone is no error."""
    async with anyio.create_task_group() as group:

        async def run(way: Callable[[], Awaitable[None]]) -> None:
            with contextlib.suppress(*_GONE):
                await way()
            group.cancel_scope.cancel()

        for way in ways:
            group.start_soon(run, way)


def may_pass(message: bytes, allowed: Allowed = WATCH) -> bool:
    """Whether a browser's message may reach the scene."""
    if len(message) > _MAX_MESSAGE:
        return False
    try:
        allowed.decode(message)
    except (msgspec.MsgspecError, UnicodeDecodeError):
        return False
    return True


async def _down(scene: ClientConnection, browser: WebSocket, sight: "Sight") -> None:
    async for message in scene:
        window = message if isinstance(message, bytes) else message.encode()
        await browser.send_bytes(window)
        sight.saw(window)


async def _move(sight: "Sight", browser: WebSocket) -> None:
    while True:
        # Waits while the browser is behind, and then skips what it has missed.
        await browser.send_bytes(await sight.next())


async def _up(browser: WebSocket, scene: ClientConnection, allowed: Allowed) -> None:
    while (message := await browser.receive())["type"] != "websocket.disconnect":
        data = message.get("bytes")
        if data is not None and may_pass(data, allowed):
            await scene.send(data)

"""Carries viser's WebSocket between a browser and the scene's own port: everything down, only the camera up.

viser believes every message of a client: some write attributes of its controls unchecked, one opens a public tunnel. So
what comes from browsers is let through by name.
"""

import contextlib
from collections.abc import Awaitable, Callable
from functools import partial

import anyio
import msgspec
from fastapi import WebSocket
from starlette.websockets import WebSocketDisconnect
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from server.live.page import VISER_PROTOCOL
from server.scene.gate import KEY

ALLOWED_FROM_BROWSERS = frozenset({"ViewerCameraMessage"})
# A camera's pose takes about 300 bytes.
_MAX_MESSAGE = 4096


# RuntimeError: Starlette's word for sending to a browser that has left.
_GONE = (ConnectionClosed, WebSocketDisconnect, RuntimeError)


class _Envelope(msgspec.Struct):
    """The only field of a message that the bridge reads."""

    type: str


_envelopes = msgspec.msgpack.Decoder(_Envelope)


async def bridge(browser: WebSocket, port: int) -> None:
    """Connects an unaccepted WebSocket of a browser with the scene on a port of 127.0.0.1, until one of them leaves."""
    async with connect(
        f"ws://127.0.0.1:{port}",
        subprotocols=[VISER_PROTOCOL],  # type: ignore[list-item]
        additional_headers=KEY,
        compression=None,
        max_size=None,
        # Frames pile up in the scene, which merges them, and not here.
        max_queue=4,
        proxy=None,
        ping_interval=None,
    ) as scene:
        await browser.accept(subprotocol=VISER_PROTOCOL)
        await until_one_ends(partial(_down, scene, browser), partial(_up, browser, scene))
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


def may_pass(message: bytes) -> bool:
    """Whether a browser's message may reach the scene."""
    if len(message) > _MAX_MESSAGE:
        return False
    try:
        return _envelopes.decode(message).type in ALLOWED_FROM_BROWSERS
    except msgspec.MsgspecError:
        return False


async def _down(scene: ClientConnection, browser: WebSocket) -> None:
    async for message in scene:
        await browser.send_bytes(message if isinstance(message, bytes) else message.encode())


async def _up(browser: WebSocket, scene: ClientConnection) -> None:
    while (message := await browser.receive())["type"] != "websocket.disconnect":
        data = message.get("bytes")
        if data is not None and may_pass(data):
            await scene.send(data)

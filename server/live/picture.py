"""What moves in a scene, as it stands, and viser's own words for what of it has changed.

viser would queue, compare and wrap every property of every node of every frame by itself, and send it through a socket of
its own: most of what a frame cost. Its part is the scene, which seldom changes; what moves goes straight to the browsers.
Whether a browser already has the nodes that a frame is about, a number in the scene tells (`Picture.mark`).
"""

import asyncio
import struct
import threading
import time
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import msgspec
import numpy as np
import viser
import zstandard
from numpy.typing import NDArray

_MARK = "/mark"
_PLACE, _PLACING = "position", "SetPositionMessage"
_LENGTHS = struct.Struct("<QQ")
_ALIGNMENT = 8
# What changes together in a frame is mostly the same as in the one before.
_KEPT_TEXTS = 64


@dataclass(slots=True)
class _Property:
    """One property of one node: its bytes, and since which version of the picture it has them."""

    name: str
    prop: str
    dtype: np.dtype[Any]
    data: bytes = b""
    version: int = 0


@dataclass(frozen=True, slots=True)
class _Change:
    """What brings a browser from one version of the picture to another, among the nodes of one generation."""

    generation: int
    since: int
    version: int
    data: bytes


class Picture:
    """The latest values of the properties that move.

    One thread puts and publishes, any other may ask.

    Args:
        server: whose nodes they are.
    """

    def __init__(self, server: viser.ViserServer) -> None:
        self._mark = server.scene.add_frame(_MARK, show_axes=False, visible=False)
        self._lock = threading.Lock()
        self._compressor = zstandard.ZstdCompressor(level=1)
        self._nodes: dict[str, viser.SceneNodeHandle] = {}
        self._properties: dict[tuple[str, str], _Property] = {}
        self._changed: dict[tuple[str, str], _Property] = {}
        self._texts: dict[tuple[tuple[str, str], ...], list[msgspec.Raw]] = {}
        self._generation = self._marked = 0
        self._version = 0
        self._newest = _Change(0, 0, 0, b"")
        self.sights: tuple[Sight, ...] = ()

    # -- the thread that draws --------------------------------------------------------------------------------------------

    def put(self, node: viser.SceneNodeHandle, prop: str, value: NDArray[Any]) -> None:
        """Sets a property of a node; what is as it was is not sent again."""
        name = node.name
        if self._nodes.get(name) is not node:
            self.forget(node)
            with self._lock:
                self._nodes[name] = node
                self._generation += 1
        known = self._properties.get((name, prop))
        if known is None:
            known = _Property(name, prop, np.asarray(getattr(node, prop)).dtype)
        data = value.astype(known.dtype, copy=False).tobytes()
        if data == known.data:
            return
        with self._lock:
            known.data = data
            known.version = self._version + 1
            self._changed[name, prop] = self._properties[name, prop] = known

    def forget(self, node: viser.SceneNodeHandle) -> None:
        """The node is about to go, or another has its name."""
        with self._lock:
            self._nodes.pop(node.name, None)
            for key in [key for key in self._properties if key[0] == node.name]:
                self._changed.pop(key, None)
                del self._properties[key]

    def publish(self) -> bool:
        """All of a frame has been put; whether anybody has something to send now."""
        if not self._changed:
            return False
        with self._lock:
            if self._marked != self._generation:
                self._marked = self._generation
                # Behind the nodes that it stands for: viser sends what it is told in order.
                self._mark.position = (float(self._generation), 0.0, 0.0)
            since, self._version = self._version, self._version + 1
            data = self._written(self._changed.values()) if self.sights else b""
            self._changed = {}
            self._newest = _Change(self._generation, since, self._version, data)
        return bool(self.sights)

    # -- whoever watches --------------------------------------------------------------------------------------------------

    def look(self) -> "Sight":
        """A browser on the event loop that runs here; `Sight.close` when it has left."""
        sight = Sight(self)
        with self._lock:
            self.sights = (*self.sights, sight)
        return sight

    def leave(self, sight: "Sight") -> None:
        """The browser has left."""
        with self._lock:
            self.sights = tuple(other for other in self.sights if other is not sight)

    def since(self, version: int, generation: int) -> _Change | None:
        """What is new since a version to one who knows the nodes of a generation; None where nothing, or the nodes are."""
        newest = self._newest
        if newest.generation != generation or newest.version <= version:
            return None
        if newest.since == version and newest.data:
            return newest
        with self._lock:
            if self._generation != generation:
                return None
            # What is being put while this is asked comes with the next.
            changed = [each for each in self._properties.values() if version < each.version]
            return _Change(generation, version, self._version, self._written(changed))

    def _written(self, properties: Iterable[_Property]) -> bytes:
        """What viser would send: a window of messages that set these."""
        ordered: list[_Property] = []
        placed: list[_Property] = []
        for each in properties:
            (placed if each.prop == _PLACE else ordered).append(each)
        keys = tuple((each.name, each.prop) for each in ordered)
        updates = self._texts.get(keys)
        if updates is None:
            if len(self._texts) > _KEPT_TEXTS:
                self._texts.clear()
            updates = self._texts[keys] = _updates(ordered)
        inner = msgspec.msgpack.encode(
            {
                "messages": [*updates, *map(_placing, placed)] if placed else updates,
                "timestampSec": time.perf_counter(),
                "binaryBufferLengths": [len(each.data) for each in ordered],
            }
        )
        compressed = self._compressor.compress(inner)
        parts = [_LENGTHS.pack(len(inner), len(compressed)), compressed]
        offset = _LENGTHS.size + len(compressed)
        for each in ordered:
            padding = -offset % _ALIGNMENT
            parts += (bytes(padding), each.data)
            offset += padding + len(each.data)
        return b"".join(parts)


def _updates(ordered: list[_Property]) -> list[msgspec.Raw]:
    """An update for each node, its arrays by their places among the bytes that follow."""
    updates: dict[str, dict[str, Any]] = {}
    for index, each in enumerate(ordered):
        updates.setdefault(each.name, {})[each.prop] = {"__binary_index": index, "dtype": each.dtype.str}
    messages = (
        {"name": name, "updates": props, "owner": "", "type": "SceneNodeUpdateMessage"} for name, props in updates.items()
    )
    return [msgspec.Raw(msgspec.msgpack.encode(message)) for message in messages]


def _placing(place: _Property) -> dict[str, Any]:
    """Where a node stands has a message of its own."""
    at = np.frombuffer(place.data, place.dtype).tolist()
    return {"name": place.name, "position": at, "owner": "", "type": _PLACING}


class Sight:
    """How much of a picture one browser has seen. Belongs to the event loop that it was made on."""

    def __init__(self, picture: Picture) -> None:
        self._picture = picture
        self._version = 0
        self._generation = -1
        self._new = asyncio.Event()
        self.loop = asyncio.get_running_loop()

    def wake(self) -> None:
        """There is something new; on the loop."""
        self._new.set()

    def saw(self, window: bytes) -> None:
        """The browser has been sent this by viser, which perhaps has told which nodes there are."""
        generation = marked(window)
        if generation is not None:
            self._generation = generation
            self._new.set()

    async def next(self) -> bytes:
        """What the browser is to be sent next: everything that has changed since the last time, however long ago."""
        while True:
            await self._new.wait()
            self._new.clear()
            change = self._picture.since(self._version, self._generation)
            if change is not None:
                self._version = change.version
                return change.data

    def close(self) -> None:
        """The browser has left."""
        self._picture.leave(self)


class _Message(msgspec.Struct):
    """One of viser's, as far as it matters here."""

    type: str
    name: str = ""
    position: msgspec.Raw = msgspec.Raw()


class _Window(msgspec.Struct):
    messages: list[_Message]


_windows = msgspec.msgpack.Decoder(_Window)
_places = msgspec.msgpack.Decoder(tuple[float, float, float])
_decompressor = zstandard.ZstdDecompressor()


def marked(window: bytes) -> int | None:
    """The generation of nodes that a window of viser's messages completes; None where it says nothing of them."""
    _, length = _LENGTHS.unpack_from(window)
    text = _decompressor.decompress(window[_LENGTHS.size : _LENGTHS.size + length])
    if _MARK.encode() not in text:
        return None
    for message in reversed(_windows.decode(text).messages):
        if message.name == _MARK and message.type == _PLACING:
            return round(_places.decode(message.position)[0])
    return None

"""What moves in a live view: only changes are sent, whoever is behind skips, and pages come before frames."""

import asyncio
import dataclasses
import threading
import time
from collections.abc import Callable, Iterable, Iterator
from typing import Any

import msgspec
import numpy as np
import pytest
import viser
import zstandard

from server.live.artist import Artist, next_round
from server.live.bridge import _move
from server.live.picture import Picture, Sight, marked
from sim.config import TaskConfig
from tests.server.test_live import make_frame
from workers.scene.quiet import start_viser, stop_viser
from workers.scene.scene import Scene


@pytest.fixture
def server() -> Iterator[viser.ViserServer]:
    started = start_viser()
    yield started
    stop_viser(started)


def read(window: bytes) -> dict[tuple[str, str], Any]:
    """What viser's client makes of a window: values by node and property."""
    length = int.from_bytes(window[8:16], "little")
    told = msgspec.msgpack.decode(zstandard.ZstdDecompressor().decompress(window[16 : 16 + length]))
    arrays, offset = [], 16 + length
    for size in told["binaryBufferLengths"]:
        offset += -offset % 8
        arrays.append(window[offset : offset + size])
        offset += size
    assert offset == len(window)
    values: dict[tuple[str, str], Any] = {}
    for message in told["messages"]:
        if message["type"] == "SetPositionMessage":
            values[message["name"], "position"] = message["position"]
        for prop, place in message.get("updates", {}).items():
            values[message["name"], prop] = np.frombuffer(arrays[place["__binary_index"]], place["dtype"])
    return values


def node(server: viser.ViserServer, name: str) -> viser.PointCloudHandle:
    return server.scene.add_point_cloud(name, np.zeros((2, 3), np.float32), (1, 2, 3))


def knowing(picture: Picture, sight: Sight) -> Sight:
    """A browser that viser has sent all nodes."""
    sight._generation = picture._generation
    sight.wake()
    return sight


async def nothing_comes(sight: Sight) -> bool:
    sight.wake()
    try:
        async with asyncio.timeout(0.05):
            await sight.next()
    except TimeoutError:
        return True
    return False


def test_only_what_has_changed_is_sent(server: viser.ViserServer) -> None:
    async def scenario() -> None:
        picture = Picture(server)
        points, others = node(server, "/points"), node(server, "/others")
        picture.put(points, "points", np.ones((2, 3)))
        picture.put(others, "points", np.ones((2, 3)))
        sight = picture.look()
        assert picture.publish()
        first = read(await knowing(picture, sight).next())
        assert {name for name, _ in first} == {"/points", "/others"}
        moved = np.array([[1.0, 1.0, 1.0], [1.0, 1.0, 2.5]])
        picture.put(points, "points", moved)
        picture.put(others, "points", np.ones((2, 3)))
        assert picture.publish()
        sight.wake()
        second = read(await sight.next())
        assert list(second) == [("/points", "points")]
        np.testing.assert_array_equal(second["/points", "points"].reshape(2, 3), moved)
        # A frame in which nothing has moved.
        picture.put(points, "points", moved)
        assert not picture.publish()
        assert await nothing_comes(sight)

    asyncio.run(scenario())


def test_whoever_is_behind_is_sent_the_newest_once_and_misses_nothing(server: viser.ViserServer) -> None:
    async def scenario() -> None:
        picture = Picture(server)
        points, others = node(server, "/points"), node(server, "/others")
        slow = picture.look()
        picture.put(points, "points", np.zeros((2, 3)))
        picture.put(others, "points", np.ones((2, 3)))
        picture.publish()
        await knowing(picture, slow).next()
        picture.put(others, "points", np.full((2, 3), 7.0))
        for number in range(5):
            picture.put(points, "points", np.full((2, 3), float(number + 1)))
            picture.publish()
            slow.wake()
        caught_up = read(await slow.next())
        assert caught_up["/points", "points"].tolist() == [5.0] * 6
        assert caught_up["/others", "points"].tolist() == [7.0] * 6
        assert await nothing_comes(slow)

    asyncio.run(scenario())


def test_nothing_is_sent_of_nodes_that_the_browser_does_not_have(server: viser.ViserServer) -> None:
    async def scenario() -> None:
        picture = Picture(server)
        picture.put(node(server, "/points"), "points", np.ones((2, 3)))
        picture.publish()
        sight = picture.look()
        assert await nothing_comes(sight)
        assert len(read(await knowing(picture, sight).next())) == 1
        # Others take their place: what is said of them waits for them, what was there is not spoken of again.
        again = node(server, "/points")
        picture.put(again, "points", np.full((2, 3), 2.0))
        picture.publish()
        assert await nothing_comes(sight)
        assert read(await knowing(picture, sight).next())["/points", "points"].tolist() == [2.0] * 6
        picture.forget(again)
        picture.put(node(server, "/new"), "points", np.ones((2, 3)))
        picture.publish()
        assert list(read(await knowing(picture, picture.look()).next())) == [("/new", "points")]

    asyncio.run(scenario())


def test_where_a_node_stands_has_a_message_of_its_own(server: viser.ViserServer) -> None:
    async def scenario() -> None:
        picture = Picture(server)
        picture.put(server.scene.add_frame("/world"), "position", np.array([1.0, -2.0, 0.0]))
        picture.publish()
        window = await knowing(picture, picture.look()).next()
        assert read(window) == {("/world", "position"): [1.0, -2.0, 0.0]}
        assert marked(window) is None

    asyncio.run(scenario())


def test_nobody_looks_nothing_is_written(server: viser.ViserServer) -> None:
    async def scenario() -> None:
        picture = Picture(server)
        points = node(server, "/points")
        sight = picture.look()
        sight.close()
        picture.put(points, "points", np.ones((2, 3)))
        assert not picture.publish()
        assert picture._newest.data == b""

    asyncio.run(scenario())


def test_a_robots_frame_is_small_and_one_in_which_it_stands_still_is_none(server: viser.ViserServer) -> None:
    async def scenario() -> None:
        picture = Picture(server)
        scene = Scene(server, TaskConfig(), "light", picture)
        scene.show_rays(True, 0)
        sight = picture.look()
        frame = make_frame(robots=8)
        for number in range(3):
            scene.update(dataclasses.replace(frame, sim_time=number / 30), number / 30)
            assert picture.publish() == (number == 0)
        whole = await knowing(picture, sight).next()
        driven = dataclasses.replace(frame, sim_time=0.1, poses=frame.poses + np.float32(0.002))
        scene.update(driven, 0.1)
        picture.publish()
        sight.wake()
        window = await sight.next()
        changed = {name for name, _ in read(window)}
        assert {"/world/shells", "/world/chassis", "/world/trail_ends", "/world/rays", "/world/hits"} <= changed
        assert not {"/world/trails", "/world/targets", "/world/beacons"} & changed
        assert len(window) < len(whole) / 2

    asyncio.run(scenario())


def test_a_browser_that_is_slow_gets_fewer_frames_and_the_newest(server: viser.ViserServer) -> None:
    class Browser:
        def __init__(self) -> None:
            self.seen: list[float] = []
            self.newest = asyncio.Event()

        async def send_bytes(self, data: bytes) -> None:
            self.seen.append(float(read(data)["/points", "points"][0]))
            if self.seen[-1] == 100.0:
                self.newest.set()
            await asyncio.sleep(0.02)

    async def scenario() -> None:
        picture, browser = Picture(server), Browser()
        points = node(server, "/points")
        picture.put(points, "points", np.zeros((2, 3)))
        picture.publish()
        sight = knowing(picture, picture.look())
        task = asyncio.create_task(_move(sight, browser))  # type: ignore[arg-type]
        for number in range(1, 101):
            picture.put(points, "points", np.full((2, 3), float(number)))
            picture.publish()
            sight.wake()
            await asyncio.sleep(0.002)
        async with asyncio.timeout(5.0):
            await browser.newest.wait()
        task.cancel()
        assert len(browser.seen) < 60
        assert browser.seen == sorted(set(browser.seen))

    asyncio.run(scenario())


# -- the artist -----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("drawn", "told", "expected"),
    [
        # Nothing to do: the next thirtieth of a second.
        (10.001, 10.002, 10.0 + 1 / 30),
        # Drawing took 50 ms: as long is left to others.
        (10.050, 10.051, 10.100),
        # The loop took 100 ms to answer: it gets as much again.
        (10.001, 10.101, 10.201),
    ],
)
def test_rounds_leave_time_for_others(drawn: float, told: float, expected: float) -> None:
    assert next_round(10.0, 10.0, drawn, told) == pytest.approx(expected)


class Counted:
    """A view that always has something new."""

    def __init__(self, sight: Sight) -> None:
        self.rounds = 0
        self._sight = sight

    def draw(self, now: float) -> Iterable[Sight]:
        self.rounds += 1
        return (self._sight,)


def until(condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 10.0
    while not condition():
        assert time.monotonic() < deadline
        time.sleep(0.005)


def rounds_while_busy(view: Counted, seconds: float) -> int:
    """How often a view is drawn while the event loop has other things to do."""
    before = view.rounds
    time.sleep(seconds)
    return view.rounds - before


def test_an_event_loop_that_is_busy_is_not_told_again_before_it_has_answered(server: viser.ViserServer) -> None:
    async def scenario() -> None:
        artist, view = Artist(), Counted(Picture(server).look())
        artist.add(view)
        await asyncio.to_thread(until, lambda: view.rounds > 3)
        assert rounds_while_busy(view, seconds=0.4) <= 1
        artist.remove(view)

    asyncio.run(scenario())


def test_the_thread_that_draws_is_there_while_there_is_anything_to_draw(server: viser.ViserServer) -> None:
    def drawing() -> bool:
        return any(thread.name == "live-views" and thread.is_alive() for thread in threading.enumerate())

    async def scenario() -> None:
        artist = Artist()
        views = [Counted(Picture(server).look()) for _ in range(2)]
        for view in views:
            artist.add(view)
        await asyncio.to_thread(until, lambda: all(view.rounds for view in views))
        artist.remove(views[0])
        assert drawing()
        artist.remove(views[1])
        await asyncio.to_thread(until, lambda: not drawing())
        artist.add(views[0])
        rounds = views[0].rounds
        await asyncio.to_thread(until, lambda: views[0].rounds > rounds)
        artist.remove(views[0])

    asyncio.run(scenario())

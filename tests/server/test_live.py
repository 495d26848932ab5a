"""The live view: scenes come and go with their watchers, frames reach browsers, browsers reach nothing but the camera."""

import asyncio
import dataclasses
import re
import socket
import time
from typing import Any

import httpx
import msgspec
import numpy as np
import pytest
import zstandard
from fastapi import FastAPI
from fastapi.testclient import TestClient
from hypothesis import example, given
from hypothesis import strategies as st
from starlette.testclient import WebSocketTestSession
from starlette.websockets import WebSocketDisconnect
from websockets.exceptions import InvalidStatus
from websockets.sync.client import ClientConnection
from websockets.sync.client import connect as connect_websocket
from websockets.typing import Subprotocol

from server.live.bridge import may_pass
from server.live.hub import LiveHub, TooManyViewsError
from server.live.page import VISER_PROTOCOL, own_websocket
from server.live.settings import LiveSettings
from server.live.view import LiveView
from server.services import Services
from sim.arenas import build_arena
from sim.config import GeneratedArenaConfig, TaskConfig
from workers.errors import FrameError
from workers.frames import Frame
from workers.reporting import WatchRequest
from workers.scene.gate import KEY
from workers.scene.moving import ByViser
from workers.scene.quiet import start_viser, stop_viser
from workers.scene.robots import RobotNodes
from workers.scene.scene import Scene
from workers.scene.themes import COLOURS, Theme

ORIGIN = {"Origin": "http://127.0.0.1:8400"}
SOCKETS = "ws://127.0.0.1:8400"
CAMERA: dict[str, Any] = {
    "type": "ViewerCameraMessage",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (0.0, -9.0, 9.0),
    "fov": 0.78,
    "near": 0.01,
    "far": 1000.0,
    "image_height": 700,
    "image_width": 1100,
    "look_at": (0.0, 0.0, 0.0),
    "up_direction": (0.0, 0.0, 1.0),
}


def make_frame(number: int = 0, robots: int = 2, outcome: int = 0) -> Frame:
    return Frame(
        mode="policy",
        step=4096 + number,
        sim_time=number / 30,
        speed=1.0,
        poses=np.tile(np.array([0.01 * number, 1.0, 0.5], np.float32), (robots, 1)),
        targets=np.full((robots, 2), float(outcome), np.float32),
        ranges=np.full((robots, 30), 2.0, np.float32),
        fields_of_view=np.full(robots, 180.0, np.float32),
        rewards=np.full(robots, 12.0, np.float32),
        outcomes=np.full(robots, outcome, np.uint8),
    )


class Asked:
    """What the worker has been told to show."""

    def __init__(self) -> None:
        self.all: list[WatchRequest | None] = []

    def tell(self, request: WatchRequest | None) -> None:
        self.all.append(request)

    def newest(self) -> WatchRequest | None:
        return self.all[-1]


def listening(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("127.0.0.1", port)) == 0


@pytest.fixture
def run_id(client: TestClient) -> str:
    experiment = client.post("/api/experiments", json={"name": "watched", "seeds": [1]}).json()
    identifier: str = experiment["runs"][0]["id"]
    return identifier


def connect(
    client: TestClient, path: str, headers: dict[str, str] = ORIGIN, protocol: str = VISER_PROTOCOL
) -> WebSocketTestSession:
    return client.websocket_connect(SOCKETS + path, subprotocols=[protocol], headers=headers)


def receive_until(browser: WebSocketTestSession, *words: bytes) -> None:
    """Reads what viser sends until one message holds all the words."""
    for _ in range(400):
        message = browser.receive_bytes()
        # Two lengths of 8 bytes, then the compressed text, then arrays as they are.
        compressed = int.from_bytes(message[8:16], "little")
        text = zstandard.ZstdDecompressor().decompress(message[16 : 16 + compressed])
        if all(word in text for word in words):
            return
    raise AssertionError(f"the scene never said {words}")


def refused(client: TestClient, path: str, headers: dict[str, str] = ORIGIN, protocol: str = VISER_PROTOCOL) -> bool:
    try:
        with connect(client, path, headers, protocol):
            return False
    except WebSocketDisconnect:
        return True


# -- the hub --------------------------------------------------------------------------------------------------------------


def test_a_scene_lives_as_long_as_somebody_watches_and_a_little_longer() -> None:
    async def scenario() -> None:
        hub = LiveHub(LiveView, linger=0.2)
        asked = Asked()
        detach = hub.attach("run", asked.tell)
        assert asked.all == [None]
        async with hub.watch("run", TaskConfig()) as view:
            assert listening(view.port)
            assert asked.newest() == WatchRequest(mode="policy", robots=8, speed=1.0)
            async with hub.watch("run", TaskConfig()) as again:
                assert again is view
                assert hub.status("run").watchers == 2
            hub.configure("run", LiveSettings(mode="training", robots=3, rays=False))
            assert asked.newest() == WatchRequest(mode="training", robots=3)
        assert asked.newest() is None
        # Whoever comes back at once finds the same scene.
        async with hub.watch("run", TaskConfig()) as back:
            assert back is view
        await asyncio.sleep(0.5)
        assert not listening(view.port)
        detach()
        detach()
        await hub.close()
        # What the worker need not know is not told: rays are the scene's own matter.
        assert asked.all == [
            None,
            WatchRequest(),
            WatchRequest(mode="training", robots=3),
            None,
            WatchRequest(mode="training", robots=3),
            None,
        ]

    asyncio.run(scenario())


def test_what_a_person_chooses_is_their_own_but_for_mode_and_speed() -> None:
    async def scenario() -> None:
        hub, asked = LiveHub(LiveView, linger=0.0), Asked()
        hub.attach("run", asked.tell)
        async with hub.watch("run", TaskConfig(), person="ada") as hers, hub.watch("run", TaskConfig(), person="bob") as his:
            assert hers is not his
            hub.configure("run", LiveSettings(robots=12, rays=False, follow=3, speed=5), "ada")
            assert hub.settings("run", "ada") == LiveSettings(robots=12, rays=False, follow=3, speed=5)
            assert hub.settings("run", "bob") == LiveSettings(speed=5)
            # As many robots as anybody wants to see.
            assert asked.newest() == WatchRequest(robots=12, speed=5.0)
            hub.configure("run", LiveSettings(robots=2, speed=5), "bob")
            for number in range(60):
                hub.frames("run", make_frame(number, robots=12))
                await asyncio.sleep(0.02)
            # Of the twelve each sees those that were asked for.
            assert [line.index for line in hub.score("run", "light", "ada").robots] == [3]
            assert [line.index for line in hub.score("run", "light", "bob").robots] == [0, 1]
            hub.configure("run", LiveSettings(robots=2, mode="training"), "bob")
            assert asked.newest() == WatchRequest(mode="training", robots=12)
        await hub.close()

    asyncio.run(scenario())


@pytest.mark.parametrize(
    "headers",
    [{}, {"Origin": "http://evil.example"}, {"Authorization": "Bearer guessed"}, {"Authorization": "Bearer ünïcode"}],
)
def test_a_scenes_own_port_opens_for_the_bridge_alone(headers: dict[str, str]) -> None:
    view = LiveView(TaskConfig(), "light", LiveSettings())
    try:
        with pytest.raises(InvalidStatus) as refused, connect_directly(view.port, headers):
            raise AssertionError("a stranger sees the scene")
        assert refused.value.response.status_code == 403
        page = httpx.get(
            f"http://127.0.0.1:{view.port}/", headers=[(name.encode(), value.encode()) for name, value in headers.items()]
        )
        assert page.status_code == 403
        with connect_directly(view.port, KEY) as bridge:
            assert bridge.recv(timeout=10)
    finally:
        view.close()


def connect_directly(port: int, headers: dict[str, str]) -> ClientConnection:
    """Past the server, as any user of this machine could try."""
    return connect_websocket(
        f"ws://127.0.0.1:{port}", subprotocols=[Subprotocol(VISER_PROTOCOL)], additional_headers=headers, proxy=None
    )


def test_frames_for_nobody_are_dropped_unread() -> None:
    async def scenario() -> None:
        hub = LiveHub(LiveView)
        hub.attach("run", lambda _: None)
        hub.frames("run", b"no frame at all")
        assert hub.status("run").model_dump() == {"connected": True, "receiving": False, "watchers": 0}
        assert hub.watch_request("run") is None
        async with hub.watch("run", TaskConfig()):
            with pytest.raises(FrameError):
                hub.frames("run", b"no frame at all")
            hub.frames("run", make_frame().encode())
            assert hub.status("run").receiving
            assert not hub.status("another run").receiving
        await hub.close()

    asyncio.run(scenario())


def test_there_are_only_so_many_scenes() -> None:
    async def scenario() -> None:
        hub = LiveHub(LiveView, linger=0.0, capacity=1)
        async with hub.watch("one", TaskConfig()):
            with pytest.raises(TooManyViewsError, match="Close one"):
                async with hub.watch("two", TaskConfig()):
                    raise AssertionError("opened")
            assert hub.watch_request("two") is None
        await asyncio.sleep(0.1)
        async with hub.watch("two", TaskConfig()):
            assert hub.watch_request("two") is not None
        await hub.close()

    asyncio.run(scenario())


def test_closing_the_hub_closes_scenes_that_are_being_watched() -> None:
    async def scenario() -> None:
        hub = LiveHub(LiveView)
        async with hub.watch("run", TaskConfig()) as light, hub.watch("run", TaskConfig(), "dark") as dark:
            assert light is not dark
            await hub.close()
            assert not listening(light.port)
            assert not listening(dark.port)

    asyncio.run(scenario())


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_scene_shows_frames_and_counts_what_happened(theme: Theme) -> None:
    view = LiveView(TaskConfig(), theme, LiveSettings())
    try:
        assert view.score().state == "no worker"
        view.apply(LiveSettings(), connected=True)
        assert view.score().state == "waiting"
        assert asyncio.run(_play(view))
        score = view.score()
        assert (score.state, score.mode, score.arrivals) == ("live", "policy", 2)
        assert [robot.reward for robot in score.robots] == [12.0, 12.0]
    finally:
        view.close()


def test_a_frame_that_cannot_be_drawn_is_not_the_last(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    drawn: list[Frame] = []

    def draw(_: Scene, frame: Frame, now: float) -> None:
        drawn.append(frame)
        if len(drawn) <= 3:
            raise RuntimeError("no more memory")

    monkeypatch.setattr(Scene, "update", draw)
    view = LiveView(TaskConfig(), "light", LiveSettings())
    try:
        assert asyncio.run(_play(view))
    finally:
        view.close()
    assert len(drawn) > 3
    complaints = [record for record in caplog.records if record.name == "server.live.view"]
    assert len(complaints) == 1  # not thirty a second


async def _play(view: LiveView) -> bool:
    """Frames at their pace, the last ones after an arrival of both robots; other settings on the way."""
    for number in range(30):
        view.show(make_frame(number, outcome=int(number >= 10)))
        if number == 12:
            view.apply(LiveSettings(rays=False, follow=1), connected=True)
        if number == 20:
            view.apply(LiveSettings(rays=True, follow=7), connected=True)
        await asyncio.sleep(1 / 30)
    for _ in range(100):
        if view.score().arrivals:
            return True
        await asyncio.sleep(0.05)
    return False


def test_rays_are_drawn_of_the_robot_that_is_asked_for_or_of_all() -> None:
    frame = dataclasses.replace(make_frame(robots=3), poses=np.array([[0, 0, 0], [1, 2, 0], [3, 4, 0]], np.float32))
    server = start_viser()
    try:
        nodes = RobotNodes(server, ByViser(), "/robots", TaskConfig(), COLOURS["light"], frame)
        for asked, drawn in ((1, [1]), (None, [0, 1, 2]), (7, [2])):
            nodes.show_rays(True, asked)
            nodes.update(frame, 0.0)
            assert nodes._rays is not None
            rays = nodes._rays.lines.points.reshape(-1, 30, 2, 3)
            np.testing.assert_allclose(rays[:, 0, 0, :2], frame.poses[drawn, :2])
            np.testing.assert_allclose(np.linalg.norm(rays[:, :, 1] - rays[:, :, 0], axis=-1), 2.0, rtol=1e-5)
    finally:
        stop_viser(server)


def test_rays_are_drawn_where_each_robots_own_scanner_has_them() -> None:
    frame = dataclasses.replace(
        make_frame(robots=2),
        poses=np.array([[0.0, 0.0, 0.0], [1.0, 0.0, np.pi / 2]], np.float32),
        fields_of_view=np.array([90.0, 180.0], np.float32),
    )
    server = start_viser()
    try:
        nodes = RobotNodes(server, ByViser(), "/robots", TaskConfig(), COLOURS["light"], frame)
        nodes.update(frame, 0.0)
        assert nodes._rays is not None
        ends = nodes._rays.lines.points.reshape(2, 30, 2, 3)[:, [0, -1], 1, :2]
    finally:
        stop_viser(server)
    # All 2 m long: 45 degrees to either side of one robot, and a right angle to either side of the other.
    root = np.sqrt(2.0)
    np.testing.assert_allclose(ends, [[[root, -root], [root, root]], [[3.0, 0.0], [-1.0, 0.0]]], atol=1e-6)


def test_a_scene_follows_the_training_into_another_arena() -> None:
    task = TaskConfig(arena=GeneratedArenaConfig(maps=2))
    view = LiveView(task, "light", LiveSettings(mode="training"))
    try:
        for number in range(20):
            view.show(dataclasses.replace(make_frame(number, robots=1 + number // 10), mode="training", arena=number // 10))
            time.sleep(1 / 30)
        deadline = time.monotonic() + 10
        while view.score().step != 4096 + 19:
            assert time.monotonic() < deadline
            time.sleep(0.01)
        shapes = build_arena(task.arena, 1)
        kept = [name for name in view._server.scene._handle_from_node_name if "/circles/" in name or "/boxes/" in name]
        assert len(kept) == len(shapes.circles) + len(shapes.boxes)
    finally:
        view.close()


@pytest.mark.parametrize("theme", ["light", "dark"])
def test_a_scene_shows_movers_where_they_are_as_wide_as_they_are(theme: Theme) -> None:
    server = start_viser()
    nodes = server.scene._handle_from_node_name
    try:
        scene = Scene(server, TaskConfig(), theme)
        for number, movers in enumerate(([], [[1.0, 2.0, 0.25], [-3.0, 0.5, 0.4]], [[0.0, -1.0, 0.5]], [])):
            frame = dataclasses.replace(make_frame(number), movers=np.array(movers, np.float32).reshape(-1, 3))
            scene.update(frame, float(number))
            assert ("/world/movers" in nodes) == bool(movers)
            if movers:
                drawn: Any = nodes["/world/movers"]
                np.testing.assert_allclose(drawn.batched_positions[:, :2], frame.movers[:, :2])
                np.testing.assert_allclose(drawn.batched_scales[:, :2], frame.movers[:, 2:].repeat(2, axis=1))
    finally:
        stop_viser(server)


@pytest.mark.parametrize(
    "other",
    [{"arena": 1}, {"ranges": np.ones((2, 7), np.float32)}, {"movers": np.ones((17, 3), np.float32)}],
)
def test_frames_of_another_task_are_refused(other: dict[str, Any]) -> None:
    view = LiveView(TaskConfig(), "light", LiveSettings())
    try:
        with pytest.raises(FrameError, match="not what this training has"):
            view.show(dataclasses.replace(make_frame(), **other))
        with pytest.raises(FrameError):
            view.show(make_frame(robots=65))
    finally:
        view.close()


# -- settings -------------------------------------------------------------------------------------------------------------


def test_settings_are_kept_and_come_with_a_status(client: TestClient, run_id: str) -> None:
    state = client.get(f"/api/runs/{run_id}/live").json()
    assert state == {
        "mode": "policy",
        "robots": 8,
        "speed": 1,
        "rays": True,
        "ray_robots": "followed",
        "follow": None,
        "status": {"connected": False, "receiving": False, "watchers": 0},
    }
    wanted = {"mode": "training", "robots": 64, "speed": 10, "rays": False, "ray_robots": "all", "follow": 63}
    assert client.put(f"/api/runs/{run_id}/live", json=wanted).json() == wanted | {"status": state["status"]}
    assert client.get(f"/api/runs/{run_id}/live").json() == wanted | {"status": state["status"]}


@pytest.mark.parametrize(
    "wrong", [{"robots": 65}, {"robots": 0}, {"speed": 3}, {"mode": "replay"}, {"follow": -1}, {"colour": "red"}]
)
def test_settings_out_of_range_are_refused(client: TestClient, run_id: str, wrong: dict[str, Any]) -> None:
    assert client.put(f"/api/runs/{run_id}/live", json=wrong).status_code == 422


def test_a_run_that_is_not_there_has_no_live_view(client: TestClient) -> None:
    assert client.get("/api/runs/nosuchrun/live").status_code == 404
    assert client.put("/api/runs/nosuchrun/live", json={}).status_code == 404
    assert client.get("/live/nosuchrun/").status_code == 404
    assert client.get("/live/nosuchrun/light/").status_code == 404
    assert refused(client, "/live/nosuchrun/light")
    assert refused(client, "/live/nosuchrun/light/display")


# -- the page -------------------------------------------------------------------------------------------------------------


def test_the_page_is_in_the_look_that_the_query_asks_for(client: TestClient, run_id: str) -> None:
    light = client.get(f"/live/{run_id}/")
    dark = client.get(f"/live/{run_id}/?darkMode")
    assert light.url.path == f"/live/{run_id}/light/"
    assert dark.url.path == f"/live/{run_id}/dark/"
    assert 'data-theme="light"' in light.text
    assert 'data-theme="dark"' in dark.text


def test_the_page_may_talk_to_nobody_else(client: TestClient, run_id: str) -> None:
    policy = client.get(f"/live/{run_id}/light/").headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy
    assert "connect-src 'self' data: blob:;" in policy
    assert "frame-ancestors 'self'" in policy
    assert not re.search(r"https?:|\*|'unsafe-eval'", policy)


def test_an_address_that_names_another_server_or_file_is_cleaned(client: TestClient, run_id: str) -> None:
    page = f"/live/{run_id}/light/"
    own = f"ws://127.0.0.1:8400/live/{run_id}/light"
    assert client.get(page, params={"websocket": own}, follow_redirects=False).status_code == 200
    for crafted in (
        {"websocket": "ws://evil.example/live"},
        {"websocket": own + "@evil.example"},
        {"websocket": [own, "ws://evil.example"]},
        {"playbackPath": "https://evil.example/scene.viser"},
    ):
        response = client.get(page, params=crafted, follow_redirects=False)
        assert (response.status_code, response.headers["Location"]) == (307, page)


@given(st.text(max_size=60))
def test_only_the_pages_own_socket_is_its_own(value: str) -> None:
    assert not own_websocket(value, "127.0.0.1:8400", "/live/r/light")
    assert own_websocket("wss://127.0.0.1:8400/live/r/light", "127.0.0.1:8400", "/live/r/light")


# -- the bridge -----------------------------------------------------------------------------------------------------------


def test_frames_of_the_worker_reach_the_browser(client: TestClient, services: Services, run_id: str) -> None:
    portal = client.portal
    assert portal is not None
    asked = Asked()
    portal.call(services.live.attach, run_id, asked.tell)
    with connect(client, f"/live/{run_id}/light") as browser:
        assert str(browser.accepted_subprotocol) == VISER_PROTOCOL
        receive_until(browser, b"/world/arena/floor")
        assert asked.all == [None, WatchRequest()]
        for number in range(6):
            portal.call(services.live.frames, run_id, make_frame(number).encode())
        receive_until(browser, b"/world/shells", b"batched_positions")
        assert client.get(f"/api/runs/{run_id}/live").json()["status"] == {
            "connected": True,
            "receiving": True,
            "watchers": 1,
        }
    assert asked.newest() is None


def test_the_camera_gets_through_and_nothing_else(client: TestClient, services: Services, run_id: str) -> None:
    with connect(client, f"/live/{run_id}/light") as browser:
        receive_until(browser, b"/world/arena/floor")
        for forbidden in ({"type": "ShareUrlRequest"}, {"type": "GuiUpdateMessage", "uuid": "x", "updates": {}}):
            browser.send_bytes(msgspec.msgpack.encode(forbidden))
        browser.send_text("no bytes")
        browser.send_bytes(msgspec.msgpack.encode(CAMERA))
        view = services.live._channels[run_id].screens["owner", "light"].view
        assert isinstance(view, LiveView)
        # viser counts a client as connected once it knows its camera.
        deadline = time.monotonic() + 10
        while not view._server.get_clients():
            assert time.monotonic() < deadline
            time.sleep(0.01)
        (known,) = view._server.get_clients().values()
        np.testing.assert_allclose(known.camera.position, CAMERA["position"])
        assert view._server._share_tunnel is None


@given(st.text(max_size=30).filter(lambda name: name != "ViewerCameraMessage"), st.binary(max_size=50))
@example("", b"\x80")  # an empty message, without a name
def test_messages_pass_by_name_only(name: str, noise: bytes) -> None:
    assert may_pass(msgspec.msgpack.encode(CAMERA))
    assert not may_pass(msgspec.msgpack.encode(CAMERA | {"type": name}))
    assert not may_pass(noise)
    assert not may_pass(msgspec.msgpack.encode(CAMERA | {"more": b"x" * 5000}))


def test_strangers_are_turned_away(app: FastAPI, client: TestClient, run_id: str) -> None:
    for path in (f"/live/{run_id}/light", f"/live/{run_id}/light/display"):
        assert not refused(client, path)
        assert refused(client, path, {"Origin": "https://evil.example"})
        stranger = TestClient(app, base_url="http://127.0.0.1:8400")
        assert refused(stranger, path)
        assert stranger.get(f"{path}/").status_code == 401


def test_a_client_of_another_version_is_turned_away(client: TestClient, run_id: str) -> None:
    with (
        pytest.raises(WebSocketDisconnect),
        client.websocket_connect(f"/live/{run_id}/light", subprotocols=["viser-v0.0.1"]),
    ):
        pass


def test_the_display_says_how_it_stands(client: TestClient, services: Services, run_id: str) -> None:
    portal = client.portal
    assert portal is not None
    with connect(client, f"/live/{run_id}/light/display") as display:
        assert display.receive_json()["state"] == "no worker"
        portal.call(services.live.attach, run_id, lambda _: None)
        assert display.receive_json()["state"] == "waiting"
        with connect(client, f"/live/{run_id}/light") as browser:
            receive_until(browser, b"/world/arena/floor")
            for number in range(6):
                portal.call(services.live.frames, run_id, make_frame(number).encode())
            score = display.receive_json()
            while score["state"] != "live" or not score["mode"]:
                score = display.receive_json()
            assert score["mode"] == "policy"
            assert score["robots"][0] == {"index": 0, "reward": 12.0, "outcome": 0}

"""Playgrounds: a policy drives where its owner puts things, and nobody else finds it."""

import math
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
import pytest
from fastapi.testclient import TestClient

from server.live.bridge import PLAY, WATCH, may_pass
from server.live.drivers import PolicyDrivers
from server.playground.registry import MAX_EACH
from server.playground.schemas import Moment, PutCircle
from server.services import Services
from tests.server.harness import BASE_URL
from tests.server.job_worker import working
from tests.server.people import Lab
from tests.server.test_live import CAMERA, connect, receive_until
from workers.frames import Frame
from workers.play_protocol import MAX_OBSTACLES, PlaySeen

ROOM = {"name": "simple"}
CLICK: dict[str, Any] = {
    "type": "ScenePointerMessage",
    "event_type": "click",
    "ray_origin": (0.0, -9.0, 9.0),
    "ray_direction": (0.1, 0.7, -0.7),
    "screen_pos": ((0.5, 0.5),),
    "modifier": None,
}
DRAG: dict[str, Any] = {
    "type": "TransformControlsUpdateMessage",
    "name": "/world/handle",
    "wxyz": (1.0, 0.0, 0.0, 0.0),
    "position": (1.0, 2.0, 0.05),
    "owner": "",
}

GRAB: dict[str, Any] = {
    "type": "SceneNodeDragMessage",
    "phase": "start",
    "name": "/world/hold",
    "instance_index": None,
    "start_position": (0.0, 0.0, 0.0),
    "start_screen_pos": (0.5, 0.5),
    "end_position": (0.0, 0.0, 0.0),
    "end_screen_pos": (0.5, 0.5),
    "button": "left",
    "modifier": None,
    "owner": "",
}


def opened(client: TestClient, policy: str = "complex", **more: Any) -> dict[str, Any]:
    asked = {"policy": {"source": "shipped", "name": policy}, "arena": ROOM, **more}
    answer = client.post("/api/playgrounds", json=asked)
    assert answer.status_code == 201, answer.text
    ground: dict[str, Any] = answer.json()
    return ground


def change(client: TestClient, ground: dict[str, Any], act: str, **more: Any) -> dict[str, Any]:
    answer = client.post(f"/api/playgrounds/{ground['id']}/changes", json={"act": act, **more})
    assert answer.status_code == 200, answer.text
    state: dict[str, Any] = answer.json()
    return state


def refused(client: TestClient, ground: dict[str, Any], act: str, **more: Any) -> str:
    answer = client.post(f"/api/playgrounds/{ground['id']}/changes", json={"act": act, **more})
    assert answer.status_code == 422, answer.text
    return str(answer.json()["detail"])


def settings(client: TestClient, ground: dict[str, Any], **some: Any) -> dict[str, Any]:
    path = f"/api/playgrounds/{ground['id']}"
    answer = client.put(f"{path}/settings", json={**client.get(path).json()["settings"], **some})
    assert answer.status_code == 200, answer.text
    state: dict[str, Any] = answer.json()
    return state


def when(client: TestClient, ground: dict[str, Any], condition: Callable[[dict[str, Any]], bool]) -> dict[str, Any]:
    """The playground once something is so."""
    deadline = time.monotonic() + 90.0
    while not condition(state := client.get(f"/api/playgrounds/{ground['id']}").json()):
        assert time.monotonic() < deadline, f"waited in vain: {state}"
        time.sleep(0.02)
    found: dict[str, Any] = state
    return found


@pytest.fixture
def services(services: Services) -> Services:
    services.drivers = PolicyDrivers(services.live, linger=0.0)
    return services


@pytest.fixture
def play_worker(client: TestClient, services: Services, tmp_path: Path) -> Iterator[None]:
    with working(client, services, tmp_path / "work", kinds=("play",)):
        yield


def test_the_robot_goes_round_what_is_put_in_its_way(client: TestClient, play_worker: None) -> None:
    ground = opened(client)
    with connect(client, f"/live/{ground['id']}/light") as browser:
        receive_until(browser, b"/world/arena/floor")
        when(client, ground, lambda now: now["driving"])
        settings(client, ground, paused=True)
        change(client, ground, "put robot", x=-2.0, y=0.0, heading=0.0)
        change(client, ground, "put target", x=1.0, y=0.0)
        # 3 m less the 0.2 m that count as arrived, at 0.25 m/s at most: 11.2 s, and a little for turning.
        straight = when(client, ground, lambda now: not now["outdated"])
        assert (straight["robot"]["x"], straight["target"]["x"]) == (-2.0, 1.0)
        assert straight["outcome"] == "arrival"
        assert 11.2 <= straight["seconds"] < 13.5
        assert straight["value"] > 0.0

        # A disc in the middle of its way: what it foresees takes longer now.
        wall = change(client, ground, "put circle", x=3.0, y=3.0, radius=0.4)
        assert wall["chosen"] == {"act": "choose", "thing": "circle", "index": 0}
        receive_until(browser, b"/world/circle/0")
        change(client, ground, "put circle", index=0, x=-0.5, y=0.05, radius=0.7)
        round_it = when(client, ground, lambda now: not now["outdated"])
        assert round_it["outcome"] == "arrival"
        assert round_it["seconds"] > straight["seconds"] + 0.3

        settings(client, ground, paused=False, speed=5.0)
        furthest = 0.0

        def passed(now: dict[str, Any]) -> bool:
            nonlocal furthest
            furthest = max(furthest, abs(now["robot"]["y"]) if abs(now["robot"]["x"] + 0.5) < 0.3 else 0.0)
            return bool(now["arrivals"] > straight["arrivals"])

        there = when(client, ground, passed)
        assert there["collisions"] == straight["collisions"]
        # The disc's edge is 0.65 m from the straight line on the nearer side, and the robot 0.1 m wide.
        assert furthest > 0.7


def test_a_paused_robot_makes_single_steps_and_can_be_pushed(client: TestClient, play_worker: None) -> None:
    ground = opened(client)
    with connect(client, f"/live/{ground['id']}/dark"):
        when(client, ground, lambda now: now["driving"])
        settings(client, ground, paused=True)
        change(client, ground, "put robot", x=0.0, y=0.0, heading=90.0)
        change(client, ground, "put target", x=0.0, y=3.0)
        now = when(client, ground, lambda now: now["robot"] == {"x": 0.0, "y": 0.0, "heading": 90.0, "radius": 0.0})
        began = now["sim_time"]
        change(client, ground, "step", count=5)
        stepped = when(client, ground, lambda now: now["sim_time"] > began)
        # Five control periods of 0.2 s; a picture is of how things stood when the last step began.
        assert math.isclose(stepped["sim_time"] - began, 1.0, abs_tol=1e-6)
        assert 0.05 < stepped["robot"]["y"] < 0.3

        change(client, ground, "put robot", x=0.0, y=0.0, heading=90.0)
        when(client, ground, lambda now: now["robot"]["y"] == 0.0)
        change(client, ground, "push", direction=90.0, distance=0.5)
        # To its left, which is west where it looks north.
        pushed = when(client, ground, lambda now: now["robot"]["x"] != 0.0)
        assert (pushed["robot"]["x"], pushed["robot"]["y"]) == (-0.5, 0.0)


def test_a_moment_becomes_an_arena_to_train_on(client: TestClient, play_worker: None) -> None:
    ground = opened(client)
    keep = f"/api/playgrounds/{ground['id']}/arena"
    assert client.post(keep, json={"name": "Mine"}).status_code == 422
    with connect(client, f"/live/{ground['id']}/light"):
        when(client, ground, lambda now: now["driving"])
        settings(client, ground, paused=True)
        change(client, ground, "put box", x=1.0, y=2.0, length=2.0, width=0.5, angle=30.0)
        change(client, ground, "put robot", x=-2.0, y=-1.0, heading=45.0)
        change(client, ground, "put target", x=3.0, y=0.5)
        when(client, ground, lambda now: now["robot"]["x"] == -2.0 and now["target"]["x"] == 3.0)
        config = client.post(keep, json={"name": "Mine"}).json()["config"]
    kept = client.get(f"/api/arenas/imported/{config['sha256']}").json()
    assert kept["title"] == "Mine"
    assert kept["geometry"]["boxes"] == [{"x": 1.0, "y": 2.0, "length": 2.0, "width": 0.5, "angle": 30.0}]
    assert kept["geometry"]["start"] == {"x": -2.0, "y": -1.0, "heading": 45.0}
    assert kept["geometry"]["target"] == {"x": 3.0, "y": 0.5}


def test_every_change_is_checked(client: TestClient) -> None:
    ground = opened(client)
    change(client, ground, "put circle", x=1.0, y=1.0, radius=0.5)
    assert "no room at (1, 1)" in refused(client, ground, "put robot", x=1.0, y=1.0, heading=0.0)
    assert "no room at (5, 0)" in refused(client, ground, "put target", x=5.0, y=0.0)
    assert "outside the walls" in refused(client, ground, "put box", x=5.5, y=0.0)
    assert "no obstacle number 2" in refused(client, ground, "put circle", index=1, x=0.0, y=0.0)
    assert "no obstacle number 1" in refused(client, ground, "remove", thing="box", index=0)
    assert "nobody number 1" in refused(client, ground, "put mover", index=0, x=0.0, y=0.0)
    assert "no mover number 1" in refused(client, ground, "choose", thing="mover", index=0)
    for wrong in ({"x": 1e9, "y": 0.0}, {"x": "a", "y": 0.0}, {"x": 0.0}, {"x": 0.0, "y": 0.0, "z": 0.0}):
        refused(client, ground, "put target", **wrong)
    refused(client, ground, "push", distance=50.0)
    refused(client, ground, "fly")
    assert client.get(f"/api/playgrounds/{ground['id']}").json()["geometry"]["circles"] == [
        {"x": 1.0, "y": 1.0, "radius": 0.5}
    ]
    assert change(client, ground, "remove", thing="circle", index=0)["geometry"]["circles"] == []


def test_only_so_many_obstacles_are_taken(client: TestClient, services: Services) -> None:
    ground = opened(client)
    for index in range(MAX_OBSTACLES):
        services.playgrounds.get(ground["id"]).change(PutCircle(x=0.01 * index, y=0.0, radius=0.1))
    assert "300 obstacles already" in refused(client, ground, "put circle", x=0.0, y=0.0)


def test_the_policys_own_arena_is_where_it_drives_unless_told_otherwise(client: TestClient) -> None:
    assert (
        len(opened(client, arena=None)["geometry"]["circles"]) + len(opened(client, arena=None)["geometry"]["boxes"]) == 17
    )
    maze = opened(client, arena={"name": "maze", "difficulty": 0.5})
    assert maze["geometry"]["boxes"]
    missing = {"policy": {"source": "shipped", "name": "nobody"}}
    assert client.post("/api/playgrounds", json=missing).status_code == 404


def test_a_playground_is_its_owners_alone(client: TestClient, services: Services) -> None:
    lab = Lab(services)
    ada, eve = (lab.browser(lab.person(name, {lab.project(name): "viewer"})) for name in ("ada", "eve"))
    asked = {"policy": {"source": "shipped", "name": "simple"}}
    nobody = TestClient(client.app, base_url=BASE_URL)
    ground = nobody.post("/api/playgrounds", json=asked, headers=ada).json()
    path = f"/api/playgrounds/{ground['id']}"

    def statuses(headers: dict[str, str]) -> list[int]:
        answers = [
            nobody.get(path, headers=headers),
            nobody.put(f"{path}/settings", json=ground["settings"], headers=headers),
            nobody.post(f"{path}/changes", json={"act": "push"}, headers=headers),
            nobody.get(f"/live/{ground['id']}/light/", headers=headers),
        ]
        return [answer.status_code for answer in answers]

    assert statuses(ada) == [200] * 4
    assert statuses(eve) == [404] * 4
    assert statuses({}) == [401] * 4
    # Whoever holds the owner's token may do everything, and yet it is not theirs.
    assert client.get(path).status_code == 404
    assert nobody.delete(path, headers=eve).status_code == 404
    assert nobody.delete(path, headers=ada).status_code == 204
    assert nobody.get(path, headers=ada).status_code == 404


def test_who_opens_many_loses_the_oldest(client: TestClient) -> None:
    grounds = [opened(client) for _ in range(MAX_EACH + 1)]
    found = [client.get(f"/api/playgrounds/{ground['id']}").status_code for ground in grounds]
    assert found == [404] + [200] * MAX_EACH


def test_the_bridge_lets_clicks_and_drags_through_to_playgrounds_alone() -> None:
    def passes(message: dict[str, Any], **other: Any) -> tuple[bool, bool]:
        data = msgspec.msgpack.encode({**message, **other})
        return may_pass(data, WATCH), may_pass(data, PLAY)

    assert passes(CAMERA) == (True, True)
    assert passes(CLICK) == (False, True)
    assert passes(DRAG) == (False, True)
    assert passes(CLICK, event_type="rect-select") == (False, False)
    assert passes(CLICK, ray_origin=(math.nan, 0.0, 0.0)) == (False, False)
    assert passes(CLICK, ray_direction="up") == (False, False)
    assert passes(DRAG, name="/world/robots") == (False, False)
    assert passes(DRAG, position=(math.inf, 0.0, 0.0)) == (False, False)
    assert passes(DRAG, position=(0.0, 0.0)) == (False, False)
    assert passes({"type": "GuiUpdateMessage", "uuid": "x", "updates": {}}) == (False, False)
    assert passes({"type": "ShareUrlRequest"}) == (False, False)


def test_the_bridge_lets_nothing_but_the_things_themselves_be_taken_hold_of() -> None:
    def passes(**other: Any) -> tuple[bool, bool]:
        data = msgspec.msgpack.encode({**GRAB, **other})
        return may_pass(data, WATCH), may_pass(data, PLAY)

    assert passes() == passes(name="/world/grab", phase="end") == (False, True)
    for wrong in (
        {"name": "/world/robots"},
        {"phase": "begin"},
        {"button": "right"},
        {"modifier": "shift"},
        {"instance_index": 3},
        {"end_position": (0.0, math.nan, 0.0)},
        {"more": 1},
    ):
        assert passes(**wrong) == (False, False), wrong


def test_a_thing_is_taken_hold_of_wherever_a_finger_meets_it(client: TestClient, play_worker: None) -> None:
    ground = opened(client)
    with connect(client, f"/live/{ground['id']}/light") as browser:
        when(client, ground, lambda now: now["driving"])
        settings(client, ground, paused=True)
        change(client, ground, "put robot", x=-3.0, y=-3.0, heading=0.0)
        change(client, ground, "put circle", x=2.0, y=2.0, radius=0.5)
        change(client, ground, "choose", thing="circle", index=0)
        browser.send_bytes(msgspec.msgpack.encode(CAMERA))
        receive_until(browser, b"/world/hold")

        def grab(phase: str, x: float, y: float) -> None:
            # Whatever the height at which it is met, what counts is the floor behind.
            said = {**GRAB, "phase": phase, "start_position": (2.4, 1.9, 0.0), "end_position": (x, y, 0.0)}
            browser.send_bytes(msgspec.msgpack.encode(said))

        grab("start", 2.4, 1.9)
        grab("update", 1.4, 1.4)
        # It goes as far as the hand, and does not jump under it.
        when(client, ground, lambda now: now["geometry"]["circles"] == [{"x": 1.0, "y": 1.5, "radius": 0.5}])
        grab("end", 1.4, 0.4)
        when(client, ground, lambda now: now["geometry"]["circles"] == [{"x": 1.0, "y": 0.5, "radius": 0.5}])
        # Let go, it stays.
        grab("update", 0.0, 0.0)
        time.sleep(0.5)
        assert when(client, ground, lambda now: now["driving"])["geometry"]["circles"][0]["x"] == 1.0


def moment(sim_time: float, x: float, *, reward: float = 0.0, outcome: int = 0, target: float = 3.0) -> Frame:
    return Frame(
        mode="policy",
        step=0,
        sim_time=sim_time,
        speed=1.0,
        poses=np.array([[x, 0.0, 0.0]], np.float32),
        targets=np.array([[target, 0.0]], np.float32),
        ranges=np.ones((1, 30), np.float32),
        fields_of_view=np.full(1, 360.0, np.float32),
        rewards=np.full(1, reward, np.float32),
        outcomes=np.full(1, outcome, np.uint8),
    )


def test_numbers_are_of_the_moment_that_the_picture_shows(client: TestClient, services: Services) -> None:
    ground = services.playgrounds.get(opened(client)["id"])
    period = ground.task.control_period
    values = tuple(float(10 - step) for step in range(11))
    seen = PlaySeen(revision=1, sim_time=5.0, value=10.0, values=values, outcome="arrival", seconds=10 * period)
    ground.take_frame(moment(5.0, 0.0))
    ground.take_seen(seen)
    # Nothing is shown yet: it is of the newest.
    assert (ground.view().sim_time, ground.view().value, ground.view().seconds) == (5.0, 10.0, 10 * period)
    for step in range(1, 5):
        ground.take_frame(moment(5.0 + step * period, 0.1 * step, reward=step, outcome=step // 4, target=3.0 - step // 4))
    ground.take_seen(
        seen.model_copy(update={"sim_time": 5.0 + 4 * period, "value": 77.0, "values": (77.0,), "seconds": 99.0})
    )
    # The picture is two steps behind what has come: so are all numbers, and what was foreseen is told for then.
    ground.shown(5.0 + 2 * period)
    shown = ground.shown_moment()
    assert shown.robot is not None
    assert shown.robot.x == 0.2
    assert (shown.reward, shown.arrivals, shown.value, shown.outdated) == (2.0, 0, 8.0, False)
    assert shown.seconds == pytest.approx(8 * period)
    assert Moment.model_validate(ground.view().model_dump(include=set(Moment.model_fields))) == shown
    ground.shown(5.0 + 4 * period)
    assert (ground.shown_moment().arrivals, ground.shown_moment().value) == (1, 77.0)
    # Behind its attempt what was foreseen is nothing new any more.
    ground.take_frame(moment(5.0 + 4 * period + 120.0, 0.0))
    ground.shown(5.0 + 4 * period + 120.0)
    assert (ground.shown_moment().seconds, ground.shown_moment().outdated) == (0.0, True)
    # Another worker begins anew.
    ground.take_frame(moment(0.1, 1.0))
    assert (ground.view().sim_time, ground.view().value, ground.view().outdated) == (0.1, None, True)


def test_the_picture_tells_its_page_the_moment(client: TestClient, play_worker: None) -> None:
    ground = opened(client)
    with (
        connect(client, f"/live/{ground['id']}/light"),
        connect(client, f"/live/{ground['id']}/light/display") as display,
    ):
        when(client, ground, lambda now: now["driving"])
        settings(client, ground, paused=True)
        asked = when(client, ground, lambda now: now["robot"] is not None and now["value"] is not None)
        while (said := display.receive_json())["moment"]["sim_time"] != asked["sim_time"]:
            asked = when(client, ground, lambda now: now["driving"])
        assert said["moment"]["robot"] == asked["robot"]


def test_a_click_puts_the_target_and_a_drag_moves_what_was_clicked(client: TestClient, play_worker: None) -> None:
    ground = opened(client)
    with connect(client, f"/live/{ground['id']}/light") as browser:
        when(client, ground, lambda now: now["driving"])
        settings(client, ground, paused=True)
        change(client, ground, "put circle", x=2.0, y=2.0, radius=0.5)
        change(client, ground, "put robot", x=-3.0, y=-3.0, heading=0.0)
        receive_until(browser, b"/world/circle/0")
        browser.send_bytes(msgspec.msgpack.encode(CAMERA))
        # Straight down on the floor, then on the disc.
        down = {**CLICK, "ray_direction": (0.0, 0.0, -1.0)}
        browser.send_bytes(msgspec.msgpack.encode({**down, "ray_origin": (-1.0, 1.5, 5.0)}))
        when(client, ground, lambda now: now["target"] == {"x": -1.0, "y": 1.5, "heading": 0.0, "radius": 0.0})
        browser.send_bytes(msgspec.msgpack.encode({**down, "ray_origin": (2.1, 2.1, 5.0)}))
        when(client, ground, lambda now: now["chosen"]["thing"] == "circle")

        def dragged(now: dict[str, Any]) -> bool:
            # As a hand does, again and again; the first ones may come before there are handles.
            browser.send_bytes(msgspec.msgpack.encode({**DRAG, "position": (0.5, -1.25, 0.05)}))
            return bool(now["geometry"]["circles"] == [{"x": 0.5, "y": -1.25, "radius": 0.5}])

        when(client, ground, dragged)

"""After a training its best policy drives in the live view, and so do the policies that ship."""

import asyncio
import os
import time
from collections.abc import AsyncIterator, Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from server.checkpoints.repository import CheckpointRepository
from server.live.drivers import PolicyDrivers
from server.live.hub import LiveHub
from server.live.view import LiveView
from server.services import Services
from tests.server.harness import Reports
from tests.server.job_worker import working
from tests.server.test_live import Asked, connect, make_frame, receive_until, refused
from workers.reporting import EvaluationResult
from workers.shipped.library import shipped_policy

POLICY = shipped_policy("complex")
RECORDED = POLICY.evaluation("complex-200")


def finished_run(reports: Reports, services: Services, evaluations: dict[int, EvaluationResult | None]) -> dict[str, Any]:
    """A completed run of the policy's training, its archive as the checkpoint of each of these steps."""
    experiment = reports.experiment(**POLICY.card.training.model_dump(mode="json"))
    run: dict[str, Any] = experiment["runs"][0]

    async def blocks() -> AsyncIterator[bytes]:
        yield POLICY.archive.read_bytes()

    for step, evaluation in evaluations.items():
        file = asyncio.run(services.files.write(os.urandom(8).hex(), blocks()))
        with services.database.write() as session:
            CheckpointRepository(session).add(run["id"], step, file, evaluation)
    reports.state(run, "completed")
    return run


def views(client: TestClient) -> list[str]:
    """States of the view jobs that there have been."""
    return [job["state"] for job in client.get("/api/jobs").json()["items"] if job["kind"] == "view"]


def wait_until(condition: Callable[[], bool], seconds: float = 30.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.05)


def live_score(client: TestClient, subject: str) -> dict[str, Any]:
    """What the display says once robots drive."""
    with connect(client, f"/live/{subject}/light") as browser, connect(client, f"/live/{subject}/light/display") as display:
        receive_until(browser, b"/world/arena/floor")
        score: dict[str, Any] = display.receive_json()
        while not (score["state"] == "live" and score["mode"]):
            assert score["after_training"] or score["state"] == "no worker"
            score = display.receive_json()
        receive_until(browser, b"/world/shells", b"batched_positions")
        return score


@pytest.fixture
def services(services: Services) -> Services:
    # Nothing in these tests comes back to a view that was left.
    services.drivers = PolicyDrivers(services.live, linger=0.0)
    return services


@pytest.fixture
def view_worker(client: TestClient, services: Services, tmp_path: Path) -> Iterator[None]:
    with working(client, services, tmp_path / "work", kinds=("view",)):
        yield


def test_the_best_policy_of_a_finished_run_drives(
    client: TestClient, services: Services, reports: Reports, view_worker: None
) -> None:
    run = finished_run(reports, services, {4096: RECORDED, 8192: None})
    score = live_score(client, run["id"])
    # The step is the archive's own.
    assert (score["mode"], score["after_training"], score["step"]) == ("policy", True, POLICY.card.step)
    assert len(score["robots"]) == 8
    assert client.get(f"/api/runs/{run['id']}/live").json()["status"]["receiving"]
    wait_until(lambda: views(client) == ["cancelled"])


def test_any_checkpoint_of_a_run_drives_while_others_train(
    client: TestClient, services: Services, reports: Reports, view_worker: None
) -> None:
    run = finished_run(reports, services, {4096: RECORDED, 8192: None})
    reports.state(run, "running")
    way = client.get(f"/api/runs/{run['id']}/checkpoints/steps").json()
    arrived = sum(episode.outcome == "arrival" for episode in RECORDED.episodes) / len(RECORDED.episodes)
    assert [(each["step"], each["success"]) for each in way["items"]] == [(4096, arrived), (8192, None)]
    first = way["items"][0]["id"]
    wanted = client.get(f"/api/checkpoints/{first}/live").json() | {"robots": 2}
    del wanted["status"]
    assert client.put(f"/api/checkpoints/{first}/live", json=wanted).json()["robots"] == 2
    score = live_score(client, f"checkpoint-{first}")
    assert (score["checkpoint"], len(score["robots"])) == (True, 2)
    # What others watch of the run is as it was.
    assert client.get(f"/api/runs/{run['id']}/live").json()["robots"] == 8
    assert client.get("/live/checkpoint-nothing/light/").status_code == 404


def test_who_slides_along_the_checkpoints_takes_no_place_twice(
    client: TestClient, services: Services, reports: Reports, view_worker: None
) -> None:
    services.drivers = PolicyDrivers(services.live, capacity=1, linger=60.0)
    run = finished_run(reports, services, {4096: RECORDED, 8192: None})
    for each in client.get(f"/api/runs/{run['id']}/checkpoints/steps").json()["items"]:
        assert live_score(client, f"checkpoint-{each['id']}")["checkpoint"]


def test_a_policy_that_ships_drives(client: TestClient, services: Services, view_worker: None) -> None:
    wanted = client.get("/api/policies/simple/live").json() | {"robots": 3}
    del wanted["status"]
    assert client.put("/api/policies/simple/live", json=wanted).json()["robots"] == 3
    score = live_score(client, "policy-simple")
    assert (score["after_training"], len(score["robots"])) == (True, 3)
    page = client.get("/live/policy-simple/?darkMode")
    assert page.url.path == "/live/policy-simple/dark/"
    wait_until(lambda: views(client) == ["cancelled"])


def test_there_is_no_view_of_other_policies(client: TestClient) -> None:
    assert client.get("/api/policies/nobody/live").status_code == 404
    assert client.put("/api/policies/nobody/live", json={}).status_code == 404
    assert client.get("/live/policy-nobody/light/").status_code == 404
    assert refused(client, "/live/policy-nobody/light")


@pytest.mark.parametrize("state", ["queued", "running", "stopping"])
def test_a_run_that_goes_on_is_its_workers(client: TestClient, services: Services, reports: Reports, state: str) -> None:
    run = finished_run(reports, services, {4096: RECORDED})
    reports.state(run, state)  # type: ignore[arg-type]
    with connect(client, f"/live/{run['id']}/light") as browser:
        receive_until(browser, b"/world/arena/floor")
        assert views(client) == []


def test_a_finished_run_without_a_checkpoint_has_nothing_to_drive(
    client: TestClient, services: Services, reports: Reports
) -> None:
    run = finished_run(reports, services, {})
    with connect(client, f"/live/{run['id']}/light") as browser:
        receive_until(browser, b"/world/arena/floor")
        assert views(client) == []


def test_a_linked_worker_is_shown_instead() -> None:
    async def scenario() -> None:
        shown: list[int] = []

        class Screen:
            port = 1

            def show(self, frame: Any) -> None:
                shown.append(frame.step)

            def apply(self, *_: object) -> None: ...

            def close(self) -> None: ...

        hub = LiveHub(lambda *_: Screen(), linger=0.0)  # type: ignore[arg-type]
        worker, driver = Asked(), Asked()
        detach_driver = hub.attach_driver("run", driver.tell)
        async with hub.watch("run", POLICY.card.training.task):
            assert driver.newest() is not None
            hub.driven_frames("run", make_frame(1).encode())
            detach_worker = hub.attach("run", worker.tell)
            hub.driven_frames("run", make_frame(2).encode())
            hub.frames("run", make_frame(3).encode())
            detach_worker()
            hub.driven_frames("run", make_frame(4).encode())
            detach_driver()
            assert not hub.status("run").connected
        assert shown == [4097, 4099, 4100]
        await hub.close()

    asyncio.run(scenario())


def test_who_finds_no_place_reads_why_in_the_picture(client: TestClient, services: Services) -> None:
    services.drivers = PolicyDrivers(services.live, capacity=0)
    assert refused(client, "/live/policy-simple/light")
    with connect(client, "/live/policy-simple/light/display") as display:
        assert "Close one of their pages" in display.receive_json()["refusal"]
    services.live = LiveHub(LiveView, capacity=0)
    services.drivers = PolicyDrivers(services.live)
    with connect(client, "/live/policy-simple/light/display") as display:
        assert "live views are open already" in display.receive_json()["refusal"]


def test_only_so_many_drive_at_the_same_time(client: TestClient, services: Services) -> None:
    services.drivers = PolicyDrivers(services.live, capacity=1, linger=0.0)
    with connect(client, "/live/policy-simple/light"), connect(client, "/live/policy-simple/dark"):
        wait_until(lambda: views(client) == ["queued"])
        assert refused(client, "/live/policy-complex/light")
    wait_until(lambda: views(client) == ["cancelled"])


def test_without_a_worker_the_picture_says_so(client: TestClient, services: Services) -> None:
    with connect(client, "/live/policy-simple/light"), connect(client, "/live/policy-simple/light/display") as display:
        while "No worker is there" not in (display.receive_json()["refusal"] or ""):
            pass

"""One seed's training over HTTP: its figures, its log, stop and resume."""

from typing import Any

import pytest
from fastapi.testclient import TestClient

from server.services import Services
from tests.server.harness import Reports


def shown(client: TestClient, run: dict[str, Any]) -> dict[str, Any]:
    """The run as the API shows it now."""
    response = client.get(f"/api/runs/{run['id']}")
    assert response.status_code == 200
    found: dict[str, Any] = response.json()
    return found


def test_a_run_with_what_it_trains(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment("Corridor", seeds=(7,), steps=5_000)

    run = shown(client, experiment["runs"][0])

    assert run["experiment_name"] == "Corridor"
    assert run["training"] == experiment["training"]
    assert {name: run[name] for name in experiment["runs"][0]} == experiment["runs"][0]


def test_a_running_run_says_how_quick_it_is_and_how_long_it_takes(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment(steps=10_000)
    run = experiment["runs"][0]
    reports.metrics(run, "time/steps_per_second", {1_000: 400.0, 2_000: 500.0})
    reports.metrics(run, "train/success_rate", {2_000: 0.75})
    reports.metrics(run, "eval/success_rate", {2_000: 0.5})
    reports.state(run, "running", step=4_000, attempt=1, worker="lab-1")

    running = shown(client, run)
    assert (running["steps_per_second"], running["seconds_left"]) == (500.0, 12.0)
    assert (running["success_rate"], running["eval_success_rate"]) == (0.75, 0.5)
    assert (running["worker"], running["attempt"]) == ("lab-1", 1)
    # The list shows the same.
    assert client.get("/api/experiments").json()["items"][0]["seconds_left"] == 12.0

    reports.state(run, "stopped")
    stopped = shown(client, run)
    assert (stopped["steps_per_second"], stopped["seconds_left"]) == (None, None)
    assert stopped["eval_success_rate"] == 0.5


def test_stop_and_resume_are_written_in_the_log(client: TestClient, reports: Reports) -> None:
    run = reports.experiment()["runs"][0]

    assert client.post(f"/api/runs/{run['id']}/stop").json()["state"] == "stopped"
    assert client.post(f"/api/runs/{run['id']}/resume").json()["state"] == "queued"
    reports.state(run, "running", step=300)
    assert client.post(f"/api/runs/{run['id']}/stop").json()["state"] == "stopping"
    assert client.post(f"/api/runs/{run['id']}/stop").json()["state"] == "stopping"

    events = client.get(f"/api/runs/{run['id']}/events").json()
    assert [(event["step"], event["level"], event["message"]) for event in events] == [
        (0, "info", "Stopped before a worker took it up."),
        (0, "info", "Resume requested."),
        (300, "info", "Stop requested."),
    ]
    assert [event["id"] for event in events] == sorted(event["id"] for event in events)


@pytest.mark.parametrize(
    ("state", "action"),
    [("completed", "stop"), ("completed", "resume"), ("running", "resume"), ("queued", "resume"), ("failed", "stop")],
)
def test_what_makes_no_sense_in_a_state(client: TestClient, reports: Reports, state: Any, action: str) -> None:
    run = reports.experiment()["runs"][0]
    reports.state(run, state)

    response = client.post(f"/api/runs/{run['id']}/{action}")

    assert response.status_code == 409
    assert f"A run that is {state} can't {action}" in response.json()["detail"]
    assert shown(client, run)["state"] == state


@pytest.mark.parametrize(
    ("method", "path"), [("GET", ""), ("GET", "/events"), ("GET", "/checkpoints"), ("POST", "/stop"), ("POST", "/resume")]
)
def test_a_run_that_is_not_there(client: TestClient, method: str, path: str) -> None:
    response = client.request(method, f"/api/runs/nobody{path}")

    assert response.status_code == 404
    assert response.json() == {"detail": "There is no run nobody; it may have been deleted."}


def test_the_service_at_a_glance(client: TestClient, reports: Reports, services: Services) -> None:
    runs = reports.experiment(seeds=(0, 1, 2))["runs"]
    reports.state(runs[0], "running", worker="lab-1")
    reports.state(runs[1], "stopping", worker="gone")
    reports.heard_of("lab-1", seconds_ago=2.0)
    reports.heard_of("lab-2", seconds_ago=2.0)
    reports.heard_of("gone", seconds_ago=3_600.0)

    status = client.get("/api/status").json()

    assert (status["queued"], status["running"]) == (1, 2)
    assert [(worker["name"], worker["run_id"]) for worker in status["workers"]] == [
        ("lab-1", runs[0]["id"]),
        ("lab-2", None),
    ]
    version = client.get("/api/version").json()
    assert version == {"version": status["version"], "commit": status["commit"]}
    assert version["version"]

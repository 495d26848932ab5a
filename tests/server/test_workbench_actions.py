"""What is done to several trainings at once; tags, stars, notes, archive, trash, seeds, views."""

import time
from typing import Any

import pytest
from fastapi.testclient import TestClient

from server.database import tables
from server.services import Services
from server.workbench.trash import empty_trash
from tests.server.harness import Reports


def act(client: TestClient, action: str, *experiments: dict[str, Any], **more: Any) -> dict[str, Any]:
    ids = [experiment["id"] for experiment in experiments]
    response = client.post("/api/workbench/actions", json={"action": action, "experiments": ids, **more})
    assert response.status_code == 200, response.text
    answer: dict[str, Any] = response.json()
    return answer


def names(client: TestClient, **parameters: Any) -> list[str]:
    return [one["name"] for one in client.get("/api/experiments", params=parameters).json()["items"]]


def test_tags_stars_and_notes(client: TestClient, reports: Reports) -> None:
    one, two = reports.experiment("One"), reports.experiment("Two")

    act(client, "tag", one, two, tag=" baseline ")
    act(client, "tag", one, tag="baseline")
    act(client, "star", two)
    client.put(f"/api/experiments/{one['id']}/notes", json={"notes": "# Why\n<script>alert(1)</script>"})

    assert names(client, query="tag = baseline") == ["Two", "One"]
    assert names(client, query="starred = yes") == ["Two"]
    assert client.get(f"/api/experiments/{one['id']}/marks").json() == {
        "tags": ["baseline"],
        "starred": False,
        "archived": False,
        "notes": "# Why\n<script>alert(1)</script>",
    }
    act(client, "untag", one, tag="baseline")
    act(client, "unstar", two)
    assert names(client, query="tag = baseline") == ["Two"]
    assert names(client, query="starred = yes") == []


@pytest.mark.parametrize(
    "body",
    [
        {"action": "star", "experiments": []},
        {"action": "shake", "experiments": ["a"]},
        {"action": "tag", "experiments": ["a"], "tag": "x" * 41},
        {"action": "tag", "experiments": ["a"], "tag": "two\nlines"},
        {"action": "star", "experiments": ["a"] * 1_001},
    ],
)
def test_an_action_that_cannot_be_is_refused(client: TestClient, body: dict[str, Any]) -> None:
    assert client.post("/api/workbench/actions", json=body).status_code == 422


def test_a_tag_belongs_to_two_actions(client: TestClient) -> None:
    assert client.post("/api/workbench/actions", json={"action": "tag", "experiments": ["a"]}).status_code == 409
    body = {"action": "star", "experiments": ["a"], "tag": "x"}
    assert client.post("/api/workbench/actions", json=body).status_code == 409


def test_what_an_action_cannot_be_done_to_is_left_out_with_the_reason(client: TestClient, reports: Reports) -> None:
    running, ended = reports.experiment("Running"), reports.experiment("Ended")
    reports.state(running["runs"][0], "running")
    reports.state(ended["runs"][0], "completed")

    done = act(client, "stop", running, ended, {"id": "nobody"})

    assert done["done"] == [running["id"]]
    assert [left["id"] for left in done["left_out"]] == [ended["id"], "nobody"]
    assert "ended already" in done["left_out"][0]["reason"]


def test_only_failed_runs_are_repeated(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment("Mixed", (0, 1, 2))
    for run, state in zip(experiment["runs"], ("failed", "stopped", "completed"), strict=True):
        reports.state(run, state)  # type: ignore[arg-type]

    act(client, "repeat", experiment)

    runs = client.get(f"/api/experiments/{experiment['id']}").json()["runs"]
    assert [run["state"] for run in runs] == ["queued", "stopped", "completed"]


def test_more_seeds_are_queued(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment("Few", (0, 1))
    path = f"/api/experiments/{experiment['id']}"

    assert client.post(f"{path}/seeds", json={"seeds": [1, 5, 3]}).status_code == 204

    runs = client.get(path).json()["runs"]
    assert [(run["seed"], run["state"]) for run in runs] == [(seed, "queued") for seed in (0, 1, 3, 5)]
    assert client.post(f"{path}/seeds", json={"seeds": [1, 5]}).status_code == 409
    assert client.post(f"{path}/seeds", json={"seeds": [-1]}).status_code == 422


def test_the_archive_is_out_of_the_way(client: TestClient, reports: Reports) -> None:
    old, new = reports.experiment("Old"), reports.experiment("New")

    act(client, "archive", old)

    assert names(client) == ["New"]
    assert names(client, place="archived") == ["Old"]
    assert client.get(f"/api/experiments/{old['id']}").status_code == 200
    act(client, "unarchive", old, new)
    assert names(client) == ["New", "Old"]


def test_what_was_deleted_can_be_taken_back_for_a_week_and_is_then_gone_with_its_files(
    client: TestClient, reports: Reports, services: Services
) -> None:
    experiment = reports.experiment("Mistake")
    run = experiment["runs"][0]
    checkpoint = reports.checkpoint(run, 100, reports.evaluation(5))
    path = f"/api/experiments/{experiment['id']}"

    act(client, "delete", experiment)
    assert client.get(path).status_code == 404
    assert client.get(f"/api/runs/{run['id']}").status_code == 404
    assert (names(client), names(client, place="trash")) == ([], ["Mistake"])
    # What lies there is not deleted, stopped or tagged again.
    assert act(client, "delete", experiment)["done"] == []

    act(client, "restore", experiment)
    assert client.get(path).json()["runs"][0]["state"] == "stopped"
    assert act(client, "remove", experiment)["done"] == []

    act(client, "delete", experiment)
    assert empty_trash(services, time.time() + 6.9 * 86_400) == 0
    assert empty_trash(services, time.time() + 7.1 * 86_400) == 1
    assert names(client, place="trash") == []
    with services.database.read() as session:
        assert session.get(tables.Checkpoint, checkpoint) is None
        assert session.query(tables.ExperimentKey).count() == 0
    assert act(client, "restore", experiment)["done"] == []


def test_views_are_kept_under_a_name(client: TestClient) -> None:
    client.put("/api/workbench/views", json={"name": "Best", "address": "q=success+%3E+0.9"})
    saved = client.put("/api/workbench/views", json={"name": "Best", "address": "q=success+%3E+0.95"}).json()["items"]
    assert [(view["name"], view["address"]) for view in saved] == [("Best", "q=success+%3E+0.95")]
    assert client.delete(f"/api/workbench/views/{saved[0]['id']}").status_code == 204
    assert client.get("/api/workbench/views").json() == {"items": []}
    assert client.delete("/api/workbench/views/nobody").status_code == 404

"""Checkpoints over HTTP: listed with what they achieve, the best marked, downloaded, and gone with their experiment."""

import hashlib
from typing import Any

import pytest
from fastapi.testclient import TestClient

from server.services import Services
from tests.server.harness import Reports
from workers.statistics.seeds import success_rate


def test_checkpoints_are_listed_with_what_they_achieve(client: TestClient, reports: Reports) -> None:
    run = reports.experiment()["runs"][0]
    reports.checkpoint(run, 2_000, None)
    reports.checkpoint(run, 1_000, reports.evaluation(arrivals=4, steps=120))

    second, first = client.get(f"/api/runs/{run['id']}/checkpoints").json()["items"]

    assert (first["step"], second["step"]) == (1_000, 2_000)
    assert second["evaluation"] is None
    assert second["size"] == len("archive of step 2000")
    assert second["sha256"] == hashlib.sha256(b"archive of step 2000").hexdigest()
    interval = success_rate([4], [10])
    assert first["evaluation"] == {
        "suite": "simple-200",
        "suite_hash": "hash-a",
        "episodes": 10,
        "arrivals": 4,
        "success": {
            "value": 0.4,
            "low": interval.low,
            "high": interval.high,
            "unit": "episodes",
            "seeds": 1,
            "episodes": 10,
            "per_seed": [0.4],
            "failed": {
                "failed": 0,
                "seeds": 1,
                "at_most": pytest.approx(0.95),
                "sentence": "One seed alone: of others up to 95 % may fail (one-sided 95 %).",
                "told": True,
            },
        },
        # Of the four that arrived; the six collisions would make a bad policy look quick.
        "steps_mean": 120.0,
        "reward_mean": -20.0,
    }


def test_the_best_arrives_most_often_and_of_equal_ones_soonest(client: TestClient, reports: Reports) -> None:
    run = reports.experiment()["runs"][0]
    reports.checkpoint(run, 1_000, reports.evaluation(arrivals=9, steps=70))
    reports.checkpoint(run, 2_000, reports.evaluation(arrivals=10, steps=90))
    reports.checkpoint(run, 3_000, reports.evaluation(arrivals=10, steps=80))
    reports.checkpoint(run, 4_000, reports.evaluation(arrivals=0))
    reports.checkpoint(run, 5_000, None)

    page = client.get(f"/api/runs/{run['id']}/checkpoints").json()

    assert [checkpoint["step"] for checkpoint in page["items"] if checkpoint["best"]] == [3_000]
    assert (page["best"]["step"], page["best"]["best"]) == (3_000, True)
    assert page["items"][1]["evaluation"]["steps_mean"] is None


def test_of_policies_that_never_arrive_the_newest_is_best(client: TestClient, reports: Reports) -> None:
    run = reports.experiment()["runs"][0]
    for step in (1_000, 2_000):
        reports.checkpoint(run, step, reports.evaluation(arrivals=0))
    assert client.get(f"/api/runs/{run['id']}/checkpoints").json()["best"]["step"] == 2_000


def test_many_checkpoints_come_in_pages_and_the_best_with_each(client: TestClient, reports: Reports) -> None:
    run = reports.experiment()["runs"][0]
    for step in range(1, 61):
        reports.checkpoint(run, step, reports.evaluation(arrivals=10 if step == 7 else 5))

    def page(**parameters: int) -> dict[str, Any]:
        response = client.get(f"/api/runs/{run['id']}/checkpoints", params=parameters)
        assert response.status_code == 200, response.text
        answer: dict[str, Any] = response.json()
        assert answer["best"]["step"] == 7
        return answer

    assert [one["step"] for one in page()["items"]] == list(range(60, 10, -1))
    assert [one["step"] for one in page(limit=4, offset=52)["items"]] == [8, 7, 6, 5]
    assert page(limit=4, offset=100)["items"] == []
    assert page(limit=1)["total"] == 60
    # The one in a page's address may lie on any page.
    assert [(one["step"], one["best"]) for one in page(step=7)["items"]] == [(7, True)]
    assert (page(step=99)["items"], page(step=99)["total"]) == ([], 0)
    assert client.get(f"/api/runs/{run['id']}/checkpoints", params={"limit": 201}).status_code == 422


def test_the_success_of_an_experiment_is_that_of_its_last_checkpoints(client: TestClient, reports: Reports) -> None:
    experiment = reports.experiment(seeds=(0, 1, 2))
    # The best one is not what training ended with: to take it would be to choose by the test.
    reports.checkpoint(experiment["runs"][0], 1_000, reports.evaluation(arrivals=10))
    reports.checkpoint(experiment["runs"][0], 2_000, reports.evaluation(arrivals=8))
    reports.checkpoint(experiment["runs"][0], 2_500, None)
    reports.checkpoint(experiment["runs"][1], 2_000, reports.evaluation(arrivals=7))

    success = client.get(f"/api/experiments/{experiment['id']}").json()["success"]

    interval = success_rate([8, 7], [10, 10])
    assert (success["value"], success["low"], success["high"]) == (0.75, interval.low, interval.high)
    assert (success["unit"], success["seeds"], success["episodes"]) == ("seeds", 2, 20)
    assert success["per_seed"] == [0.8, 0.7]
    # 1 - 0.05 ** (1 / 2).
    assert success["failed"]["sentence"] == "None of 2 seeds failed: up to 78 % may (one-sided 95 %)."


def test_every_episode_behind_a_figure_can_be_read(client: TestClient, reports: Reports) -> None:
    run = reports.experiment()["runs"][0]
    evaluation = reports.evaluation(arrivals=4)
    identifier = reports.checkpoint(run, 1_000, evaluation)

    episodes = client.get(f"/api/checkpoints/{identifier}/episodes").json()

    assert episodes == {"checkpoint_id": identifier} | evaluation.model_dump(mode="json")


def test_the_download_has_a_name_that_every_file_system_takes(client: TestClient, reports: Reports) -> None:
    run = reports.experiment('../Élan "50%"\r\n', seeds=(7,))["runs"][0]
    identifier = reports.checkpoint(run, 1_000, None)

    response = client.get(f"/api/checkpoints/{identifier}/download")

    assert response.status_code == 200
    assert response.content == b"archive of step 1000"
    assert response.headers["content-type"] == "application/zip"
    assert response.headers["content-length"] == "20"
    assert response.headers["content-disposition"] == 'attachment; filename="mapless-elan-50-seed7-step1000.zip"'


def test_a_name_without_a_usable_letter(client: TestClient, reports: Reports) -> None:
    identifier = reports.checkpoint(reports.experiment("迷宮")["runs"][0], 5, None)

    disposition = client.get(f"/api/checkpoints/{identifier}/download").headers["content-disposition"]
    assert disposition == 'attachment; filename="mapless-experiment-seed0-step5.zip"'


@pytest.mark.parametrize("path", ["nobody/download", "nobody/episodes", "..%2fdata/download"])
def test_a_checkpoint_that_is_not_there(client: TestClient, path: str) -> None:
    assert client.get(f"/api/checkpoints/{path}").status_code == 404


def test_a_checkpoint_that_was_not_evaluated_has_no_episodes(client: TestClient, reports: Reports) -> None:
    identifier = reports.checkpoint(reports.experiment()["runs"][0], 5, None)

    response = client.get(f"/api/checkpoints/{identifier}/episodes")
    assert response.status_code == 404
    assert "has not been evaluated" in response.json()["detail"]


def test_files_go_with_their_experiment(client: TestClient, reports: Reports, services: Services) -> None:
    gone, stays = reports.experiment(seeds=(0, 1)), reports.experiment()
    for run in gone["runs"]:
        reports.checkpoint(run, 5, reports.evaluation(arrivals=1))
    kept = reports.checkpoint(stays["runs"][0], 5, None)

    assert client.delete(f"/api/experiments/{gone['id']}").status_code == 204
    assert len(services.files.ids()) == 3  # in the trash nothing is lost
    removal = {"action": "remove", "experiments": [gone["id"]]}
    assert client.post("/api/workbench/actions", json=removal).json()["done"] == [gone["id"]]

    assert services.files.ids() == {kept}


def test_a_file_that_is_gone_from_the_store_is_said_so(client: TestClient, reports: Reports, services: Services) -> None:
    identifier = reports.checkpoint(reports.experiment()["runs"][0], 5, None)
    services.files.delete(identifier)

    response = client.get(f"/api/checkpoints/{identifier}/download")
    assert response.status_code == 404
    assert "gone from the store" in response.json()["detail"]

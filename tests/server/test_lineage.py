"""Trainings that begin with a policy: what may be launched, what the worker is handed, and who sees where it comes from."""

import hashlib
import time
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient
from httpx import Response

from server.checkpoints.archives import sweep_archives
from server.database import tables
from server.experiments.service import ExperimentService
from server.services import Services
from server.settings import Settings
from tests.server.harness import TOKEN, WORKER_TOKEN, Reports
from tests.server.people import Lab, launch
from workers.shipped.library import shipped_policy

HOURS = 3 * 3_600.0


@pytest.fixture
def settings(settings: Settings, database_url: str) -> Settings:
    """On both kinds of database."""
    return settings.model_copy(update={"database_url": database_url})


def fine_tune(client: TestClient, checkpoint_id: str, *, source: str = "checkpoint", **training: object) -> Response:
    start = {"source": source, "name": checkpoint_id}
    response: Response = client.post(
        "/api/experiments", json={"name": "Finer", "training": {"start_from": start, **training}}
    )
    return response


def refusal(response: Response) -> str:
    assert response.status_code == 422, response.text
    (problem,) = response.json()["detail"]
    assert problem["loc"] == ["body", "training", "start_from"]
    message: str = problem["msg"]
    return message


@pytest.fixture
def parent(reports: Reports) -> dict[str, Any]:
    return reports.experiment("Corridor", seeds=(3,))


@pytest.fixture
def checkpoint(reports: Reports, parent: dict[str, Any]) -> str:
    return reports.checkpoint(parent["runs"][0], 50_000, reports.evaluation(8))


def claim(client: TestClient, run_id: str, token: str = WORKER_TOKEN) -> Response:
    body = {"worker": "w", "published_attempt": 0}
    headers = {"Authorization": f"Bearer {token}"}
    response: Response = client.post(f"/api/worker/runs/{run_id}/claim", json=body, headers=headers)
    return response


def start_archive(client: TestClient, run_id: str, headers: dict[str, str] | None = None) -> Response:
    headers = headers or {"Authorization": f"Bearer {WORKER_TOKEN}"}
    response: Response = client.get(f"/api/worker/runs/{run_id}/start", headers=headers)
    return response


def stored(services: Services) -> set[str]:
    return {path.stem for path in Path(services.settings.resolved_files_url).iterdir()}


def test_hash_and_title_are_written_down_at_launch(client: TestClient, checkpoint: str) -> None:
    child = fine_tune(client, checkpoint).json()
    assert child["training"]["start_from"] == {
        "source": "checkpoint",
        "name": checkpoint,
        "sha256": hashlib.sha256(b"archive of step 50000").hexdigest(),
        "title": "Corridor, seed 3, step 50\u202f000",
    }


def test_the_worker_is_handed_the_archive_until_there_is_a_checkpoint_of_its_own(
    client: TestClient, reports: Reports, checkpoint: str
) -> None:
    run = fine_tune(client, checkpoint).json()["runs"][0]
    assert start_archive(client, run["id"]).status_code == 404  # not before it is claimed
    granted = claim(client, run["id"]).json()
    assert (granted["checkpoint"], granted["start"]) == (None, hashlib.sha256(b"archive of step 50000").hexdigest())
    assert start_archive(client, run["id"]).content == b"archive of step 50000"

    own = reports.checkpoint(run, 0, reports.evaluation(8))
    reports.state(run, "queued", attempt=0, claim_id=None)
    granted = claim(client, run["id"]).json()
    assert (granted["checkpoint"]["id"], granted["start"]) == (own, None)


def test_a_worker_gets_what_its_own_runs_begin_with_only(
    client: TestClient, services: Services, checkpoint: str, parent: dict[str, Any]
) -> None:
    run = fine_tune(client, checkpoint).json()["runs"][0]
    claim(client, run["id"])
    assert start_archive(client, run["id"], Lab(services).worker_token("another")).status_code == 404
    claim(client, parent["runs"][0]["id"])
    assert start_archive(client, parent["runs"][0]["id"]).status_code == 404  # begins with fresh weights


def test_a_shipped_policy(client: TestClient) -> None:
    shipped = shipped_policy("simple")
    training = shipped.card.training.model_dump(mode="json")
    child = fine_tune(client, "simple", source="shipped", **{k: training[k] for k in ("task", "algorithm")}).json()
    assert child["training"]["start_from"]["title"] == shipped.card.title
    run = child["runs"][0]["id"]
    archive = shipped.archive.read_bytes()
    assert claim(client, run).json()["start"] == hashlib.sha256(archive).hexdigest()
    assert start_archive(client, run).content == archive
    lineage = client.get(f"/api/runs/{run}/lineage").json()
    assert lineage["parent"]["state"] == "there"


def test_what_does_not_fit_says_in_what(client: TestClient, checkpoint: str) -> None:
    network = {"name": "mlp", "hidden_sizes": [32]}
    other = fine_tune(client, checkpoint, algorithm={"name": "ppo", "network": network}, task={"observation": "paper"})
    message = refusal(other)
    assert "Corridor, seed 3, step 50\u202f000 does not fit: its observation is improved of" in message
    assert "its network is mlp (hidden_sizes [64, 64], activation relu), and this one's mlp (hidden_sizes [32]," in message


def test_what_is_not_there_is_refused_at_the_field(
    client: TestClient, reports: Reports, services: Services, checkpoint: str, parent: dict[str, Any]
) -> None:
    assert "There is no checkpoint nowhere" in refusal(fine_tune(client, "nowhere"))
    assert "There is no shipped policy nobody" in refusal(fine_tune(client, "nobody", source="shipped"))
    assert "A file on another machine" in refusal(fine_tune(client, "policy.zip", source="file"))
    meant = {"source": "checkpoint", "name": checkpoint, "sha256": "0" * 64}
    other = client.post("/api/experiments", json={"name": "x", "training": {"start_from": meant}})
    assert "is not what it was" in refusal(other)
    with services.database.write() as session:
        session.get_one(tables.Checkpoint, checkpoint).damaged_at = 1.0
    assert "is damaged" in refusal(fine_tune(client, checkpoint))
    lost = reports.checkpoint(parent["runs"][0], 60_000, None)
    services.files.delete(lost)
    assert "is gone" in refusal(fine_tune(client, lost))


def test_who_may_not_see_a_run_may_not_begin_with_it_either(
    client: TestClient, services: Services, reports: Reports
) -> None:
    lab = Lab(services)
    here, elsewhere = lab.project("Here"), lab.project("Elsewhere")
    secret = launch(client, here, "Secret")
    checkpoint = reports.checkpoint(secret["runs"][0], 1_000, reports.evaluation(8))
    del client.headers["Authorization"]
    body = {"name": "x", "training": {"start_from": {"source": "checkpoint", "name": checkpoint}}}
    foreign = lab.browser(lab.person("foreigner", {elsewhere: "editor"}))
    refused = client.post("/api/experiments", json=body | {"project_id": elsewhere}, headers=foreign)
    assert "There is no checkpoint" in refusal(refused)
    assert client.get("/api/training/starts?search=secret", headers=foreign).json() == []

    both = lab.browser(lab.person("member", {here: "viewer", elsewhere: "editor"}))
    assert client.get("/api/training/starts?search=secret", headers=both).json()[0]["start_from"]["name"] == checkpoint
    child = client.post("/api/experiments", json=body | {"project_id": elsewhere}, headers=both).json()
    assert child["training"]["start_from"]["name"] == checkpoint
    assert client.get(f"/api/experiments/{child['id']}/lineage", headers=foreign).json()["parent"]["state"] == "hidden"
    owner = {"Authorization": f"Bearer {TOKEN}"}
    assert len(client.get(f"/api/experiments/{secret['id']}/lineage", headers=owner).json()["children"]) == 1
    only_here = lab.browser(lab.person("insider", {here: "viewer"}))
    assert client.get(f"/api/experiments/{secret['id']}/lineage", headers=only_here).json()["children"] == []


def test_parent_and_children_find_one_another(
    client: TestClient, reports: Reports, parent: dict[str, Any], checkpoint: str
) -> None:
    child = fine_tune(client, checkpoint).json()
    lineage = client.get(f"/api/experiments/{child['id']}/lineage").json()
    assert lineage["parent"] == {
        "start_from": child["training"]["start_from"],
        "state": "there",
        "run_id": parent["runs"][0]["id"],
        "step": 50_000,
    }
    assert lineage["children"] == []
    for path in (f"experiments/{parent['id']}", f"runs/{parent['runs'][0]['id']}"):
        came_of_it = client.get(f"/api/{path}/lineage").json()
        assert came_of_it["parent"] is None
        assert came_of_it["children"] == [{"id": child["id"], "name": "Finer", "seed": 3, "step": 50_000}]


def test_a_child_outlives_its_parent_from_the_first_moment_on(
    client: TestClient, services: Services, parent: dict[str, Any], checkpoint: str, reports: Reports
) -> None:
    unused = reports.checkpoint(parent["runs"][0], 10_000, None)
    child = fine_tune(client, checkpoint).json()
    run = child["runs"][0]["id"]
    ExperimentService(services).delete(parent["id"])
    assert client.get(f"/api/runs/{run}/lineage").json()["parent"]["state"] == "gone"  # it lies in the trash
    ExperimentService(services).remove(parent["id"])
    assert unused not in stored(services)
    sweep_archives(services, time.time() + HOURS)
    lineage = client.get(f"/api/runs/{run}/lineage").json()
    assert (lineage["parent"]["state"], lineage["parent"]["start_from"]["title"]) == (
        "gone",
        "Corridor, seed 3, step 50\u202f000",
    )
    claim(client, run)
    assert start_archive(client, run).content == b"archive of step 50000"

    ExperimentService(services).delete(child["id"])
    sweep_archives(services, time.time() + HOURS)
    assert checkpoint in stored(services)  # the child may be taken out of the trash
    ExperimentService(services).remove(child["id"])
    sweep_archives(services, time.time() + HOURS)
    assert checkpoint not in stored(services)


def test_policies_to_start_from_are_the_best_and_the_last_of_ones_runs_and_those_that_ship(
    client: TestClient, reports: Reports, parent: dict[str, Any], checkpoint: str
) -> None:
    last = reports.checkpoint(parent["runs"][0], 60_000, reports.evaluation(5))
    reports.experiment("Empty")
    found = client.get("/api/training/starts?search=CORRI").json()
    assert [(one["start_from"]["name"], one["kind"]) for one in found] == [(checkpoint, "best"), (last, "last")]
    assert found[0]["success"]["value"] == 0.8
    one = client.get(f"/api/checkpoints/{last}/start").json()
    assert one == found[1] | {"kind": "other"}
    assert one["experiment_id"] == parent["id"]
    every = client.get("/api/training/starts").json()
    assert {"source": "shipped", "name": "simple"}.items() <= every[2]["start_from"].items()


def test_in_a_comparison_it_is_one_difference_with_a_name(
    client: TestClient, parent: dict[str, Any], checkpoint: str
) -> None:
    child = fine_tune(client, checkpoint).json()
    compared = client.get("/api/compare", params={"experiment": [parent["id"], child["id"]]}).json()
    sha256 = child["training"]["start_from"]["sha256"]
    named = f"Corridor, seed 3, step 50\u202f000 ({sha256[:8]})"
    assert compared["differences"] == [{"path": "start_from", "values": [None, named], "left_out": [False, False]}]


def test_trainings_are_found_by_what_they_began_with(client: TestClient, parent: dict[str, Any], checkpoint: str) -> None:
    child = fine_tune(client, checkpoint).json()
    found = client.get("/api/experiments", params={"query": f"start_from.name = {checkpoint}"}).json()
    assert [one["id"] for one in found["items"]] == [child["id"]]

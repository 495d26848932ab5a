"""Any policy on any suite: asked for over the API, done by a worker, kept with every episode."""

import time
from typing import Any

from fastapi.testclient import TestClient

from server.services import Services
from sim.config import ArenaFile
from workers.shipped.library import shipped_policy

POLICY = shipped_policy("simple")
RECORDED = POLICY.evaluation("simple-200")


def ask(client: TestClient, policy: dict[str, Any], **more: Any) -> dict[str, Any]:
    response = client.post("/api/evaluations", json={"policy": policy, **more})
    assert response.status_code == 202, response.text
    asked: dict[str, Any] = response.json()
    return asked


def ended(client: TestClient, asked: dict[str, Any]) -> dict[str, Any]:
    deadline = time.monotonic() + 60.0
    while asked["state"] in ("queued", "running"):
        assert time.monotonic() < deadline
        time.sleep(0.05)
        asked = client.get(f"/api/evaluations/{asked['id']}").json()
    return asked


def test_a_policy_on_a_suite_does_as_it_did(client: TestClient, job_worker: None) -> None:
    asked = ask(client, {"source": "shipped", "name": "simple"}, suite={"by": "name", "name": "simple-200"})
    assert asked["title"] == POLICY.card.title
    done = ended(client, asked)
    assert (done["state"], done["error"], done["seconds_left"], done["progress"]) == ("done", None, None, 1.0)
    assert done["suite_hash"] == RECORDED.suite_hash
    assert done["figures"]["success"]["value"] == RECORDED.success_rate
    assert done["figures"]["success"]["low"] < RECORDED.success_rate <= done["figures"]["success"]["high"]
    episodes = client.get(f"/api/evaluations/{done['id']}/episodes").json()["episodes"]
    then = [(episode.outcome, episode.steps) for episode in RECORDED.episodes]
    assert [(episode["outcome"], episode["steps"]) for episode in episodes] == then
    # Asked again, it is there; the job is to be seen in the queue.
    assert (
        ask(client, {"source": "shipped", "name": "simple"}, suite={"by": "name", "name": "simple-200"})["id"] == done["id"]
    )
    (job,) = client.get("/api/jobs").json()["items"]
    assert (job["kind"], job["state"], job["title"]) == ("evaluate", "done", POLICY.card.title)
    assert client.delete(f"/api/evaluations/{done['id']}").status_code == 204
    assert client.get("/api/evaluations").json() == {"items": [], "total": 0}


def test_a_baseline_in_an_imported_arena(client: TestClient, services: Services, job_worker: None) -> None:
    room = ArenaFile(name="room", width=6.0, height=6.0)
    sha256 = services.arenas.add(room)
    suite = {"by": "arena", "arena": {"name": "imported", "sha256": sha256}}
    done = ended(client, ask(client, {"source": "baseline", "name": "go-to-goal"}, suite=suite))
    assert (done["state"], done["suite"]) == ("done", "room-200")
    # Nothing stands in its way.
    assert done["figures"]["success"]["value"] > 0.9
    gone = {"by": "arena", "arena": {"name": "imported", "sha256": "0" * 64}}
    refused = client.post("/api/evaluations", json={"policy": {"source": "baseline", "name": "random"}, "suite": gone})
    assert refused.status_code == 422


def test_what_cannot_be_done_says_why(client: TestClient, job_worker: None) -> None:
    failed = ended(client, ask(client, {"source": "shipped", "name": "simple"}, suite={"by": "name", "name": "nowhere-9"}))
    assert failed["state"] == "failed"
    assert "there is no suite 'nowhere-9'" in failed["error"]
    assert client.post("/api/evaluations", json={"policy": {"source": "shipped", "name": "nobody"}}).status_code == 404
    # It may be asked for once more.
    again = ask(client, {"source": "shipped", "name": "simple"}, suite={"by": "name", "name": "nowhere-9"})
    assert again["id"] != failed["id"]


def test_one_that_waits_can_be_taken_back_and_not_deleted(client: TestClient) -> None:
    asked = ask(client, {"source": "baseline", "name": "random"})
    assert (asked["state"], asked["progress"], asked["figures"]) == ("queued", 0.0, None)
    assert client.delete(f"/api/evaluations/{asked['id']}").status_code == 409
    assert client.get("/api/jobs").json()["workers"] == 0
    assert client.post(f"/api/jobs/{asked['job_id']}/cancel").json()["state"] == "cancelled"
    assert client.get(f"/api/evaluations/{asked['id']}").json()["state"] == "cancelled"
    assert client.delete(f"/api/evaluations/{asked['id']}").status_code == 204
    assert client.get("/api/jobs/0123456789abcdef").status_code == 404

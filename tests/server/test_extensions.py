"""Runs that need extensions: who may claim them, what is said meanwhile, and trainings whose extension is not here."""

import uuid
from typing import Any

import pytest
from fastapi.testclient import TestClient

from server.database import tables
from server.jobs import waiting
from server.jobs.asked import Asked
from server.jobs.service import JobService
from server.services import Services
from server.sweeper import Sweeper
from server.workbench.indexing import index_some
from tests.server.harness import WORKER_TOKEN, Reports
from workers.job_protocol import CheckpointPolicy, EvaluateJob, ExportJob, JobSpec, ShippedPolicyName
from workers.protocol import Queue

MY_LAB = {"name": "my_lab", "version": "1.2", "source": "pip install my_lab==1.2"}
WORKER = {"Authorization": f"Bearer {WORKER_TOKEN}"}


class Rings:
    """A doorbell that remembers who was rung for."""

    def __init__(self) -> None:
        self.heard: list[str] = []

    def ring(self, run_id: str, attempt: int, queue: Queue) -> None:
        """Remember it."""
        self.heard.append(run_id)


def launched(client: TestClient, services: Services, **changes: Any) -> str:
    """The id of a queued run that was launched with my_lab 1.2."""
    created = client.post("/api/experiments", json={"name": "mine", "seeds": [1]}).json()
    with services.database.write() as session:
        experiment = session.get_one(tables.Experiment, created["id"])
        experiment.training = {**experiment.training, "extensions": [MY_LAB], **changes}
        experiment.indexed_as = None
    index_some(services)
    run_id: str = created["runs"][0]["id"]
    return run_id


def beat(client: TestClient, worker: str, *extensions: dict[str, Any]) -> None:
    body = {"worker": worker, "queue": "cpu", "extensions": list(extensions)}
    assert client.post("/api/worker/heartbeat", json=body, headers=WORKER).status_code == 200


def claim(client: TestClient, run_id: str, *extensions: dict[str, Any]) -> Any:
    body = {"worker": "w", "published_attempt": 0, "extensions": list(extensions)}
    return client.post(f"/api/worker/runs/{run_id}/claim", json=body, headers=WORKER)


@pytest.mark.parametrize("there", [(), ({"name": "my_lab", "version": "1.1"},), ({"name": "my_lab", "refused": "broken"},)])
def test_a_worker_without_the_extension_is_refused_and_the_run_waits(
    client: TestClient, services: Services, there: tuple[dict[str, Any], ...]
) -> None:
    run_id = launched(client, services)
    beat(client, "w", *there)
    refused = claim(client, run_id, *there)
    assert refused.status_code == 409
    assert "needs my_lab 1.2, which w does not have" in refused.text
    run = client.get(f"/api/runs/{run_id}").json()
    assert (run["state"], run["waits_for"], run["lacking"]) == ("queued", [MY_LAB], [])


def test_a_worker_that_has_it_takes_it(client: TestClient, services: Services) -> None:
    run_id = launched(client, services)
    there = ({"name": "my_lab", "version": "1.2"}, {"name": "other", "version": "3"})
    beat(client, "w", *there)
    assert client.get(f"/api/runs/{run_id}").json()["waits_for"] == []
    assert claim(client, run_id, *there).status_code == 200
    assert client.get(f"/api/runs/{run_id}").json()["state"] == "running"


def test_nobody_is_rung_for_who_could_not_take_it(client: TestClient, services: Services) -> None:
    rings = Rings()
    services.doorbell = rings
    clock = iter((1.0, 5.0, 9.0, 13.0, 17.0))
    sweeper = Sweeper(services, lambda: next(clock))
    beat(client, "plain")
    run_id = launched(client, services)
    rings.heard.clear()
    for _ in range(3):
        sweeper.sweep()
    assert rings.heard == [run_id]  # at the start, for all that wait
    beat(client, "equipped", {"name": "my_lab", "version": "1.2"})
    for _ in range(2):
        sweeper.sweep()
    assert rings.heard[1:] == [run_id, run_id]


def test_a_training_whose_extension_is_not_here_is_shown_and_waits_for_it(client: TestClient, services: Services) -> None:
    algorithm = {"name": "my_lab.reinforce", "learning_rate": 0.1}
    run_id = launched(client, services, algorithm=algorithm)
    (listed,) = client.get("/api/experiments").json()["items"]
    assert listed["unreadable"] == ["algorithm"]
    experiment = client.get(f"/api/experiments/{listed['id']}").json()
    assert (experiment["unreadable"], experiment["lacking"]) == (["algorithm"], [MY_LAB])
    assert client.get(f"/api/runs/{run_id}").json()["lacking"] == [MY_LAB]
    refused = claim(client, run_id, {"name": "my_lab", "version": "1.2"})
    assert refused.status_code == 409
    assert "It needs my_lab 1.2, which the service does not have: install it (pip install my_lab==1.2)." in refused.text
    assert client.get(f"/api/runs/{run_id}").json()["state"] == "queued"


def asked(jobs: JobService, spec: JobSpec, key: str) -> str:
    return jobs.ask(Asked(spec, key, "A policy", "0" * 64))


def next_job(client: TestClient, *extensions: dict[str, Any]) -> str | None:
    kinds = ["view", "play", "replay", "film", "export", "evaluate"]
    body = {"worker": "w@host/jobs0", "claim_id": uuid.uuid4().hex, "kinds": kinds, "wait_seconds": 0.0}
    answer = client.post("/api/worker/jobs/claim", json=body | {"extensions": list(extensions)}, headers=WORKER)
    return None if answer.status_code == 204 else str(answer.json()["id"])


def test_a_job_of_a_policy_that_needs_an_extension_waits_for_a_worker_that_has_it(
    client: TestClient, services: Services, reports: Reports
) -> None:
    checkpoint = reports.checkpoint({"id": launched(client, services)}, 1_000, None)
    jobs, policy = JobService(services), CheckpointPolicy(id=checkpoint)
    needs = asked(jobs, ExportJob(policy=policy), "needs")
    anybodys = asked(jobs, EvaluateJob(policy=ShippedPolicyName(name="simple")), "anybodys")
    old = {"name": "my_lab", "version": "1.1"}
    # It is first in the queue, and in nobody's way.
    assert next_job(client, old) == anybodys
    assert next_job(client, old) is None
    assert client.get(f"/api/jobs/{needs}").json()["waits_for"] == [MY_LAB]
    assert client.get("/api/jobs").json()["items"][1]["waits_for"] == [MY_LAB]
    assert next_job(client, {"name": "my_lab", "version": "1.2"}) == needs
    assert client.get(f"/api/jobs/{needs}").json()["waits_for"] == []


def test_who_waits_for_it_is_told_for_what(
    client: TestClient, services: Services, reports: Reports, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(waiting, "NO_WORKER_SECONDS", 0.0)
    checkpoint = reports.checkpoint({"id": launched(client, services)}, 1_000, None)
    assert next_job(client) is None  # a worker is there, without it
    refused = client.get(f"/api/checkpoints/{checkpoint}/bundle")
    assert refused.status_code == 503
    assert "This waits for a worker with my_lab 1.2: install it (pip install my_lab==1.2) where one runs" in refused.text
    evaluation = {"policies": [{"source": "checkpoint", "id": checkpoint}], "suites": [{"by": "own"}]}
    answer = client.post("/api/evaluations", json=evaluation)
    assert answer.json()[0]["waits_for"] == [MY_LAB], answer.text


def test_the_status_tells_what_each_worker_has(client: TestClient) -> None:
    broken = {"name": "other", "version": None, "refused": "it can't be imported: ModuleNotFoundError: no torch_geometric"}
    beat(client, "w", {"name": "my_lab", "version": "1.2", "refused": None}, broken)
    (worker,) = client.get("/api/status").json()["workers"]
    assert worker["extensions"] == [{"name": "my_lab", "version": "1.2", "refused": None}, broken]


def test_what_is_launched_says_what_is_installed_and_not_what_was_sent(client: TestClient) -> None:
    created = client.post("/api/experiments", json={"name": "mine", "training": {"extensions": [MY_LAB]}}).json()
    assert created["training"]["extensions"] == []

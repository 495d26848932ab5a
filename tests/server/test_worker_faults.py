"""What is a worker's fault is not a run's: lost answers, sick machines, checkpoints that do not stay as they were."""

import asyncio
import hashlib
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from server.checkpoints.repository import CheckpointRepository
from server.ids import new_id
from server.services import Services
from tests.server.test_worker_api import (
    Bell,
    bell,
    claim,
    end,
    hear,
    link,
    metrics,
    run_id,
    say,
    state,
    steps_of,
    upload,
    worker,
)
from workers.protocol import Batch, Claim, Final, Heartbeat

__all__ = ["bell", "run_id", "worker"]

ONE, OTHER = "1" * 32, "2" * 32


def ask(worker: TestClient, run_id: str, claim_id: str, published_attempt: int = 0, name: str = "w@a/0") -> Claim | None:
    """A claim under an id; None where it is refused."""
    body = {"worker": name, "published_attempt": published_attempt, "claim_id": claim_id}
    response = worker.post(f"/api/worker/runs/{run_id}/claim", json=body)
    return Claim.model_validate_json(response.content) if response.status_code == 200 else None


def beat(worker: TestClient, name: str, trouble: str | None = None) -> None:
    body = Heartbeat(worker=name, queue="cpu", trouble=trouble).model_dump()
    assert worker.post("/api/worker/heartbeat", json=body).is_success


def lose(worker: TestClient, run_id: str, attempt: int, name: str) -> None:
    assert ask(worker, run_id, f"{attempt:032x}", attempt - 1, name) is not None
    end(worker, run_id, attempt, "lost", f"{name} has no room")


def events(client: TestClient, run_id: str) -> list[str]:
    return [event["message"] for event in client.get(f"/api/runs/{run_id}/events").json()]


# -- claims ---------------------------------------------------------------------------------------------------------------


def test_a_claim_asked_for_again_is_the_same_attempt(client: TestClient, worker: TestClient, run_id: str) -> None:
    first = ask(worker, run_id, ONE)
    assert first is not None
    assert ask(worker, run_id, ONE) == first
    assert state(client, run_id)["attempt"] == 1
    assert len([message for message in events(client, run_id) if "begins" in message]) == 1
    assert ask(worker, run_id, OTHER) is None
    assert ask(worker, run_id, OTHER, published_attempt=1) is None


def test_a_claim_of_an_attempt_that_is_over_is_refused(worker: TestClient, run_id: str) -> None:
    ask(worker, run_id, ONE)
    end(worker, run_id, 1, "released")
    assert ask(worker, run_id, ONE) is None
    again = ask(worker, run_id, OTHER, published_attempt=1)
    assert again is not None
    assert again.attempt == 2


# -- losses ---------------------------------------------------------------------------------------------------------------


def test_a_sick_worker_alone_does_not_fail_a_run_that_a_healthy_one_would_finish(
    client: TestClient, worker: TestClient, run_id: str
) -> None:
    beat(worker, "sick@a/0")
    beat(worker, "well@b/0")
    for attempt in (1, 2, 3):
        lose(worker, run_id, attempt, "sick@a/0")
    assert state(client, run_id)["state"] == "queued"
    # It has had its turns, whichever of its processes asks.
    assert ask(worker, run_id, ONE, 3, "sick@a/1") is None
    assert ask(worker, run_id, ONE, 3, "well@b/0") is not None
    end(worker, run_id, 4, "completed")
    assert state(client, run_id)["state"] == "completed"


def test_a_run_that_three_workers_lost_fails(client: TestClient, worker: TestClient, run_id: str) -> None:
    beat(worker, "idle@d/0")
    for attempt, name in enumerate(("w@a/0", "w@b/0", "w@c/0"), start=1):
        lose(worker, run_id, attempt, name)
    assert state(client, run_id)["state"] == "failed"


def test_a_run_that_each_of_two_workers_lost_three_times_fails(client: TestClient, worker: TestClient, run_id: str) -> None:
    beat(worker, "w@a/0")
    beat(worker, "w@b/0")
    for attempt in range(1, 7):
        assert state(client, run_id)["state"] == "queued"
        lose(worker, run_id, attempt, "w@a/0" if attempt <= 3 else "w@b/0")
    assert state(client, run_id)["state"] == "failed"


def test_a_worker_that_says_that_it_is_sick_is_not_waited_for(client: TestClient, worker: TestClient, run_id: str) -> None:
    beat(worker, "w@a/0")
    beat(worker, "full@b/0", trouble="the disk is full")
    for attempt in (1, 2, 3):
        lose(worker, run_id, attempt, "w@a/0")
    assert state(client, run_id)["state"] == "failed"
    workers = {entry["name"]: entry["trouble"] for entry in client.get("/api/status").json()["workers"]}
    assert workers == {"w@a/0": None, "full@b/0": "the disk is full"}


# -- damaged checkpoints --------------------------------------------------------------------------------------------------


@pytest.fixture
def two_checkpoints(
    worker: TestClient, run_id: str, services: Services, make_checkpoint: Callable[..., Path]
) -> tuple[str, str]:
    """Ids of whole archives at steps 200 and 400 of a run whose curve goes to 500, at attempt 1."""
    archive = make_checkpoint().read_bytes()

    async def blocks() -> AsyncIterator[bytes]:
        yield archive

    claim(worker, run_id)
    ids = []
    with link(worker, run_id, 1) as socket:
        hear(socket)
        for seq in range(1, 6):
            say(socket, Batch(items=metrics((seq, 100 * seq))))
        for step in (200, 400):
            file = asyncio.run(services.files.write(new_id(), blocks(), hashlib.sha256(archive).hexdigest()))
            with services.database.write() as session:
                CheckpointRepository(session).add(run_id, step, file, None)
            ids.append(file.id)
        say(socket, Batch(final=Final(outcome="released")))
    return ids[0], ids[1]


def damage(services: Services, checkpoint_id: str) -> None:
    """Change one byte of an archive where it is kept."""
    path = services.settings.data_dir / "checkpoints" / f"{checkpoint_id}.zip"
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 1
    path.write_bytes(data)


def report_damage(worker: TestClient, run_id: str, attempt: int) -> Claim:
    """Claim, and find that the checkpoint cannot be read."""
    granted = claim(worker, run_id, published_attempt=attempt - 1)
    end(worker, run_id, attempt, "damaged", "its SHA-256 is another")
    return granted


def test_a_damaged_newest_checkpoint_is_marked_and_the_run_goes_on_from_the_one_before(
    client: TestClient,
    worker: TestClient,
    run_id: str,
    services: Services,
    bell: Bell,
    two_checkpoints: tuple[str, str],
) -> None:
    damage(services, two_checkpoints[1])
    granted = report_damage(worker, run_id, 2)
    assert granted.checkpoint is not None
    assert granted.checkpoint.id == two_checkpoints[1]
    run = state(client, run_id)
    assert (run["state"], run["error"], run["step"]) == ("queued", None, 200)
    assert steps_of(services, run_id) == [100, 200]  # at once, not at the next claim: nobody sees a curve without its policy
    listed = {entry["step"]: entry["damaged"] for entry in client.get(f"/api/runs/{run_id}/checkpoints").json()["items"]}
    assert listed == {200: False, 400: True}
    assert "The checkpoint of step 400 is damaged (its SHA-256 is another): the run goes on from step 200." in events(
        client, run_id
    )
    assert bell.rings[-1] == (run_id, 2, "cpu")

    again = claim(worker, run_id, published_attempt=2)
    assert again.checkpoint is not None
    assert again.checkpoint.id == two_checkpoints[0]
    # What is trained once more is stored once more, beside the damaged one.
    assert upload(worker, run_id, 400, attempt=3) == 204
    both = [(entry["step"], entry["damaged"]) for entry in client.get(f"/api/runs/{run_id}/checkpoints").json()["items"]]
    assert both == [(400, False), (400, True), (200, False)]


def test_where_every_checkpoint_is_damaged_or_gone_the_run_begins_anew(
    client: TestClient, worker: TestClient, run_id: str, services: Services, two_checkpoints: tuple[str, str]
) -> None:
    services.files.delete(two_checkpoints[1])
    damage(services, two_checkpoints[0])
    report_damage(worker, run_id, 2)
    report_damage(worker, run_id, 3)
    assert claim(worker, run_id, published_attempt=3).checkpoint is None
    assert steps_of(services, run_id) == []
    assert state(client, run_id)["state"] == "running"


def test_an_archive_that_was_damaged_before_it_was_brought_here_is_found_out(
    client: TestClient, worker: TestClient, run_id: str, services: Services
) -> None:
    claim(worker, run_id)
    assert upload(worker, run_id, 200, attempt=1) == 204  # its SHA-256 agrees, and it is no archive
    end(worker, run_id, 1, "released")
    report_damage(worker, run_id, 2)
    assert [entry["damaged"] for entry in client.get(f"/api/runs/{run_id}/checkpoints").json()["items"]] == [True]


def test_a_worker_that_cannot_read_a_whole_checkpoint_loses_the_attempt_and_the_checkpoint_stays(
    client: TestClient, worker: TestClient, run_id: str, services: Services, two_checkpoints: tuple[str, str]
) -> None:
    report_damage(worker, run_id, 2)
    assert any("although the checkpoint is whole where it is kept" in message for message in events(client, run_id))
    again = claim(worker, run_id, published_attempt=2)
    assert again.checkpoint is not None
    assert again.checkpoint.id == two_checkpoints[1]
    assert steps_of(services, run_id) == [100, 200, 300, 400]


# -- drain ----------------------------------------------------------------------------------------------------------------


def test_a_worker_is_drained_with_all_its_processes_until_it_is_started_again(
    client: TestClient, worker: TestClient, run_id: str
) -> None:
    def beat(name: str, *, first: bool = False) -> bool:
        body = Heartbeat(worker=name, queue="cpu", first=first).model_dump()
        return bool(worker.post("/api/worker/heartbeat", json=body).json()["drain"])

    assert [beat(name, first=True) for name in ("w@a/0", "w@a/1", "w@b/0")] == [False, False, False]
    answer = client.post("/api/workers/drain", json={"worker": "w@a"})
    assert {entry["name"]: entry["draining"] for entry in answer.json()["workers"]} == {
        "w@a/0": True,
        "w@a/1": True,
        "w@b/0": False,
    }
    # A run that it asks for before it has heard of it is not given to it.
    body = {"worker": "w@a/1", "published_attempt": 0, "queue": "cpu"}
    refused = worker.post(f"/api/worker/runs/{run_id}/claim", json=body)
    assert (refused.status_code, refused.json()["detail"]) == (409, "This worker was asked to take up no more runs.")
    assert worker.post(f"/api/worker/runs/{run_id}/claim", json=body | {"worker": "w@b/0"}).status_code == 200
    assert [beat(name) for name in ("w@a/0", "w@a/1", "w@b/0")] == [True, True, False]
    assert beat("w@a/0", first=True) is False
    assert client.post("/api/workers/drain", json={"worker": "nobody"}).status_code == 404


# -- devices --------------------------------------------------------------------------------------------------------------


def test_a_training_on_any_device_rings_both_queues_and_stays_where_it_began(
    client: TestClient, worker: TestClient, bell: Bell
) -> None:
    launched = client.post("/api/experiments", json={"name": "anywhere", "seeds": [1], "training": {"device": "auto"}})
    run = launched.json()["runs"][0]["id"]
    assert bell.rings == [(run, 0, "cpu"), (run, 0, "gpu")]
    body = {"worker": "w@a/0", "published_attempt": 0, "queue": "gpu"}
    first = worker.post(f"/api/worker/runs/{run}/claim", json=body)
    assert first.json()["training"]["device"] == "cuda"
    bell.rings.clear()
    end(worker, run, 1, "released")
    assert bell.rings == [(run, 1, "gpu")]
    refused = worker.post(f"/api/worker/runs/{run}/claim", json={**body, "published_attempt": 1, "queue": "cpu"})
    assert refused.status_code == 409
    assert "is trained on cuda: a worker of the queue gpu takes it up" in refused.json()["detail"]
    again = worker.post(f"/api/worker/runs/{run}/claim", json={**body, "published_attempt": 1})
    assert again.json()["training"]["device"] == "cuda"
    # What was launched stays what was launched.
    assert client.get(f"/api/runs/{run}").json()["training"]["device"] == "auto"


@pytest.mark.parametrize(("device", "queue"), [("cpu", "gpu"), ("cuda", "cpu")])
def test_a_worker_for_another_device_does_not_get_a_run(
    client: TestClient, worker: TestClient, bell: Bell, device: str, queue: str
) -> None:
    launched = client.post("/api/experiments", json={"name": "here", "seeds": [1], "training": {"device": device}})
    run = launched.json()["runs"][0]["id"]
    body = {"worker": "w@a/0", "published_attempt": 0, "queue": queue}
    assert worker.post(f"/api/worker/runs/{run}/claim", json=body).status_code == 409
    assert client.get(f"/api/runs/{run}").json()["state"] == "queued"

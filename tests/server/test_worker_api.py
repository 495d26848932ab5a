"""What workers may do: claim, report, bring checkpoints; and what happens to those that have lost their run."""

import hashlib
import json
import math
import time
from typing import Any

import pytest
from fastapi.testclient import TestClient
from starlette.testclient import WebSocketTestSession
from starlette.websockets import WebSocketDisconnect

from server.checkpoints.archives import GRACE_SECONDS, LooseArchives, sweep_archives
from server.errors import DatabaseAwayError
from server.metrics.repository import MetricRepository
from server.services import Services
from server.settings import Settings
from server.worker_api.leases import Leases
from server.worker_api.service import WorkerService
from workers.protocol import (
    CLOSE_FENCED,
    CLOSE_NOT_UNDERSTOOD,
    Batch,
    CheckpointUpload,
    Claim,
    EventItem,
    Final,
    FinalOutcome,
    MetricItem,
    Orders,
    Queue,
)
from workers.reporting import EpisodeResult, EvaluationResult

WORKER_TOKEN = "a-worker-token-for-tests"
EVALUATION = EvaluationResult(
    suite="tiny",
    suite_hash="0" * 64,
    episodes=tuple(
        EpisodeResult(outcome=outcome, steps=10, reward=1.0, path_length=2.0, shortest_path=1.5, min_clearance=0.3)
        for outcome in ("arrival", "arrival", "collision", "timeout")
    ),
)


class Bell:
    """Remembers who was rung."""

    def __init__(self) -> None:
        self.rings: list[tuple[str, int, Queue]] = []

    def ring(self, run_id: str, attempt: int, queue: Queue) -> None:
        self.rings.append((run_id, attempt, queue))


@pytest.fixture
def settings(settings: Settings, database_url: str) -> Settings:
    """On both kinds of database."""
    return settings.model_copy(update={"database_url": database_url})


@pytest.fixture
def bell(services: Services) -> Bell:
    services.doorbell = bell = Bell()
    return bell


@pytest.fixture
def run_id(client: TestClient, bell: Bell) -> str:
    response = client.post("/api/experiments", json={"name": "a training", "seeds": [7]})
    run_id: str = response.json()["runs"][0]["id"]
    bell.rings.clear()
    return run_id


@pytest.fixture
def worker(client: TestClient) -> TestClient:
    """The same service on the same event loop, with the workers' token."""
    worker = TestClient(client.app, base_url=str(client.base_url), headers={"Authorization": f"Bearer {WORKER_TOKEN}"})
    worker.portal = client.portal
    return worker


def claim(worker: TestClient, run_id: str, published_attempt: int = 0, name: str = "w") -> Claim:
    response = worker.post(f"/api/worker/runs/{run_id}/claim", json={"worker": name, "published_attempt": published_attempt})
    assert response.status_code == 200, response.text
    return Claim.model_validate_json(response.content)


def link(worker: TestClient, run_id: str, attempt: int) -> WebSocketTestSession:
    return worker.websocket_connect(f"ws://127.0.0.1:8400/api/worker/runs/{run_id}/link?attempt={attempt}")


def metrics(*pairs: tuple[int, int], value: float | None = 1.0) -> tuple[MetricItem, ...]:
    return tuple(MetricItem(seq=seq, step=step, at=1000.0 + seq, values={"train/return": value}) for seq, step in pairs)


def say(socket: WebSocketTestSession, batch: Batch) -> Orders:
    socket.send_text(batch.model_dump_json())
    return hear(socket)


def hear(socket: WebSocketTestSession) -> Orders:
    return Orders.model_validate_json(socket.receive_text())


def upload(worker: TestClient, run_id: str, step: int, attempt: int, after_seq: int = 0) -> int:
    """The status of the answer to an upload."""
    archive = b"an archive"
    head = CheckpointUpload(after_seq=after_seq, sha256=hashlib.sha256(archive).hexdigest(), evaluation=EVALUATION)
    body = head.model_dump_json().encode() + b"\n" + archive
    response = worker.put(f"/api/worker/runs/{run_id}/checkpoints/{step}", params={"attempt": attempt}, content=body)
    return int(response.status_code)


def steps_of(services: Services, run_id: str) -> list[int]:
    with services.database.read() as session:
        series = MetricRepository(session).read(run_id)
    return series["train/return"].steps.tolist() if series else []


def state(client: TestClient, run_id: str) -> dict[str, Any]:
    run: dict[str, Any] = client.get(f"/api/runs/{run_id}").json()
    return run


def end(worker: TestClient, run_id: str, attempt: int, outcome: FinalOutcome, error: str | None = None) -> None:
    with link(worker, run_id, attempt) as socket:
        hear(socket)
        assert say(socket, Batch(final=Final(outcome=outcome, error=error))).over


def test_a_claim_grants_the_run_with_everything_that_training_needs(
    client: TestClient, worker: TestClient, run_id: str, services: Services
) -> None:
    granted = claim(worker, run_id)
    assert (granted.attempt, granted.seed, granted.last_seq, granted.checkpoint) == (1, 7, 0, None)
    assert granted.lease_seconds == services.settings.lease_seconds
    run = state(client, run_id)
    assert (run["state"], run["attempt"], run["worker"]) == ("running", 1, "w")
    assert granted.training.model_dump(mode="json") == run["training"]


@pytest.mark.parametrize("published_attempt", [0, 1, 2])
def test_only_the_first_of_several_messages_gets_the_run(worker: TestClient, run_id: str, published_attempt: int) -> None:
    claim(worker, run_id)
    response = worker.post(
        f"/api/worker/runs/{run_id}/claim", json={"worker": "another", "published_attempt": published_attempt}
    )
    assert response.status_code == 409


def test_a_message_of_an_earlier_attempt_is_refused_when_the_run_waits_again(worker: TestClient, run_id: str) -> None:
    claim(worker, run_id)
    end(worker, run_id, 1, "released")
    late = worker.post(f"/api/worker/runs/{run_id}/claim", json={"worker": "w", "published_attempt": 0})
    assert late.status_code == 409
    assert claim(worker, run_id, published_attempt=1).attempt == 2


def test_the_worker_api_is_closed_to_the_login_token_and_unknown_runs(client: TestClient, worker: TestClient) -> None:
    body = {"worker": "w", "published_attempt": 0}
    assert client.post("/api/worker/runs/none/claim", json=body).status_code == 401
    assert worker.post("/api/worker/runs/none/claim", json=body).status_code == 404
    assert worker.get("/api/experiments").status_code == 403


def test_what_comes_twice_is_stored_once(client: TestClient, worker: TestClient, run_id: str, services: Services) -> None:
    claim(worker, run_id)
    note = EventItem(seq=3, step=200, at=1.0, level="info", message="hello")
    with link(worker, run_id, 1) as socket:
        assert hear(socket).ack == 0
        assert say(socket, Batch(items=(*metrics((1, 100), (2, 200)), note))).ack == 3
        assert say(socket, Batch(items=(*metrics((2, 200)), note, *metrics((4, 300))))).ack == 4
    assert steps_of(services, run_id) == [100, 200, 300]
    assert [event["message"] for event in client.get(f"/api/runs/{run_id}/events").json()].count("hello") == 1
    assert state(client, run_id)["step"] == 300


def test_a_new_link_of_the_same_attempt_learns_what_has_arrived(worker: TestClient, run_id: str) -> None:
    claim(worker, run_id)
    with link(worker, run_id, 1) as socket:
        hear(socket)
        say(socket, Batch(items=metrics((1, 100), (2, 200))))
    with link(worker, run_id, 1) as socket:
        assert hear(socket).ack == 2


def test_a_number_that_is_not_finite_leaves_a_gap_instead_of_an_error(
    worker: TestClient, run_id: str, services: Services
) -> None:
    claim(worker, run_id)
    with link(worker, run_id, 1) as socket:
        hear(socket)
        say(socket, Batch(items=metrics((1, 100), value=None)))
    with services.database.read() as session:
        (value,) = MetricRepository(session).read(run_id)["train/return"].values
    assert math.isnan(value)


def test_an_old_attempt_is_cut_off_and_changes_nothing(worker: TestClient, run_id: str, services: Services) -> None:
    claim(worker, run_id)
    with link(worker, run_id, 1) as zombie:
        hear(zombie)
        end(worker, run_id, 1, "released")
        claim(worker, run_id, published_attempt=1)
        zombie.send_text(Batch(items=metrics((1, 100))).model_dump_json())
        with pytest.raises(WebSocketDisconnect) as closed:
            zombie.receive_text()
        assert closed.value.code == CLOSE_FENCED
    assert upload(worker, run_id, 100, attempt=1) == 409
    assert steps_of(services, run_id) == []
    with link(worker, run_id, 1) as late, pytest.raises(WebSocketDisconnect) as closed:
        late.receive_text()
    assert closed.value.code == CLOSE_FENCED


def test_the_next_attempt_goes_on_from_the_last_checkpoint_and_what_lies_beyond_is_dropped(
    worker: TestClient, run_id: str, services: Services
) -> None:
    claim(worker, run_id)
    with link(worker, run_id, 1) as socket:
        hear(socket)
        say(socket, Batch(items=metrics((1, 100), (2, 200))))
        assert upload(worker, run_id, 200, attempt=1, after_seq=2) == 204
        say(socket, Batch(items=metrics((3, 300), (4, 400))))
        say(socket, Batch(final=Final(outcome="lost", error="killed")))
    assert steps_of(services, run_id) == [100, 200, 300, 400]
    granted = claim(worker, run_id, published_attempt=1)
    assert granted.checkpoint is not None
    assert granted.checkpoint.step == 200
    assert granted.last_seq == 4
    assert steps_of(services, run_id) == [100, 200]
    archive = worker.get(f"/api/worker/checkpoints/{granted.checkpoint.id}")
    assert archive.content == b"an archive"
    assert hashlib.sha256(archive.content).hexdigest() == granted.checkpoint.sha256


def test_without_a_checkpoint_everything_is_dropped(worker: TestClient, run_id: str, services: Services) -> None:
    claim(worker, run_id)
    with link(worker, run_id, 1) as socket:
        hear(socket)
        say(socket, Batch(items=metrics((1, 0), (2, 100)), final=Final(outcome="lost", error="killed")))
    claim(worker, run_id, published_attempt=1)
    assert steps_of(services, run_id) == []


def test_a_checkpoint_never_comes_ahead_of_its_metrics(client: TestClient, worker: TestClient, run_id: str) -> None:
    claim(worker, run_id)
    assert upload(worker, run_id, 200, attempt=1, after_seq=2) == 425
    assert client.get(f"/api/runs/{run_id}/checkpoints").json()["items"] == []


def test_a_checkpoint_that_comes_twice_is_registered_once(
    client: TestClient, worker: TestClient, run_id: str, services: Services
) -> None:
    claim(worker, run_id)
    assert [upload(worker, run_id, 200, attempt=1) for _ in range(2)] == [204, 204]
    (checkpoint,) = client.get(f"/api/runs/{run_id}/checkpoints").json()["items"]
    assert checkpoint["step"] == 200
    assert (checkpoint["evaluation"]["episodes"], checkpoint["evaluation"]["arrivals"]) == (4, 2)
    assert services.files.ids() == {checkpoint["id"]}


@pytest.mark.parametrize(
    ("body", "status"),
    [
        (b"", 422),
        (b"not json\nbytes", 422),
        (b'{"after_seq": 0, "sha256": "zz"}\nbytes', 422),
        (b'{"after_seq": 0, "sha256": "' + b"0" * 64 + b'"}\nbytes', 422),
        (b"x" * 5_000_000, 413),
    ],
)
def test_a_damaged_upload_is_refused_and_leaves_nothing(
    worker: TestClient, run_id: str, services: Services, body: bytes, status: int
) -> None:
    claim(worker, run_id)
    response = worker.put(f"/api/worker/runs/{run_id}/checkpoints/5", params={"attempt": 1}, content=body)
    assert response.status_code == status
    assert services.files.ids() == set()


def test_a_checkpoint_whose_commit_was_never_answered_keeps_its_archive(
    client: TestClient, worker: TestClient, run_id: str, services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The database had committed when the way to it was cut: nobody knows, and the worker sends the checkpoint again."""
    claim(worker, run_id)
    register = WorkerService.register

    def unanswered(*arguments: Any) -> bool:
        register(*arguments)
        raise DatabaseAwayError("The database can't be reached now.")

    with monkeypatch.context() as cut:
        cut.setattr(WorkerService, "register", unanswered)
        assert upload(worker, run_id, 5, 1) == 503
    (checkpoint,) = client.get(f"/api/runs/{run_id}/checkpoints").json()["items"]
    assert services.files.ids() == {checkpoint["id"]}
    assert upload(worker, run_id, 5, 1) == 204
    assert services.files.ids() == {checkpoint["id"]}


def test_a_checkpoint_that_was_not_registered_while_the_database_is_away_is_left_to_the_sweep(
    worker: TestClient, run_id: str, services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    claim(worker, run_id)

    def away(*_arguments: Any) -> Any:
        raise DatabaseAwayError("The database can't be reached now.")

    with monkeypatch.context() as cut:
        cut.setattr(WorkerService, "register", away)
        cut.setattr(LooseArchives, "give_up", away)
        assert upload(worker, run_id, 5, 1) == 503
    assert len(services.files.ids()) == 1
    assert sweep_archives(services, time.time() + GRACE_SECONDS + 1.0) == 1
    assert services.files.ids() == set()


@pytest.mark.parametrize(
    ("outcome", "after"),
    [("completed", "completed"), ("stopped", "stopped"), ("failed", "failed"), ("released", "queued"), ("lost", "queued")],
)
def test_how_an_attempt_ends(
    client: TestClient, worker: TestClient, run_id: str, bell: Bell, outcome: FinalOutcome, after: str
) -> None:
    claim(worker, run_id)
    end(worker, run_id, 1, outcome, "because" if outcome in ("failed", "lost") else None)
    run = state(client, run_id)
    assert run["state"] == after
    assert run["worker"] is None
    assert (run["finished_at"] is not None) == (after != "queued")
    assert ("because" in (run["error"] or "")) == (outcome in ("failed", "lost"))
    assert bell.rings == ([(run_id, 1, "cpu")] if after == "queued" else [])


@pytest.mark.parametrize("outcome", ["stopped", "released", "lost"])
def test_a_run_that_was_asked_to_stop_stops_however_its_attempt_ends(
    client: TestClient, worker: TestClient, run_id: str, bell: Bell, outcome: FinalOutcome
) -> None:
    claim(worker, run_id)
    client.post(f"/api/runs/{run_id}/stop")
    end(worker, run_id, 1, outcome)
    assert state(client, run_id)["state"] == "stopped"
    assert bell.rings == []


def test_after_three_losses_without_a_new_checkpoint_a_run_fails_with_every_reason(
    client: TestClient, worker: TestClient, run_id: str
) -> None:
    for attempt, reason in enumerate(("out of memory", "power cut", "gremlins"), start=1):
        assert claim(worker, run_id, published_attempt=attempt - 1).attempt == attempt
        end(worker, run_id, attempt, "lost", reason)
    run = state(client, run_id)
    assert run["state"] == "failed"
    assert all(reason in run["error"] for reason in ("out of memory", "power cut", "gremlins"))


def test_a_new_checkpoint_wipes_earlier_losses_out(client: TestClient, worker: TestClient, run_id: str) -> None:
    for attempt in range(1, 6):
        claim(worker, run_id, published_attempt=attempt - 1)
        assert upload(worker, run_id, 100 * attempt, attempt) == 204
        end(worker, run_id, attempt, "lost", "gremlins")
    assert state(client, run_id)["state"] == "queued"


def test_a_stop_reaches_the_worker_at_once_and_again_on_a_new_link(
    client: TestClient, worker: TestClient, run_id: str
) -> None:
    claim(worker, run_id)
    with link(worker, run_id, 1) as socket:
        assert not hear(socket).stop
        client.post(f"/api/runs/{run_id}/stop")
        assert hear(socket).stop
    with link(worker, run_id, 1) as socket:
        assert hear(socket).stop


def test_removing_an_experiment_cuts_its_worker_off(client: TestClient, worker: TestClient, run_id: str) -> None:
    claim(worker, run_id)
    experiment_id = state(client, run_id)["experiment_id"]
    with link(worker, run_id, 1) as socket:
        hear(socket)
        client.delete(f"/api/experiments/{experiment_id}")
        assert hear(socket).stop
        client.post("/api/workbench/actions", json={"action": "remove", "experiments": [experiment_id]})
        with pytest.raises(WebSocketDisconnect) as closed:
            socket.receive_text()
    assert closed.value.code == CLOSE_FENCED


def test_every_message_renews_the_lease(worker: TestClient, run_id: str, services: Services) -> None:
    now = 0.0
    services.leases = Leases(15.0, lambda: now)
    claim(worker, run_id)
    with link(worker, run_id, 1) as socket:
        hear(socket)
        now = 14.0
        say(socket, Batch())
        now = 28.0
        assert not services.leases.is_expired(run_id, 1)
    now = 29.1
    assert services.leases.is_expired(run_id, 1)


def test_a_database_that_takes_its_time_costs_nobody_a_lease(worker: TestClient, run_id: str, services: Services) -> None:
    """A message counts when it is heard: it is stored behind whoever holds the database."""
    now = 0.0
    services.leases = Leases(15.0, lambda: now)
    claim(worker, run_id)
    with link(worker, run_id, 1) as socket:
        hear(socket)
        now = 14.0
        with services.database.write():
            socket.send_text(Batch(items=metrics((1, 100))).model_dump_json())
            deadline = time.monotonic() + 10
            while services.leases._until[run_id, 1] < 29.0:
                assert time.monotonic() < deadline
                time.sleep(0.01)
            if services.database.engine.dialect.name == "sqlite":  # PostgreSQL takes several writers at a time
                assert steps_of(services, run_id) == []
        assert hear(socket).ack == 1


def test_heartbeats_make_a_worker_visible_with_the_run_that_it_trains(
    client: TestClient, worker: TestClient, run_id: str
) -> None:
    for name in ("w", "idle"):
        assert worker.post("/api/worker/heartbeat", json={"worker": name, "queue": "cpu"}).json() == {"drain": False}
    claim(worker, run_id, name="w")
    workers = {entry["name"]: entry["run_id"] for entry in client.get("/api/status").json()["workers"]}
    assert workers == {"w": run_id, "idle": None}


GOOD = {"kind": "metrics", "seq": 1, "step": 100, "at": 1.0, "values": {"train/return": 1.0}}


@pytest.mark.parametrize(
    "damage",
    [
        {"step": -5},
        {"step": 10**30},
        {"at": 1e300},
        {"values": {"x" * 65: 1.0}},
        {"values": {"": 1.0}},
        {"values": {"nul \0": 1.0}},
        {"values": {f"series {i}": 1.0 for i in range(257)}},
        {"kind": "gossip"},
        {"kind": "event", "level": "shout", "message": "x"},
        {"kind": "event", "level": "info", "message": "x" * 10_001},
    ],
    ids=lambda damage: next(iter(damage)),
)
def test_an_item_that_can_never_be_stored_is_named_and_what_precedes_it_is_kept(
    worker: TestClient, run_id: str, services: Services, damage: dict[str, Any]
) -> None:
    claim(worker, run_id)
    bad = GOOD | {"seq": 2} | damage
    if bad["kind"] == "event":
        bad.pop("values")
    with link(worker, run_id, 1) as socket:
        hear(socket)
        for _ in range(2):  # and again when it comes again
            socket.send_text(json.dumps({"items": [GOOD, bad, GOOD | {"seq": 3, "step": 300}]}))
            orders = hear(socket)
            assert orders.ack == 1
            assert orders.refused is not None
            assert orders.refused.seq == 2
            assert "Item 2 can't be stored" in orders.refused.reason
        assert say(socket, Batch(final=Final(outcome="lost", error="item 2 was refused"))).over
    assert steps_of(services, run_id) == [100]


def test_an_item_behind_a_gap_is_refused(worker: TestClient, run_id: str, services: Services) -> None:
    claim(worker, run_id)
    with link(worker, run_id, 1) as socket:
        hear(socket)
        orders = say(socket, Batch(items=metrics((1, 100), (2, 200), (4, 400))))
    assert (orders.ack, orders.refused and orders.refused.seq) == (2, 4)
    assert steps_of(services, run_id) == [100, 200]


def test_text_that_no_database_holds_is_shown_as_far_as_it_can_be(
    client: TestClient, worker: TestClient, run_id: str
) -> None:
    claim(worker, run_id)
    with link(worker, run_id, 1) as socket:
        hear(socket)
        item = {"kind": "event", "seq": 1, "step": 1, "at": 1.0, "level": "info", "message": "core\0dumped"}
        socket.send_text(json.dumps({"items": [item]}))
        assert hear(socket).ack == 1
        say(socket, Batch(final=Final(outcome="failed", error="cut \ud800 off\0")))
    assert "core\ufffddumped" in [event["message"] for event in client.get(f"/api/runs/{run_id}/events").json()]
    assert state(client, run_id)["error"] == "cut ? off\ufffd"


@pytest.mark.parametrize(
    ("step", "evaluation"),
    [
        (-5, {}),
        (10**30, {}),
        (100, {"episodes": []}),
        (100, {"suite": "x" * 65}),
        (100, {"suite": "nul \0"}),
        (100, {"episodes": [EVALUATION.episodes[0].model_dump() | {"reward": 1e300}]}),
    ],
)
def test_a_checkpoint_that_can_never_be_registered_is_refused_at_once(
    client: TestClient, worker: TestClient, run_id: str, services: Services, step: int, evaluation: dict[str, Any]
) -> None:
    claim(worker, run_id)
    archive = b"an archive"
    head = {
        "after_seq": 0,
        "sha256": hashlib.sha256(archive).hexdigest(),
        "evaluation": EVALUATION.model_dump(mode="json") | evaluation,
    }
    response = worker.put(
        f"/api/worker/runs/{run_id}/checkpoints/{step}",
        params={"attempt": 1},
        content=json.dumps(head).encode() + b"\n" + archive,
    )
    assert response.status_code == 422
    assert client.get("/api/experiments").status_code == 200
    assert services.files.ids() == set()


def test_what_is_no_message_of_the_protocol_ends_the_link(worker: TestClient, run_id: str) -> None:
    claim(worker, run_id)
    with link(worker, run_id, 1) as socket:
        hear(socket)
        socket.send_text('{"items": [{"kind": "gossip"}]}')
        with pytest.raises(WebSocketDisconnect) as closed:
            socket.receive_text()
    assert closed.value.code == CLOSE_NOT_UNDERSTOOD

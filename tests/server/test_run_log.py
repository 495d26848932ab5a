"""A run's log: printed lines and events in one stream, bounded, searched, and honest about what it has not kept."""

import re
import time
from typing import Any

import pytest
from fastapi.testclient import TestClient

from server.errors import ConflictError
from server.run_log.repository import HEAD_BYTES, TAIL_BYTES
from server.run_log.service import LogService
from server.runs.repository import RunRepository
from server.services import Services
from tests.server.harness import WORKER_TOKEN, Reports
from workers.protocol import MAX_LOG_LINES, LogBatch, LogLine
from workers.wording import counted


@pytest.fixture
def run(reports: Reports) -> dict[str, Any]:
    run: dict[str, Any] = reports.experiment()["runs"][0]
    reports.state(run, "running", attempt=1, worker="w")
    return run


def batch(first: int, *texts: str, at: float = 0.0) -> LogBatch:
    return LogBatch(first=first, lines=tuple(LogLine(at=at or time.time(), text=text) for text in texts))


def texts(client: TestClient, run: dict[str, Any], **query: Any) -> list[str]:
    return [line["text"] for line in client.get(f"/api/runs/{run['id']}/log", params=query).json()["lines"]]


def test_lines_and_events_stand_by_time(client: TestClient, services: Services, run: dict[str, Any]) -> None:
    now = time.time()
    LogService(services).append(run["id"], 1, batch(1, "before", at=now - 10))
    with services.database.write() as session:
        RunRepository(session).add_event(run["id"], "warning", "Link lost.", 7)
    LogService(services).append(run["id"], 1, batch(2, "after", at=now + 10))

    lines = client.get(f"/api/runs/{run['id']}/log").json()["lines"]

    assert [(line["kind"], line["attempt"], line["step"], line["text"]) for line in lines] == [
        ("output", 1, None, "before"),
        ("event", None, 7, "Link lost."),
        ("output", 1, None, "after"),
    ]
    text = client.get(f"/api/runs/{run['id']}/log/text")
    assert text.headers["content-type"] == "text/plain; charset=utf-8"
    assert [re.sub(r"^\S+ \S+Z ", "", line) for line in text.text.splitlines()] == [
        "[attempt 1] before",
        "[warning] Link lost.",
        "[attempt 1] after",
    ]


def test_what_comes_twice_is_there_once(client: TestClient, services: Services, run: dict[str, Any]) -> None:
    log = LogService(services)
    log.append(run["id"], 1, batch(1, "a", "b"))
    log.append(run["id"], 1, batch(1, "a", "b", "c"))
    log.append(run["id"], 1, batch(2, "b"))

    assert texts(client, run) == ["a", "b", "c"]


def test_a_gap_says_how_many_are_missing(
    client: TestClient, services: Services, run: dict[str, Any], reports: Reports
) -> None:
    log = LogService(services)
    log.append(run["id"], 1, batch(1, "a"))
    log.append(run["id"], 1, batch(1_003, "b"))
    reports.state(run, "running", attempt=2)
    log.append(run["id"], 2, batch(2, "c"))

    assert texts(client, run) == ["a", "1\u202f001 lines were not kept.", "b", "1 line was not kept.", "c"]
    with pytest.raises(ConflictError, match=r"Attempt 1 of run .* is over"):
        log.append(run["id"], 1, batch(1_004, "too late"))


def test_the_middle_of_a_long_log_goes(client: TestClient, services: Services, run: dict[str, Any]) -> None:
    log, line = LogService(services), "x" * 976
    count = 5 * MAX_LOG_LINES * 2
    for first in range(1, count, MAX_LOG_LINES // 5):
        log.append(run["id"], 1, batch(first, *(f"{first + index:06} {line}" for index in range(MAX_LOG_LINES // 5))))

    kept = texts(client, run, limit=5_000)
    numbers = [int(text[:6]) for text in kept if text.endswith("x")]
    (said,) = (text for text in kept if not text.endswith("x"))

    assert numbers[0] == 1
    assert numbers[-1] == count
    assert said == f"{counted(count - len(numbers))} lines were not kept."
    kept_bytes = len(numbers) * (24 + 7 + 976)
    assert 0.9 * (HEAD_BYTES + TAIL_BYTES) < kept_bytes <= HEAD_BYTES + TAIL_BYTES


def test_it_is_searched_whatever_the_case(client: TestClient, services: Services, run: dict[str, Any]) -> None:
    LogService(services).append(run["id"], 1, batch(1, "Größe: 3", "nothing", "GRÖSSE: 4", "größe: 5"))
    found = client.get(f"/api/runs/{run['id']}/log", params={"search": "grösse", "limit": 2}).json()

    assert [line["text"] for line in found["lines"]] == ["GRÖSSE: 4", "größe: 5"]
    assert found["total"] == 3


def test_only_its_worker_may_write(client: TestClient, run: dict[str, Any]) -> None:
    path, body = f"/api/worker/runs/{run['id']}/log", batch(1, "hello\0").model_dump()
    assert client.post(path, params={"attempt": 1}, json=body).status_code == 401
    as_worker = {"Authorization": f"Bearer {WORKER_TOKEN}"}
    assert client.post(path, params={"attempt": 2}, json=body, headers=as_worker).status_code == 409
    assert client.post(path, params={"attempt": 1}, json=body, headers=as_worker).status_code == 204
    assert texts(client, run) == ["hello\N{REPLACEMENT CHARACTER}"]


def test_it_goes_with_its_experiment(client: TestClient, services: Services, run: dict[str, Any], reports: Reports) -> None:
    LogService(services).append(run["id"], 1, batch(1, "a"))
    client.delete(f"/api/experiments/{run['experiment_id']}")
    reports.state(run, "stopped")
    reports.remove({"id": run["experiment_id"]})

    assert client.get(f"/api/runs/{run['id']}/log").status_code == 404

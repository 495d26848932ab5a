"""The log as an object a line: what, when, how bad, of which run; of the server and of a worker."""

import json
import logging
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from contextlib import closing
from datetime import datetime
from pathlib import Path
from typing import Any

import anyio
import httpx
import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient

from server.services import Services
from server.worker_api.ingest import Report
from server.worker_api.leases import Leases
from server.worker_api.service import WorkerService
from tests.server.harness import BASE_URL, TOKEN, Reports
from tests.server.test_serving import ROOT, environment, serving
from workers.logs import JsonFormatter, about, configure, process_is_about
from workers.protocol import Batch, ClaimRequest, Final, Orders
from workers.runtime.nursery import Nursery
from workers.runtime.nursery_keeper import NurseryKeeper
from workers.runtime.pipe import Job


def line(message: str = "hello %s", *arguments: object, error: BaseException | None = None) -> dict[str, Any]:
    info = (type(error), error, error.__traceback__) if error else None
    record = logging.LogRecord("server.sweeper", logging.WARNING, "f.py", 1, message, arguments, info)
    text = JsonFormatter().format(record)
    assert "\n" not in text
    said: dict[str, Any] = json.loads(text)
    return said


def test_a_line_says_what_when_and_how_bad() -> None:
    said = line("hello %s", "wörld\n")

    assert {key: said[key] for key in ("level", "logger", "message")} == {
        "level": "WARNING",
        "logger": "server.sweeper",
        "message": "hello wörld\n",
    }
    assert abs(datetime.fromisoformat(said["time"]).timestamp() - time.time()) < 60
    assert "run" not in said
    assert "ValueError: no" in line("oh", error=ValueError("no"))["exception"]


def test_a_line_names_the_run_that_it_is_about_on_every_thread_that_works_for_it() -> None:
    async def work() -> str:
        with about("r1"):
            said = await anyio.to_thread.run_sync(line, "on a thread")
        return str(said["run"])

    assert anyio.run(work) == "r1"
    assert "run" not in line("afterwards")
    with process_is_about("r2"):
        found: list[dict[str, Any]] = []
        thread = threading.Thread(target=lambda: found.append(line("on a thread of its own")))
        thread.start()
        thread.join()
    assert found[0]["run"] == "r2"
    assert "run" not in line("afterwards")


@pytest.mark.parametrize("log_format", ["json", "text"])
def test_what_the_server_logs_for_a_run_names_it(tmp_path: Path, log_format: str) -> None:
    log = tmp_path / "log"
    with (
        log.open("wb") as file,
        serving(tmp_path / "data", stderr=file, MAPLESS_LOG_FORMAT=log_format) as (process, url),
    ):
        # A proxy that nobody has told of is worth a line.
        httpx.get(f"{url.partition('/?')[0]}/api/runs/0123456789abcdef", headers={"X-Forwarded-For": "203.0.113.4"})
        process.terminate()
        process.wait(timeout=20)
    lines = log.read_text().splitlines()
    if log_format == "json":
        (said,) = [found for found in map(json.loads, lines) if found["logger"] == "server.security.proxies"]
        assert said["run"] == "0123456789abcdef"
        assert said["level"] == "WARNING"
    else:
        assert any("MAPLESS_TRUSTED_PROXIES" in found and "[run 0123456789abcdef]" in found for found in lines)


def test_a_worker_logs_objects_too(tmp_path: Path) -> None:
    log = tmp_path / "log"
    settings = {
        "MAPLESS_SERVER_URL": "http://127.0.0.1:9",
        "MAPLESS_BROKER_URL": f"sqla+sqlite:///{tmp_path / 'broker.db'}",
        "MAPLESS_WORKER_TOKEN": "a-worker-token-for-tests",
        "MAPLESS_WORK_DIR": str(tmp_path / "work"),
        "MAPLESS_LOG_FORMAT": "json",
    }
    command = [sys.executable, "-m", "workers", "worker", "--concurrency=1"]
    with (
        log.open("wb") as file,
        subprocess.Popen(
            command, cwd=ROOT, env=environment(tmp_path) | settings, stdout=subprocess.DEVNULL, stderr=file
        ) as process,
    ):
        try:
            deadline = time.monotonic() + 60
            while not log.read_text().count("\n"):
                assert time.monotonic() < deadline, "it says nothing"
                assert process.poll() is None
                time.sleep(0.2)
        finally:
            process.terminate()
            process.wait(timeout=30)
    said = [json.loads(found) for found in log.read_text().splitlines()]
    assert {"time", "level", "logger", "message"} <= set(said[0])


def test_what_a_trainer_prints_is_an_object_a_line_too(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "sitecustomize.py").write_text("""print('a "library" says')\nprint('something')\n""")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path))
    root, handlers, level = logging.getLogger(), logging.getLogger().handlers[:], logging.getLogger().level
    try:
        configure("json")
        with closing(NurseryKeeper()) as keeper:
            keeper.keep_running()
            nursery = Nursery(keeper.door)
            nursery.until_ready(120.0)
            with process_is_about("r0"):
                trainer = nursery.trainer()
                nothing: Any = "three"  # no task sends such a seed
                trainer.train(Job("{}", nothing, str(tmp_path), None), lambda _: None, lambda _: None)
                assert trainer.wait(30.0)
                trainer.close()
            nursery.close()
        err = capfd.readouterr().err
    finally:
        root.handlers[:], root.level = handlers, level
        logging.captureWarnings(False)
    said = [json.loads(line) for line in err.splitlines()]
    assert [one["message"] for one in said[:2]] == [
        f'trainers\' nursery {nursery.pid}: a "library" says',
        f"trainers' nursery {nursery.pid}: something",
    ]
    of_the_run = [one["message"] for one in said if one.get("run") == "r0"]
    assert of_the_run[0] == f"trainer {trainer.pid}: Traceback (most recent call last):"


class Lines(logging.Handler):
    """What the server says, as an object a line."""

    def __init__(self) -> None:
        super().__init__()
        self.said: list[dict[str, Any]] = []
        self.setFormatter(JsonFormatter())

    def emit(self, record: logging.LogRecord) -> None:
        self.said.append(json.loads(self.format(record)))


@pytest.fixture
def lines() -> Iterator[Lines]:
    log, lines = logging.getLogger("server"), Lines()
    before = log.level
    log.setLevel(logging.INFO)
    log.addHandler(lines)
    yield lines
    log.removeHandler(lines)
    log.setLevel(before)


def test_attempts_that_begin_end_and_are_lost_are_a_line_each(client: TestClient, services: Services, lines: Lines) -> None:
    run_id = client.post("/api/experiments", json={"name": "a training", "seeds": [7]}).json()["runs"][0]["id"]
    service = WorkerService(services)

    def claim(published: int) -> None:
        service.claim(run_id, ClaimRequest(worker="w@host", published_attempt=published, claim_id=f"{published:032x}"))

    claim(0)
    # Its answer got lost: it is the same attempt.
    claim(0)
    services.leases = Leases(seconds=-1.0)
    service.lose_expired()
    service.lose_expired()
    services.leases = Leases(seconds=15.0)
    claim(1)
    (orders,) = service.receive([Report(run_id, 2, Batch(final=Final(outcome="released")))])
    assert isinstance(orders, Orders)
    claim(2)
    (orders,) = service.receive([Report(run_id, 3, Batch(final=Final(outcome="failed", error="it went wrong")))])

    said = [one for one in lines.said if one["logger"] == "server.worker_api.service"]
    assert [one["message"].removeprefix(f"run {run_id}: ") for one in said] == [
        "attempt 1 begins from the start on w@host",
        "attempt 1 was lost: worker w@host was not heard of for 15 s.",
        "attempt 2 begins from the start on w@host",
        "attempt 2 ended at step 0: released",
        "attempt 3 begins from the start on w@host",
        "attempt 3 ended at step 0: failed: it went wrong",
    ]
    assert {one["run"] for one in said} == {run_id}
    assert [one["level"] for one in said] == ["INFO", "WARNING", "INFO", "INFO", "INFO", "WARNING"]


def test_a_server_that_starts_says_what_it_finds(app: FastAPI, services: Services, lines: Lines) -> None:
    for _ in range(2):
        with TestClient(app, base_url=BASE_URL, headers={"Authorization": f"Bearer {TOKEN}"}) as client:
            runs = client.post("/api/experiments", json={"name": "a training", "seeds": [1, 2]}).json()["runs"]
            Reports(client, services).state(runs[0], "running", attempt=1, worker="w@host")
        services.board.closed = False
    said = [one["message"] for one in lines.said if one["logger"] == "server.sweeper"]
    assert said == [
        "Runs under way: 1. Their workers have 15 s to be heard of; whose is not goes back into the queue.",
        "Runs that wait for a worker: 1.",
    ]

"""`/healthz` says that the process is alive, `/readyz` whether it can work; both are quick whatever is wrong."""

import shutil
import socket
import threading
import time
from collections.abc import Callable

import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient

from server.database.engine import Database
from server.lanes import Lane
from server.services import Services
from server.settings import Settings
from server.system.readiness import ReadinessProbe

SECONDS = 0.5


@pytest.fixture
def checks(app: FastAPI, client: TestClient, services: Services) -> Callable[[], tuple[int, dict[str, str]]]:
    """What `/readyz` answers now, with little patience, once it has been seen to be well."""
    deadline = time.monotonic() + 20
    while services.pulse.age > 10:
        assert time.monotonic() < deadline, "nobody sweeps"
        time.sleep(0.05)

    def ask() -> tuple[int, dict[str, str]]:
        app.state.readiness = ReadinessProbe(services, SECONDS)
        client.headers.pop("Authorization", None)
        response = client.get("/readyz")
        assert client.get("/healthz").json() == {"status": "ok"}
        body = response.json()
        assert body["ready"] == (response.status_code == 200)
        return response.status_code, body["checks"]

    assert ask() == (200, dict.fromkeys(("database", "store", "sweeper", "readers", "workers"), "ok"))
    return ask


def test_a_database_that_is_away(checks: Callable[[], tuple[int, dict[str, str]]], services: Services) -> None:
    with socket.create_server(("127.0.0.1", 0)) as nobody:
        port = nobody.getsockname()[1]
    services.database = Database(f"postgresql+psycopg://mapless:secret@127.0.0.1:{port}/mapless")

    status, found = checks()
    assert (status, found["database"]) == (503, "failed")
    assert "secret" not in str(found)


def test_a_database_that_is_silent(checks: Callable[[], tuple[int, dict[str, str]]], services: Services) -> None:
    # It takes the connection and never says a word.
    with socket.create_server(("127.0.0.1", 0)) as silent:
        port = silent.getsockname()[1]
        services.database = Database(f"postgresql+psycopg://mapless@127.0.0.1:{port}/mapless")
        assert checks() == (503, checks()[1] | {"database": f"no answer within {SECONDS:g} s"})


def test_a_store_that_is_gone(
    checks: Callable[[], tuple[int, dict[str, str]]], services: Services, settings: Settings
) -> None:
    shutil.rmtree(settings.resolved_files_url)

    assert checks()[1]["store"] == "failed"


def test_a_sweeper_that_stands_still(checks: Callable[[], tuple[int, dict[str, str]]], services: Services) -> None:
    services.pulse._last = time.monotonic() - services.settings.lease_seconds - 11

    assert checks()[1]["sweeper"] != "ok"


def test_threads_that_are_all_taken(
    checks: Callable[[], tuple[int, dict[str, str]]], services: Services, client: TestClient
) -> None:
    done = threading.Event()
    assert client.portal is not None
    services.lanes.workers = Lane("workers", threads=1)

    async def hang() -> None:
        await services.lanes.workers.run(done.wait)

    hanging = client.portal.start_task_soon(hang)
    time.sleep(0.2)

    assert checks() == (503, checks()[1] | {"workers": f"no answer within {SECONDS:g} s", "readers": "ok"})
    done.set()
    hanging.result(timeout=10)
    assert checks()[0] == 200


def test_everybody_may_ask_and_the_answer_is_kept_for_a_second(
    checks: Callable[[], tuple[int, dict[str, str]]], client: TestClient, settings: Settings
) -> None:
    checks()
    assert client.get("/readyz").status_code == 200
    shutil.rmtree(settings.resolved_files_url)
    assert client.get("/readyz").status_code == 200
    time.sleep(1.1)
    assert client.get("/readyz").status_code == 503

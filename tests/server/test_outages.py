"""A database, a broker and a store that go away for a while: said once, answered with "come again", and survived."""

import logging
import time
import warnings
from collections.abc import Callable, Iterator
from itertools import pairwise
from types import SimpleNamespace

import pytest
from celery.worker.consumer import Consumer
from fastapi.testclient import TestClient
from sqlalchemy import make_url, text
from starlette.websockets import WebSocketDisconnect

from benchmarks.chaos.proxy import Proxy
from server.doorbell import CeleryDoorbell
from server.errors import DatabaseAwayError
from server.files import FileStore, StoreAwayError
from server.outage import Outage
from server.services import Services
from server.settings import Settings
from tests.conftest import POSTGRES, require_service
from tests.server.harness import WORKER_TOKEN
from tests.server.test_worker_api import claim, link, metrics
from workers.protocol import Batch
from workers.runtime.app import create_app

AWAY_SECONDS = 4.0


def until(condition: Callable[[], object], seconds: float = 15.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.02)


@pytest.fixture
def proxy() -> Iterator[Proxy]:
    require_service("PostgreSQL", *POSTGRES)
    proxy = Proxy(POSTGRES[1])
    yield proxy
    proxy.close()


@pytest.fixture
def settings(settings: Settings, postgres_url: str, proxy: Proxy) -> Settings:
    url = make_url(postgres_url).set(port=proxy.port).render_as_string()
    return settings.model_copy(update={"database_url": url, "lease_seconds": 2.0})


@pytest.mark.services
def test_a_database_that_is_away_is_said_once_and_everybody_is_asked_to_come_again(
    client: TestClient, services: Services, proxy: Proxy, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "server")
    assert client.get("/api/experiments").status_code == 200
    caplog.clear()

    proxy.refuse()
    begun = time.monotonic()
    while time.monotonic() < begun + AWAY_SECONDS:
        for path, headers in (("/api/experiments", {}), ("/api/experiments", {"Authorization": "Bearer mpl_somebody's"})):
            answer = client.get(path, headers=headers)
            assert answer.status_code == 503, answer.text
            assert int(answer.headers["Retry-After"]) >= 1
            assert "try again in a moment" in answer.json()["detail"]
        with pytest.raises(DatabaseAwayError), services.database.write() as session:
            session.execute(text("SELECT 1"))
    assert client.get("/healthz").status_code == 200
    assert client.get("/readyz").status_code == 503
    assert "mapless_database_up 0.0" in client.get("/metrics").text
    proxy.open()
    until(lambda: client.get("/api/experiments").status_code == 200)
    lasted = time.monotonic() - begun
    # What runs beside the requests goes on too.
    until(lambda: services.pulse.age < 1.0)

    gone, back = caplog.records
    assert "can't be reached" in gone.getMessage()
    assert str(proxy.port) in gone.getMessage()
    assert "is back after" in back.getMessage()
    assert (
        AWAY_SECONDS - 1.0 < float(back.getMessage().split(" after ")[1].split(" s")[0]) <= lasted + 0.05
    )  # told in tenths
    assert not any(record.exc_info for record in caplog.records)


@pytest.mark.services
def test_sockets_are_closed_with_try_again_later(client: TestClient, proxy: Proxy, caplog: pytest.LogCaptureFixture) -> None:
    run_id = client.post("/api/experiments", json={"name": "a training", "seeds": [7]}).json()["runs"][0]["id"]
    worker = TestClient(client.app, base_url=str(client.base_url), headers={"Authorization": f"Bearer {WORKER_TOKEN}"})
    worker.portal = client.portal
    attempt = claim(worker, run_id).attempt
    with link(worker, run_id, attempt) as socket:
        assert '"ack":0' in socket.receive_text()
        proxy.refuse()
        socket.send_text(Batch(items=metrics((1, 1))).model_dump_json())
        with pytest.raises(WebSocketDisconnect) as closed:
            socket.receive_text()
    assert closed.value.code == 1013
    with link(worker, run_id, attempt) as socket, pytest.raises(WebSocketDisconnect) as closed:
        socket.receive_text()
    assert closed.value.code == 1013
    live = client.websocket_connect(f"ws://127.0.0.1:8400/live/{run_id}/light/display", headers=dict(client.headers))
    with live as socket, pytest.raises(WebSocketDisconnect) as closed:
        socket.receive_text()
    assert closed.value.code == 1013
    stranger = client.websocket_connect(
        f"ws://127.0.0.1:8400/live/{run_id}/light/display", headers={"Authorization": "Bearer mpl_somebody's"}
    )
    with stranger as socket, pytest.raises(WebSocketDisconnect) as closed:
        socket.receive_text()
    assert closed.value.code == 1013
    proxy.open()
    assert not any(record.exc_info for record in caplog.records)


@pytest.mark.services
def test_a_broker_that_is_away_is_said_once_and_looked_for(caplog: pytest.LogCaptureFixture) -> None:
    require_service("Redis", "127.0.0.1", 6379)
    caplog.set_level(logging.INFO, "server")
    proxy = Proxy(6379)
    bell = CeleryDoorbell(f"redis://127.0.0.1:{proxy.port}/0", "outage-test.")
    try:
        proxy.refuse()
        for _ in range(20):
            bell.ring("a" * 32, 1, "cpu")
            time.sleep(0.05)
        until(lambda: caplog.records)
        proxy.open()
        # Nobody rings meanwhile.
        until(lambda: len(caplog.records) == 2)
    finally:
        bell.close()
        proxy.close()
    gone, back = (record.getMessage() for record in caplog.records)
    assert f"@127.0.0.1:{proxy.port}/0 can't be reached" in gone
    assert "is back after" in back


def test_a_store_that_is_away_is_said_once(caplog: pytest.LogCaptureFixture, monkeypatch: pytest.MonkeyPatch) -> None:
    caplog.set_level(logging.INFO, "server")
    store = FileStore("memory://outage", 1_000, Outage("The store memory://outage"))
    there = store._filesystem.ls

    def nobody(*_: object, **__: object) -> None:
        raise ConnectionError("nobody there")

    monkeypatch.setattr(store._filesystem, "ls", nobody)
    for _ in range(3):
        with pytest.raises(StoreAwayError) as caught:
            store.ping()
        assert caught.value.status == 503
        assert caught.value.retry_after is not None
    monkeypatch.setattr(store._filesystem, "ls", there)
    store.ping()
    gone, back = (record.getMessage() for record in caplog.records)
    assert gone.startswith("The store memory://outage can't be reached: nobody there")
    assert back.startswith("The store memory://outage is back after 0.")


def test_one_asks_at_a_time_and_less_often_the_longer_it_lasts() -> None:
    now = 0.0
    outage = Outage("It", clock=lambda: now)
    assert outage.may_ask()
    assert outage.until_next is None
    outage.gone("nobody there")
    asked = []
    while now < 20.0:
        if outage.may_ask():
            asked.append(now)
            assert not outage.may_ask()
        now += 0.01
    pauses = [after - before for before, after in pairwise(asked)]
    assert pauses[0] < 0.25
    assert max(pauses) < 2.1
    assert len(asked) < 16
    outage.back()
    assert outage.may_ask()


def test_a_worker_reconnects_to_the_broker_for_as_long_as_it_takes() -> None:
    assert create_app("memory://").conf.broker_connection_max_retries is None


def test_a_worker_that_loses_its_broker_prints_no_warning_of_what_celery_will_change() -> None:
    app = create_app("memory://")
    # All that Celery looks at when a connection is lost.
    consumer = SimpleNamespace(app=app, connection=app.connection_for_read(), qos_global=False, max_prefetch_count=1)
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        Consumer.on_connection_error_after_connected(consumer, ConnectionResetError("gone"))
    assert not [warning for warning in said if issubclass(warning.category, PendingDeprecationWarning)]

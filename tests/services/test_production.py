"""The same code on PostgreSQL with Redis, and on RabbitMQ: launched, trained, stopped, resumed."""

import uuid
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import require_service
from tests.services.stack import ROLLOUT, Service, assert_one_unbroken_curve, until
from workers.runtime.app import create_app

RABBITMQ_URL = "amqp://guest:guest@127.0.0.1:5672//"


@pytest.fixture
def queue_prefix() -> Iterator[str]:
    """For queues on RabbitMQ that no other test has, and that are gone after the test."""
    require_service("RabbitMQ", "127.0.0.1", 5672)
    prefix = f"mapless-test-{uuid.uuid4().hex[:12]}."
    yield prefix
    with create_app(RABBITMQ_URL).connection_for_write() as connection:
        for name in ("cpu", "gpu"):
            connection.default_channel.queue_delete(prefix + name)
            connection.default_channel.exchange_delete(prefix + name)


def train_stop_resume(service: Service) -> None:
    service.start_server()
    service.start_worker()
    (run_id,) = service.launch(20 * ROLLOUT, save_every=2 * ROLLOUT)
    until(lambda: service.checkpoints(run_id))
    service.stop(run_id)
    service.api.post(f"/api/runs/{run_id}/resume").raise_for_status()
    assert service.until_state(run_id, "completed")["step"] == 20 * ROLLOUT
    assert service.run(run_id)["attempt"] == 2
    assert_one_unbroken_curve(service, run_id)


@pytest.mark.services
def test_postgresql_and_redis_carry_the_whole_path(tmp_path: Path, empty_postgres_url: str, redis_url: str) -> None:
    service = Service(tmp_path, MAPLESS_DATABASE_URL=empty_postgres_url, MAPLESS_BROKER_URL=redis_url)
    try:
        train_stop_resume(service)
    finally:
        service.close()
    assert not (tmp_path / "data" / "mapless.db").exists()
    assert not (tmp_path / "data" / "broker.db").exists()


@pytest.mark.services
def test_rabbitmq_rings_too(tmp_path: Path, queue_prefix: str) -> None:
    service = Service(tmp_path, MAPLESS_BROKER_URL=RABBITMQ_URL, MAPLESS_QUEUE_PREFIX=queue_prefix)
    try:
        service.start_server()
        service.start_worker()
        (run_id,) = service.launch(2 * ROLLOUT)
        service.until_state(run_id, "completed")
    finally:
        service.close()

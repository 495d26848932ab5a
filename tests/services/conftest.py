"""A service of its own for each test, and a broker beside it."""

from collections.abc import Iterator
from pathlib import Path

import pytest
import redis

from tests.conftest import require_service
from tests.services.ceph import ObjectStore, object_store
from tests.services.stack import Service

# Databases of a Redis on its standard port that tests may have; the first one that is empty is taken.
REDIS_DATABASES = range(15, 8, -1)


@pytest.fixture
def service(tmp_path: Path) -> Iterator[Service]:
    service = Service(tmp_path)
    yield service
    service.close()


@pytest.fixture(scope="module")
def running(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Service]:
    """One with a server and a worker, which the tests of a module share; each stops the runs that it has launched."""
    service = Service(tmp_path_factory.mktemp("running"))
    service.start_server()
    service.start_worker()
    yield service
    service.close()


@pytest.fixture(scope="session")
def ceph(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ObjectStore]:
    """One for all tests: fsspec keeps the address that it was told first."""
    with object_store(tmp_path_factory.mktemp("ceph")) as store:
        yield store


@pytest.fixture
def redis_url() -> Iterator[str]:
    """URL of an empty Redis database that is emptied again after the test."""
    require_service("Redis", "127.0.0.1", 6379)
    for number in REDIS_DATABASES:
        client = redis.Redis(port=6379, db=number)
        if client.dbsize() == 0:
            yield f"redis://127.0.0.1:6379/{number}"
            client.flushdb()
            client.close()
            return
        client.close()
    pytest.fail("no Redis database from 9 to 15 is empty: empty one of them")

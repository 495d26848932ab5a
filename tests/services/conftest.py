"""A service of its own for each test."""

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.services.stack import Service


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

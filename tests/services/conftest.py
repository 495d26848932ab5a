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

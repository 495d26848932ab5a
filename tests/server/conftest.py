"""A service on a database of its own, and a browser that is logged in to it."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from server.app import create_app
from server.services import Services
from server.settings import Settings

TOKEN = "a-login-token-for-tests"
WORKER_TOKEN = "a-worker-token-for-tests"


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings(data_dir=tmp_path / "data", token=TOKEN, worker_token=WORKER_TOKEN, web_dist=tmp_path / "dist")


@pytest.fixture
def client(settings: Settings) -> Iterator[TestClient]:
    """Logged in by its Authorization header."""
    with TestClient(create_app(settings), base_url="http://127.0.0.1:8400") as client:
        client.headers["Authorization"] = f"Bearer {TOKEN}"
        yield client


@pytest.fixture
def services(client: TestClient) -> Services:
    services: Services = client.app.state.services  # type: ignore[attr-defined]
    return services

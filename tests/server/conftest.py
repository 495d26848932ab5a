"""A service on a database of its own, and a browser that is logged in to it."""

import math
import shutil
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from fastapi import FastAPI
from fastapi.testclient import TestClient

from server.app import create_app
from server.database.engine import Database
from server.database.migrate import upgrade
from server.services import Services
from server.settings import Settings
from tests.server.harness import BASE_URL, TOKEN, WORKER_TOKEN, Reports
from tests.server.job_worker import working


@pytest.fixture
def settings(tmp_path: Path) -> Settings:
    return Settings.model_validate(
        {"data_dir": tmp_path / "data", "token": TOKEN, "worker_token": WORKER_TOKEN, "web_dist": tmp_path / "dist"}
    )


@pytest.fixture(scope="session")
def new_database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A SQLite database with this version's tables and nothing in them."""
    path = tmp_path_factory.mktemp("database") / "mapless.db"
    database = Database(f"sqlite:///{path}")
    upgrade(database)
    database.dispose()
    return path


@pytest.fixture
def app(settings: Settings, new_database: Path) -> FastAPI:
    """Its migrations were run once, for all tests."""
    if settings.database_url is None:
        settings.data_dir.mkdir()
        shutil.copy(new_database, settings.data_dir)
    return create_app(settings)


@pytest.fixture
def client(app: FastAPI) -> Iterator[TestClient]:
    """Logged in by its Authorization header; the first sweep, which rings for all that waits, is through."""
    with TestClient(app, base_url=BASE_URL, headers={"Authorization": f"Bearer {TOKEN}"}) as client:
        deadline = time.monotonic() + 10.0
        while math.isinf(app.state.services.pulse.age) and time.monotonic() < deadline:
            time.sleep(0.005)
        yield client


@pytest.fixture
def services(app: FastAPI) -> Services:
    services: Services = app.state.services
    return services


@pytest.fixture
def job_worker(client: TestClient, services: Services, tmp_path: Path) -> Iterator[None]:
    """A worker that does jobs, with places as `mapless worker` has them."""
    with working(client, services, tmp_path / "work"):
        yield


@pytest.fixture
def reports(client: TestClient, services: Services) -> Reports:
    """Stands in for the workers."""
    return Reports(client, services)

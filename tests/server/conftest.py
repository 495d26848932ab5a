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
from server.doorbell import prepare_broker
from server.services import Services
from server.settings import Settings
from tests.server.harness import BASE_URL, TOKEN, WORKER_TOKEN, Reports
from tests.server.job_worker import working


@pytest.fixture(scope="session")
def new_broker(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The embedded broker's file with its tables, to be copied."""
    path = tmp_path_factory.mktemp("broker") / "broker.db"
    prepare_broker(f"sqla+sqlite:///{path}", "")
    return path


@pytest.fixture
def settings(tmp_path: Path, new_database: Path, new_broker: Path) -> Settings:
    """Of a service that has been started once: its tables were made for all tests together."""
    directory = tmp_path / "data"
    directory.mkdir()
    for file in (new_database, new_broker):
        shutil.copy(file, directory)
    return Settings.model_validate(
        {"data_dir": directory, "token": TOKEN, "worker_token": WORKER_TOKEN, "web_dist": tmp_path / "dist"}
    )


@pytest.fixture
def app(settings: Settings) -> FastAPI:
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

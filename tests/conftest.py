"""Fixtures that tests of several packages share."""

import gc
import os
import shutil
import socket
import subprocess
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from hypothesis import settings
from kombu.transport.sqlalchemy import Channel

from server.database.engine import Database
from server.database.migrate import upgrade
from sim.actions import action_layout
from sim.config import TaskConfig
from sim.observations import observation_layout
from tests import postgres
from tests.nursery import keeper
from workers.checkpoints import Checkpoint, write_checkpoint
from workers.config import MlpNetwork, Network, PpoConfig, TrainingConfig
from workers.manifest import EvaluationSummary, Manifest, Number, Observation, TrainingCounters
from workers.networks.inputs import inputs_of
from workers.networks.layout import layout, policy_shapes

POSTGRES = (postgres.HOST, postgres.PORT)

# How long an example takes says something of the machine, nothing of the code.
settings.register_profile("mapless", deadline=None)
settings.load_profile("mapless")


def pytest_collection_finish() -> None:
    """What was imported and collected stays to the end: looking through it for garbage took a sixth of the tests' time.

    What comes and goes is looked through as often as in the server (`server.processes.settling`).
    """
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000, 10, 10)


@pytest.fixture(autouse=True, scope="module")
def brokers_are_left() -> Iterator[None]:
    """kombu keeps the files of embedded brokers open for as long as the process lasts: thousands, of servers that ended."""
    yield
    for engine, _ in Channel._engines.values():
        engine.dispose()
    Channel._engines.clear()


@pytest.fixture(autouse=True)
def umask_of_before() -> Iterator[None]:
    """Commands set it for a process of their own; where a test runs one in this process, later tests have it as it was."""
    before = os.umask(0o022)
    os.umask(before)
    yield
    os.umask(before)


def require_service(name: str, host: str, port: int) -> None:
    """Skip the test where nobody listens; with REQUIRE_SERVICES=1 that is an error: CI must have run it."""
    try:
        socket.create_connection((host, port), timeout=2).close()
    except OSError as error:
        _lack(f"{name} does not answer on {host}:{port}: {error}")


def require_program(name: str) -> None:
    """Skip the test where a program is not installed; with REQUIRE_SERVICES=1 that is an error: CI must have run it."""
    if shutil.which(name) is None:
        _lack(f"{name} is not installed")


def require_mounts() -> None:
    """Skip the test where no namespace with mounts of its own is to be had; with REQUIRE_SERVICES=1 that is an error."""
    if os.geteuid() != 0 or subprocess.run(["unshare", "-m", "true"], capture_output=True, check=False).returncode:
        _lack("mounting takes root")


def _lack(message: str) -> None:
    if os.environ.get("REQUIRE_SERVICES") == "1":
        pytest.fail(message)
    pytest.skip(message)


@pytest.fixture(scope="session")
def let_go() -> Iterator[Callable[[str], None]]:
    """Drops databases of PostgreSQL while the next tests run: its disk takes a second for each."""
    dropped: list[Future[None]] = []
    with ThreadPoolExecutor(1) as thread:
        yield lambda name: dropped.append(thread.submit(postgres.drop, name))
    for each in dropped:
        each.result()


@pytest.fixture(scope="session")
def new_database(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A SQLite database with this version's tables and nothing in them, to be copied: migrations take a while."""
    path = tmp_path_factory.mktemp("database") / "mapless.db"
    database = Database(f"sqlite:///{path}")
    upgrade(database)
    database.dispose()
    return path


@pytest.fixture(scope="session")
def postgres_pool() -> Iterator[postgres.Pool]:
    """Such databases of PostgreSQL."""
    require_service("PostgreSQL", *POSTGRES)
    pool = postgres.Pool()
    yield pool
    pool.close()


@pytest.fixture
def empty_postgres_url(let_go: Callable[[str], None]) -> Iterator[str]:
    """SQLAlchemy URL of a PostgreSQL database without tables that is gone after the test."""
    require_service("PostgreSQL", *POSTGRES)
    name = postgres.create()
    yield postgres.url_of(name)
    let_go(name)


@pytest.fixture
def postgres_url(postgres_pool: postgres.Pool) -> Iterator[str]:
    """SQLAlchemy URL of a PostgreSQL database with this version's tables that nobody has after the test."""
    name = postgres_pool.take()
    yield postgres.url_of(name)
    postgres_pool.give_back(name)


@pytest.fixture
def nursery_door() -> int:
    """To the tests' nursery."""
    return keeper().door


BOTH_KINDS = ["sqlite", pytest.param("postgresql", marks=pytest.mark.services)]


@pytest.fixture(params=BOTH_KINDS)
def database_url(request: pytest.FixtureRequest, tmp_path: Path, new_database: Path) -> str:
    """SQLAlchemy URL of a database with this version's tables: what asks for it runs on both kinds."""
    if request.param == "sqlite":
        return f"sqlite:///{shutil.copy(new_database, tmp_path / 'test.db')}"
    url: str = request.getfixturevalue("postgres_url")
    return url


@pytest.fixture(params=BOTH_KINDS)
def empty_database_url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    """SQLAlchemy URL of a database without tables, of both kinds."""
    if request.param == "sqlite":
        return f"sqlite:///{tmp_path / 'test.db'}"
    url: str = request.getfixturevalue("empty_postgres_url")
    return url


@pytest.fixture
def make_checkpoint(tmp_path: Path) -> Callable[..., Path]:
    """Writes an archive of a policy with random weights, large enough for actions to be spread over their range."""

    def make(network: Network | None = None, task: TaskConfig | None = None) -> Path:
        network, task = network or MlpNetwork(hidden_sizes=(16,)), task or TaskConfig()
        numbers = observation_layout(task)
        manifest = Manifest(
            training=TrainingConfig(task=task, algorithm=PpoConfig(network=network)),
            seed=4,
            step=81_920,
            observation=Observation(
                name=numbers.name,
                version=numbers.version,
                numbers=tuple(
                    Number(index=index, name=number.name, meaning=number.formula, low=number.low, high=number.high)
                    for index, number in enumerate(numbers.numbers)
                ),
            ),
            action=(),
            network=layout(network, inputs_of(task), action_layout(task.robot)),
            evaluation=EvaluationSummary(suite="simple-200", suite_hash="0f" * 32, episodes=200, arrivals=198),
            versions={},
            files={},
        )
        rng = np.random.default_rng(4)
        weights = {
            name: rng.normal(scale=1.2 / np.sqrt(shape[-1]), size=shape).astype(np.float32)
            for name, shape in policy_shapes(network, inputs_of(task), action_layout(task.robot)).items()
        }
        archive = tmp_path / "checkpoint.zip"
        counters = TrainingCounters(step=81_920, updates=20, evaluations=1)
        write_checkpoint(archive, Checkpoint(manifest, weights, {"none": np.zeros(1)}, counters))
        return archive

    return make

"""A claim asks as little of the database for a long run as for a short one: all who write wait for it."""

import uuid
from collections.abc import Iterator

import numpy as np
import pytest

from server.app import create_services
from server.checkpoints.repository import CheckpointRepository
from server.database import tables
from server.files import StoredFile
from server.metrics.points import Points
from server.metrics.repository import MetricRepository
from server.services import Services
from server.settings import Settings
from server.system.repository import WorkerRepository
from server.worker_api.service import WorkerService
from tests.server.statements import statements
from workers.config import TrainingConfig
from workers.protocol import ClaimRequest

MOST = 22
"""Statements of a claim that takes a run back to its checkpoint."""
MOST_OF_A_FRESH_ONE = 15
CHECKPOINTS = 30


@pytest.fixture
def services(settings: Settings, database_url: str) -> Iterator[Services]:
    services = create_services(settings.model_copy(update={"database_url": database_url}))
    with services.database.write() as session:
        session.add(tables.Experiment(id="e", name="x", training=TrainingConfig().model_dump(mode="json")))
        WorkerRepository(session).seen("w", "cpu", 1.0)
    yield services
    services.database.dispose()


def add_run(services: Services, run_id: str, points: int) -> None:
    """A run of four series that waits to go on from the last of its checkpoints, beyond which it has reported."""
    steps = np.arange(1, points + 1, dtype=np.int64)
    series = {f"s{at}": Points(steps, steps / 2, np.full(points, at, np.float32)) for at in range(4)}
    last = slice(points - 1, points)
    series["table/reward"] = Points(steps[last], steps[last] / 2, np.ones(1, np.float32))
    with services.database.write() as session:
        session.add(tables.Run(id=run_id, experiment_id="e", seed=0, attempt=1, step=points, last_seq=points))
        session.flush()
        MetricRepository(session).add_series(run_id, series)
        for number in range(1, CHECKPOINTS + 1):
            file = StoredFile(id=f"{run_id}{number}", size=1, sha256="0" * 64)
            CheckpointRepository(session).add(run_id, int(0.9 * points) * number // CHECKPOINTS, file, None)


def claim(services: Services, run_id: str, attempt: int, *, any_run: bool = False) -> list[str]:
    request = ClaimRequest(worker="w", published_attempt=attempt, any_run=any_run, claim_id=uuid.uuid4().hex)
    with statements(services.database) as asked:
        assert WorkerService(services).claim(run_id, request).run_id == run_id
    return asked


def test_a_claim_takes_as_few_statements_for_a_long_run_as_for_a_short_one(services: Services) -> None:
    add_run(services, "short", 1_000)
    add_run(services, "long", 40_000)

    assert len(claim(services, "short", 1)) <= MOST
    assert len(claim(services, "long", 1)) <= MOST
    with services.database.read() as session:
        left = MetricRepository(session).read("long", ["s3", "table/reward"])
        latest = {row.name: (row.step, row.value) for row in session.query(tables.LatestMetric).filter_by(run_id="long")}
    assert left["s3"].steps[-1] == 36_000
    assert "table/reward" not in left
    assert latest == {f"s{at}": (36_000, float(at)) for at in range(4)}


def test_whoever_takes_any_run_asks_three_times_more(services: Services) -> None:
    add_run(services, "long", 40_000)

    assert len(claim(services, "long", 1, any_run=True)) <= MOST + 3


def test_a_run_that_has_never_been_claimed_takes_fewer(services: Services) -> None:
    with services.database.write() as session:
        session.add(tables.Run(id="new", experiment_id="e", seed=0))

    assert len(claim(services, "new", 0)) <= MOST_OF_A_FRESH_ONE


def test_only_the_checkpoint_that_is_gone_on_from_is_read(services: Services) -> None:
    add_run(services, "r", 100)
    with services.database.read() as session:
        checkpoint = CheckpointRepository(session).last("r")
        assert checkpoint is not None
        assert checkpoint.step == 90
        assert sum(isinstance(row, tables.Checkpoint) for row in session.identity_map.values()) == 1

"""A machine under load takes its time to start a job's process, and keeps the job meanwhile."""

import contextlib
import os
import signal
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from fastapi.testclient import TestClient

from server.jobs.asked import Asked
from server.jobs.service import JobService
from server.policies.service import shipped_hash
from server.services import Services
from server.settings import Settings
from tests.server.job_worker import working
from workers.job_protocol import ReplayJob, ShippedPolicyName
from workers.runtime.nursery import Nursery

# The imports of what processes are forked from take a while where nothing else has needed them.
pytestmark = pytest.mark.timeout(180)

LEASE = 2.0


@pytest.fixture
def settings(settings: Settings) -> Settings:
    return settings.model_copy(update={"lease_seconds": LEASE})


def wait_until(true: Callable[[], bool], seconds: float = 90.0) -> None:
    deadline = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < deadline
        time.sleep(0.02)


@pytest.fixture
def standing_nursery(nursery_door: int) -> Iterator[Callable[[], None]]:
    """What processes are forked from stands still, as where the machine has no time for its imports; called, it goes on."""
    nursery = Nursery(nursery_door)
    nursery.until_ready(120.0)
    pid = nursery.pid
    nursery.close()
    assert pid is not None
    os.kill(pid, signal.SIGSTOP)
    yield lambda: os.kill(pid, signal.SIGCONT)
    with contextlib.suppress(ProcessLookupError):
        os.kill(pid, signal.SIGCONT)


@pytest.fixture
def job(services: Services, client: TestClient) -> str:
    spec = ReplayJob(policy=ShippedPolicyName(name="simple"))
    return JobService(services).ask(Asked(spec, "one", "A policy", shipped_hash("simple")))


def test_a_job_whose_process_is_slow_to_start_keeps_its_lease(
    client: TestClient, services: Services, job: str, standing_nursery: Callable[[], None], tmp_path: Path
) -> None:
    jobs = JobService(services)
    with working(client, services, tmp_path / "work", ("replay",)):
        try:
            wait_until(lambda: jobs.find(job).state == "running")
            # The sweeper of the application looks meanwhile.
            time.sleep(1.6 * LEASE)
            found = jobs.find(job)
            assert (found.state, found.attempt, found.losses) == ("running", 1, 0)
        finally:
            standing_nursery()
        wait_until(lambda: jobs.find(job).state not in ("queued", "running"))
    found = jobs.find(job)
    assert (found.state, found.attempt) == ("done", 1), found.error

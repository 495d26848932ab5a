"""Runs are not forgotten: leases that run out, messages that got lost, and servers that were away."""

import asyncio
import time

import pytest
from sqlalchemy import select

from server.app import create_services
from server.database import tables
from server.runs.repository import RunRepository
from server.services import Services
from server.settings import Settings
from server.sweeper import RING_AGAIN_SECONDS, Sweeper, dispatch
from server.worker_api.service import WorkerService
from workers.config import TrainingConfig
from workers.protocol import ClaimRequest, Heartbeat, Queue

LEASE = 15.0


class Bell:
    """Remembers who was rung."""

    def __init__(self) -> None:
        self.rings: list[tuple[str, int, Queue]] = []

    def ring(self, run_id: str, attempt: int, queue: Queue) -> None:
        self.rings.append((run_id, attempt, queue))

    def heard(self) -> list[str]:
        heard = [run_id for run_id, _, _ in self.rings]
        self.rings.clear()
        return heard


@pytest.fixture
def services(settings: Settings) -> Services:
    """Without the application around it: here the clock is the test's."""
    services = create_services(settings)
    services.doorbell = Bell()
    return services


@pytest.fixture
def bell(services: Services) -> Bell:
    assert isinstance(services.doorbell, Bell)
    return services.doorbell


@pytest.fixture
def sweeper(services: Services) -> Sweeper:
    return Sweeper(services)


@pytest.fixture
def now() -> float:
    return time.time()


def add_run(services: Services, run_id: str, queued_at: float, device: str = "cpu") -> None:
    training = TrainingConfig().model_copy(update={"device": device}).model_dump(mode="json")
    with services.database.write() as session:
        session.add(tables.Experiment(id=f"of-{run_id}", name="x", training=training))
        session.flush()
        session.add(tables.Run(id=run_id, experiment_id=f"of-{run_id}", seed=0, queued_at=queued_at))


def claim(services: Services, run_id: str, attempt: int = 0, worker: str = "w") -> None:
    WorkerService(services).claim(run_id, ClaimRequest(worker=worker, published_attempt=attempt))


def see_worker(services: Services, name: str, queue: Queue = "cpu") -> None:
    WorkerService(services).heartbeat(Heartbeat(worker=name, queue=queue))


def run_of(services: Services, run_id: str) -> tables.Run:
    with services.database.read() as session:
        return RunRepository(session).get(run_id)


def test_a_run_whose_worker_is_silent_goes_back_to_the_queue_and_is_rung(
    services: Services, sweeper: Sweeper, bell: Bell, now: float
) -> None:
    add_run(services, "r", now)
    sweeper.sweep(now)
    claim(services, "r")
    bell.heard()
    for elapsed in (3, 6, 9, 12, 14):
        sweeper.sweep(now + elapsed)
    assert run_of(services, "r").state == "running"
    sweeper.sweep(now + LEASE + 2)
    run = run_of(services, "r")
    assert (run.state, run.attempt, run.losses, run.worker) == ("queued", 1, 1, None)
    assert run.error is not None
    assert "worker w was not heard of for 15 s" in run.error
    assert bell.rings == [("r", 1, "cpu")]


def test_three_silent_workers_in_a_row_fail_the_run_with_the_reason_of_each(
    services: Services, sweeper: Sweeper, now: float
) -> None:
    add_run(services, "r", now)
    sweeper.sweep(now)
    for attempt in range(3):
        claim(services, "r", attempt, worker=f"w{attempt}")
        with services.database.write() as session:
            RunRepository(session).get("r").lease_until = now - 1
        sweeper.sweep(now + attempt + 1)
    run = run_of(services, "r")
    assert run.state == "failed"
    assert run.finished_at is not None
    assert run.error is not None
    assert [f"worker w{attempt} was not heard of" in run.error for attempt in range(3)] == [True] * 3
    with services.database.read() as session:
        levels = [event.level for event in session.scalars(select(tables.RunEvent)).all()]
    assert levels.count("warning") == 3
    assert levels.count("error") == 1


def test_a_run_that_was_to_stop_is_stopped_when_its_worker_falls_silent(
    services: Services, sweeper: Sweeper, bell: Bell, now: float
) -> None:
    add_run(services, "r", now)
    sweeper.sweep(now)
    bell.heard()
    claim(services, "r")
    with services.database.write() as session:
        run = RunRepository(session).get("r")
        run.state, run.lease_until = "stopping", now - 1
    sweeper.sweep(now + 1)
    assert run_of(services, "r").state == "stopped"
    assert bell.heard() == []


@pytest.mark.parametrize("away", ["at start", "in between"])
def test_a_server_that_was_away_gives_the_workers_time_to_come_back(
    services: Services, sweeper: Sweeper, now: float, away: str
) -> None:
    add_run(services, "r", now)
    claim(services, "r")
    if away == "in between":
        sweeper.sweep(now)
    back = now + 3_600
    sweeper.sweep(back)
    assert run_of(services, "r").state == "running"
    assert run_of(services, "r").lease_until == pytest.approx(back + LEASE)
    for elapsed in range(3, int(LEASE) + 6, 3):
        sweeper.sweep(back + elapsed)
    assert run_of(services, "r").state == "queued"


def test_at_start_everything_that_waits_is_rung_once(services: Services, sweeper: Sweeper, bell: Bell, now: float) -> None:
    for name in ("a", "b", "c"):
        add_run(services, name, now - 1_000)
    sweeper.sweep(now)
    assert sorted(bell.heard()) == ["a", "b", "c"]
    sweeper.sweep(now + 3)
    assert bell.heard() == []


def test_a_lost_message_is_sent_again_while_a_worker_is_idle(
    services: Services, sweeper: Sweeper, bell: Bell, now: float
) -> None:
    sweeper.sweep(now)
    for age, name in enumerate(("youngest", "middle", "oldest")):
        add_run(services, name, now - age)
    sweeper.sweep(now + RING_AGAIN_SECONDS + 1 - 5)
    assert bell.heard() == []  # nobody is idle
    see_worker(services, "w1")
    see_worker(services, "w2")
    sweeper.sweep(now + RING_AGAIN_SECONDS + 1)
    assert bell.heard() == ["oldest", "middle"]  # one for each worker that could take it
    claim(services, "oldest", worker="w1")
    claim(services, "middle", worker="w2")
    sweeper.sweep(now + RING_AGAIN_SECONDS + 2)
    assert bell.heard() == []


def test_each_queue_is_rung_for_its_own_workers(services: Services, sweeper: Sweeper, bell: Bell, now: float) -> None:
    sweeper.sweep(now - 5)
    add_run(services, "on-cpu", now - 60)
    add_run(services, "on-gpu", now - 60, device="cuda")
    see_worker(services, "w", "gpu")
    sweeper.sweep(now)
    assert bell.rings == [("on-gpu", 0, "gpu")]


def test_a_run_with_settings_of_another_version_keeps_no_other_from_being_rung(
    services: Services, sweeper: Sweeper, bell: Bell, now: float
) -> None:
    add_run(services, "odd", now - 100)
    with services.database.write() as session:
        RunRepository(session).get("odd").experiment.training = {"algorithm": "of another time"}
    add_run(services, "waits", now - 50)
    sweeper.sweep(now)
    assert bell.heard() == ["odd", "waits"]  # and whoever takes up the odd one hears why it can't be trained


def test_a_sweep_that_breaks_is_not_the_last(settings: Settings) -> None:
    services = create_services(settings.model_copy(update={"lease_seconds": 0.5}))
    now = time.time()
    add_run(services, "waits", now)
    add_run(services, "silent", now)
    claim(services, "silent")

    class BrokenBell(Bell):
        def ring(self, run_id: str, attempt: int, queue: Queue) -> None:
            super().ring(run_id, attempt, queue)
            raise RuntimeError("what nobody has thought of")

    async def sweeping() -> None:
        async with dispatch(services):
            services.doorbell = bell = BrokenBell()
            deadline = time.monotonic() + 20
            while run_of(services, "silent").state == "running":
                assert time.monotonic() < deadline
                await asyncio.sleep(0.05)
            assert "waits" in bell.heard()

    asyncio.run(sweeping())

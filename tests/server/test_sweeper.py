"""Runs are not forgotten: leases that run out, messages that got lost, and servers that were away."""

import asyncio
import time
from collections.abc import Iterator

import pytest
from sqlalchemy import select

from server.app import create_services
from server.database import tables
from server.runs.repository import RunRepository
from server.services import Services
from server.settings import Settings
from server.sweeper import RING_AGAIN_SECONDS, Sweeper, dispatch
from server.worker_api.leases import Leases
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


class Clock:
    """Seconds that pass when the test says so."""

    def __init__(self) -> None:
        self.now = 1_000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def settings(settings: Settings, database_url: str) -> Settings:
    """On both kinds of database."""
    return settings.model_copy(update={"database_url": database_url})


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def services(settings: Settings, clock: Clock) -> Iterator[Services]:
    """Without the application around it: here the clock is the test's."""
    services = create_services(settings)
    services.doorbell = Bell()
    services.leases = Leases(LEASE, clock)
    yield services
    services.database.dispose()


@pytest.fixture
def bell(services: Services) -> Bell:
    assert isinstance(services.doorbell, Bell)
    return services.doorbell


@pytest.fixture
def sweeper(services: Services, clock: Clock) -> Sweeper:
    return Sweeper(services, clock)


def add_run(services: Services, run_id: str, age: float = 0.0, device: str = "cpu") -> None:
    training = TrainingConfig().model_copy(update={"device": device}).model_dump(mode="json")
    with services.database.write() as session:
        session.add(tables.Experiment(id=f"of-{run_id}", name="x", training=training))
        session.flush()
        session.add(tables.Run(id=run_id, experiment_id=f"of-{run_id}", seed=0, queued_at=time.time() - age))


def claim(services: Services, run_id: str, attempt: int = 0, worker: str = "w") -> None:
    WorkerService(services).claim(run_id, ClaimRequest(worker=worker, published_attempt=attempt))


def see_worker(services: Services, name: str, queue: Queue = "cpu") -> None:
    WorkerService(services).heartbeat(Heartbeat(worker=name, queue=queue))


def run_of(services: Services, run_id: str) -> tables.Run:
    with services.database.read() as session:
        return RunRepository(session).get(run_id)


def pass_by(sweeper: Sweeper, clock: Clock, seconds: float) -> None:
    """Time passes, and is swept through."""
    end = clock.now + seconds
    while clock.now < end:
        clock.now = min(end, clock.now + sweeper.interval)
        sweeper.sweep()


def test_a_run_whose_worker_is_silent_goes_back_to_the_queue_and_is_rung(
    services: Services, sweeper: Sweeper, bell: Bell, clock: Clock
) -> None:
    add_run(services, "r")
    sweeper.sweep()
    claim(services, "r")
    bell.heard()
    pass_by(sweeper, clock, LEASE - 0.1)
    assert run_of(services, "r").state == "running"
    pass_by(sweeper, clock, 0.2)
    run = run_of(services, "r")
    assert (run.state, run.attempt, run.losses, run.worker) == ("queued", 1, 1, None)
    assert run.error is not None
    assert "worker w was not heard of for 15 s" in run.error
    assert bell.rings == [("r", 1, "cpu")]


@pytest.mark.parametrize("hours", [-1, 1])
def test_the_wall_clock_may_be_set_and_leases_last_as_long_as_they_do(
    services: Services, sweeper: Sweeper, clock: Clock, monkeypatch: pytest.MonkeyPatch, hours: int
) -> None:
    add_run(services, "dead")
    add_run(services, "alive")
    sweeper.sweep()
    claim(services, "dead")
    claim(services, "alive")
    wall = time.time
    monkeypatch.setattr(time, "time", lambda: wall() + 3_600 * hours)
    pass_by(sweeper, clock, LEASE / 2)
    services.leases.renew("alive", 1)
    pass_by(sweeper, clock, LEASE / 2 + 0.1)
    assert run_of(services, "dead").state == "queued"
    assert run_of(services, "alive").state == "running"


def test_what_an_earlier_attempt_still_says_prolongs_no_other_ones_lease(
    services: Services, sweeper: Sweeper, clock: Clock
) -> None:
    add_run(services, "r")
    claim(services, "r")
    pass_by(sweeper, clock, LEASE + 3)
    claim(services, "r", attempt=1)
    for _ in range(10):
        services.leases.renew("r", 1)
        pass_by(sweeper, clock, LEASE / 8)
    assert run_of(services, "r").state == "queued"


def test_three_silent_workers_in_a_row_fail_the_run_with_the_reason_of_each(
    services: Services, sweeper: Sweeper, clock: Clock
) -> None:
    add_run(services, "r")
    sweeper.sweep()
    for attempt in range(3):
        claim(services, "r", attempt, worker=f"w{attempt}")
        pass_by(sweeper, clock, LEASE + 1)
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
    services: Services, sweeper: Sweeper, bell: Bell, clock: Clock
) -> None:
    add_run(services, "r")
    sweeper.sweep()
    bell.heard()
    claim(services, "r")
    with services.database.write() as session:
        RunRepository(session).get("r").state = "stopping"
    pass_by(sweeper, clock, LEASE + 1)
    assert run_of(services, "r").state == "stopped"
    assert bell.heard() == []


def test_a_server_that_starts_gives_the_workers_time_to_come_back(services: Services, clock: Clock) -> None:
    add_run(services, "r")
    claim(services, "r")
    services.leases = Leases(LEASE, clock)  # as of a new process
    sweeper = Sweeper(services, clock)
    sweeper.sweep()
    pass_by(sweeper, clock, LEASE - 0.1)
    assert run_of(services, "r").state == "running"
    pass_by(sweeper, clock, 0.2)
    assert run_of(services, "r").state == "queued"


def test_a_server_that_was_away_in_between_gives_the_workers_time_to_come_back(
    services: Services, sweeper: Sweeper, clock: Clock
) -> None:
    add_run(services, "r")
    claim(services, "r")
    sweeper.sweep()
    clock.now += 3_600
    sweeper.sweep()
    pass_by(sweeper, clock, LEASE - 0.1)
    assert run_of(services, "r").state == "running"
    pass_by(sweeper, clock, 0.2)
    assert run_of(services, "r").state == "queued"


def test_at_start_everything_that_waits_is_rung_once(services: Services, sweeper: Sweeper, bell: Bell, clock: Clock) -> None:
    for name in ("a", "b", "c"):
        add_run(services, name, age=1_000)
    sweeper.sweep()
    assert sorted(bell.heard()) == ["a", "b", "c"]
    pass_by(sweeper, clock, 3)
    assert bell.heard() == []


def test_a_lost_message_is_sent_again_while_a_worker_is_idle(
    services: Services, sweeper: Sweeper, bell: Bell, clock: Clock
) -> None:
    sweeper.sweep()
    for age, name in enumerate(("youngest", "middle", "oldest")):
        add_run(services, name, age)
    pass_by(sweeper, clock, RING_AGAIN_SECONDS + 4)
    assert bell.heard() == []  # nobody is idle
    see_worker(services, "w1")
    see_worker(services, "w2")
    pass_by(sweeper, clock, 1)
    assert bell.heard() == ["oldest", "middle"]  # one for each worker that could take it
    claim(services, "oldest", worker="w1")
    claim(services, "middle", worker="w2")
    pass_by(sweeper, clock, RING_AGAIN_SECONDS + 4)
    assert bell.heard() == []


def test_a_lost_message_is_sent_again_though_the_clock_was_set_back(
    services: Services, sweeper: Sweeper, bell: Bell, clock: Clock, monkeypatch: pytest.MonkeyPatch
) -> None:
    see_worker(services, "gone")
    add_run(services, "r")
    sweeper.sweep()
    bell.heard()
    wall = time.time
    monkeypatch.setattr(time, "time", lambda: wall() - 3_600)
    pass_by(sweeper, clock, RING_AGAIN_SECONDS + 4)
    assert bell.heard() == []  # who was heard of before has not been heard of since
    see_worker(services, "there")
    pass_by(sweeper, clock, 1)
    assert bell.heard() == ["r"]


def test_nobody_is_rung_for_what_a_limit_keeps_and_at_once_when_it_does_no_more(
    services: Services, sweeper: Sweeper, bell: Bell, clock: Clock
) -> None:
    sweeper.sweep()
    add_run(services, "first")
    add_run(services, "second")
    with services.database.write() as session:
        for experiment in session.query(tables.Experiment):
            experiment.parallel_runs = 1
        ids = {run.id: run.experiment_id for run in session.query(tables.Run)}
        session.get_one(tables.Run, "second").experiment_id = ids["first"]
    claim(services, "first", worker="w1")
    see_worker(services, "w2")
    bell.heard()
    pass_by(sweeper, clock, RING_AGAIN_SECONDS + 4)
    assert bell.heard() == []
    with services.database.write() as session:
        session.get_one(tables.Run, "first").state = "completed"
    pass_by(sweeper, clock, 3)
    assert bell.heard() == ["second"]


def test_each_queue_is_rung_for_its_own_workers(services: Services, sweeper: Sweeper, bell: Bell, clock: Clock) -> None:
    sweeper.sweep()
    add_run(services, "on-cpu", 60)
    add_run(services, "on-gpu", 60, device="cuda")
    see_worker(services, "w", "gpu")
    pass_by(sweeper, clock, RING_AGAIN_SECONDS + 4)
    assert bell.rings == [("on-gpu", 0, "gpu")]


def test_a_run_with_settings_of_another_version_keeps_no_other_from_being_rung(
    services: Services, sweeper: Sweeper, bell: Bell
) -> None:
    add_run(services, "odd", 100)
    with services.database.write() as session:
        RunRepository(session).get("odd").experiment.training = {"algorithm": "of another time"}
    add_run(services, "waits", 50)
    sweeper.sweep()
    assert bell.heard() == ["odd", "waits"]  # and whoever takes up the odd one hears why it can't be trained


def test_a_sweep_that_breaks_is_not_the_last(settings: Settings) -> None:
    services = create_services(settings.model_copy(update={"lease_seconds": 0.5}))
    add_run(services, "waits")
    add_run(services, "silent")
    claim(services, "silent")

    class BrokenBell(Bell):
        def ring(self, run_id: str, attempt: int, queue: Queue) -> None:
            super().ring(run_id, attempt, queue)
            raise RuntimeError("what nobody has thought of")

    async def sweeping() -> None:
        async with dispatch(services):
            services.doorbell = bell = BrokenBell()
            deadline = time.monotonic() + 20
            while run_of(services, "silent").state == "running" or not {"waits", "silent"} <= {
                ring[0] for ring in bell.rings
            }:
                assert time.monotonic() < deadline
                await asyncio.sleep(0.05)

    asyncio.run(sweeping())

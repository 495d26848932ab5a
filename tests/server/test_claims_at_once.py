"""Two, or eight, at once: a run is given to one of those who claim it, whatever else happens to it in that moment."""

import threading
from collections.abc import Callable, Iterator
from functools import partial

import pytest

from server.app import create_services
from server.database import tables
from server.errors import ServiceError
from server.runs.repository import RunRepository
from server.runs.service import RunService
from server.services import Services
from server.settings import Settings
from server.sweeper import Sweeper
from server.worker_api.attempts import FencedError
from server.worker_api.ingest import Outcome, Report
from server.worker_api.leases import Leases
from server.worker_api.service import WorkerService
from workers.config import TrainingConfig
from workers.protocol import Batch, Claim, ClaimRequest, EventItem, Final, MetricItem, Orders

ROUNDS = 8
"""Of each race: chance decides which way it ends."""


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def services(settings: Settings, database_url: str, clock: Clock) -> Iterator[Services]:
    services = create_services(settings.model_copy(update={"database_url": database_url}))
    services.leases = Leases(15.0, clock)
    with services.database.write() as session:
        session.add(tables.Experiment(id="e", name="x", training=TrainingConfig().model_dump(mode="json")))
        session.flush()
        session.add_all(tables.Run(id=f"r{i}", experiment_id="e", seed=i) for i in range(ROUNDS))
    yield services
    services.database.dispose()


def at_once(*actions: Callable[[], object]) -> list[object]:
    """What each has returned, or the refusal that it raised; all begin in the same moment."""
    results: list[object] = [None] * len(actions)
    begin = threading.Barrier(len(actions))

    def act(place: int, action: Callable[[], object]) -> None:
        begin.wait()
        try:
            results[place] = action()
        except ServiceError as error:
            results[place] = error

    threads = [threading.Thread(target=act, args=pair) for pair in enumerate(actions)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return results


def claim(services: Services, run_id: str, worker: str, attempt: int = 0) -> Claim:
    return WorkerService(services).claim(run_id, ClaimRequest(worker=worker, published_attempt=attempt))


def receive(services: Services, run_id: str, batch: Batch) -> Outcome:
    """What attempt 1 says, and what it is told."""
    (outcome,) = WorkerService(services).receive([Report(run_id, 1, batch)])
    return outcome


def run_of(services: Services, run_id: str) -> tables.Run:
    with services.database.read() as session:
        return RunRepository(session).get(run_id)


@pytest.mark.parametrize("workers", [2, 8])
def test_one_of_those_who_claim_at_once_gets_the_run(services: Services, workers: int) -> None:
    for round_ in range(ROUNDS):
        run_id = f"r{round_}"
        results = at_once(*(partial(claim, services, run_id, f"w{i}") for i in range(workers)))
        granted = [(place, result) for place, result in enumerate(results) if isinstance(result, Claim)]
        assert len(granted) == 1
        assert all(
            isinstance(result, ServiceError) and result.status == 409 for result in results if result is not granted[0][1]
        )
        run = run_of(services, run_id)
        assert (run.state, run.attempt, run.worker) == ("running", 1, f"w{granted[0][0]}")


@pytest.mark.parametrize("workers", [2, 8])
def test_each_of_those_who_claim_different_runs_at_once_gets_his(services: Services, workers: int) -> None:
    results = at_once(*(partial(claim, services, f"r{i}", f"w{i}") for i in range(workers)))
    assert [isinstance(result, Claim) for result in results] == [True] * workers


def test_a_run_whose_lease_has_run_out_is_lost_once_however_many_sweep_and_claim(services: Services, clock: Clock) -> None:
    sweeper = Sweeper(services, clock)
    sweeper.sweep()
    item = MetricItem(seq=1, step=10, at=1.0, values={"x": 1.0})
    for round_ in range(ROUNDS):
        run_id = f"r{round_}"
        claim(services, run_id, "silent")
        clock.now += 15.1
        service = WorkerService(services)
        swept, _, granted, late = at_once(
            service.lose_expired,
            service.lose_expired,
            partial(claim, services, run_id, "next", attempt=1),
            partial(receive, services, run_id, Batch(items=(item,))),
        )
        assert swept is None
        run = run_of(services, run_id)
        assert run.losses == 1
        if isinstance(granted, Claim):
            assert (run.state, run.attempt, run.worker) == ("running", 2, "next")
            # What the earlier attempt said, if it came in time, lies beyond the checkpoint from which this one goes on.
            assert run.step == 0
        else:
            assert (run.state, run.attempt, run.worker) == ("queued", 1, None)
        assert (run.last_seq == 1) == isinstance(late, Orders)
        assert isinstance(late, Orders | FencedError)


def test_a_worker_that_is_heard_in_time_keeps_its_run_however_many_sweep(services: Services, clock: Clock) -> None:
    sweeper = Sweeper(services, clock)
    sweeper.sweep()
    for round_ in range(ROUNDS):
        run_id = f"r{round_}"
        claim(services, run_id, "w")
        clock.now += 14.9
        at_once(partial(services.leases.renew, run_id, 1), WorkerService(services).lose_expired)
        clock.now += 0.2
        WorkerService(services).lose_expired()
        assert run_of(services, run_id).state == "running"
        receive(services, run_id, Batch(final=Final(outcome="completed")))


def test_a_stop_and_a_claim_at_once_leave_a_run_that_ends(services: Services) -> None:
    for round_ in range(ROUNDS):
        run_id = f"r{round_}"
        granted, _ = at_once(
            partial(claim, services, run_id, "w"),
            partial(RunService(services).stop, run_id),
        )
        assert run_of(services, run_id).state == ("stopping" if isinstance(granted, Claim) else "stopped")


def test_two_links_of_one_attempt_that_say_the_same_at_once_are_stored_once(services: Services) -> None:
    """The second link was opened before the server saw the end of the first."""
    for round_ in range(ROUNDS):
        run_id = f"r{round_}"
        claim(services, run_id, "w")
        batch = Batch(
            items=(
                MetricItem(seq=1, step=10, at=1.0, values={"x": 1.0}),
                EventItem(seq=2, step=10, at=1.0, level="info", message="once"),
            )
        )
        results = at_once(*[partial(receive, services, run_id, batch)] * 4)
        assert [result.ack for result in results if isinstance(result, Orders)] == [2] * 4
        with services.database.read() as session:
            messages = [event.message for event in RunRepository(session).events(run_id)]
        assert messages.count("once") == 1

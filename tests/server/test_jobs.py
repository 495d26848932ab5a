"""Jobs are claimed, leased and fenced as runs are: done once, lost at most so often, taken back where nobody waits."""

import threading
from collections.abc import Iterator
from dataclasses import replace

import pytest

from server.app import create_services
from server.database import tables
from server.errors import BusyError
from server.jobs import service as jobs_service
from server.jobs.asked import Asked
from server.jobs.service import JobService
from server.services import Services
from server.settings import Settings
from server.worker_api.attempts import FencedError
from server.worker_api.leases import Leases
from tests.server.test_claims_at_once import Clock
from workers.job_protocol import (
    BaselineName,
    EvaluateJob,
    JobClaim,
    JobClaimRequest,
    JobEnd,
    JobKind,
    JobSpec,
    ReplayJob,
    ShippedPolicyName,
    ViewJob,
)
from workers.runtime.jobs.__main__ import places

LEASE = 15.0
ALL: tuple[JobKind, ...] = ("view", "play", "replay", "film", "export", "evaluate")


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def services(settings: Settings, database_url: str, clock: Clock) -> Iterator[Services]:
    services = create_services(settings.model_copy(update={"database_url": database_url}))
    services.job_leases = Leases(LEASE, clock)
    yield services
    services.database.dispose()


@pytest.fixture
def jobs(services: Services) -> JobService:
    return JobService(services)


def replay(key: str = "one", spec: JobSpec | None = None) -> Asked:
    return Asked(spec or ReplayJob(policy=ShippedPolicyName(name="simple")), key, "A policy", "0" * 64)


def claim(jobs: JobService, worker: str = "a@host/0", claim_id: str = "0" * 32) -> JobClaim | None:
    jobs.board.heard(worker)
    return jobs.claim(JobClaimRequest(worker=worker, claim_id=claim_id, kinds=ALL, wait_seconds=0.0))


def claimed(jobs: JobService, worker: str = "a@host/0", claim_id: str = "0" * 32) -> JobClaim:
    found = claim(jobs, worker, claim_id)
    assert found is not None
    return found


def test_what_is_asked_for_twice_is_one_job(jobs: JobService) -> None:
    assert jobs.ask(replay()) == jobs.ask(replay()) != jobs.ask(replay("two"))
    claimed(jobs)
    # Also while it is under way, and anew once it has ended.
    first = claimed(jobs)
    assert jobs.ask(replay()) == first.id
    jobs.end(first.id, first.attempt, JobEnd(outcome="done"))
    assert jobs.ask(replay()) != first.id


def test_eight_who_ask_at_once_get_one_job(jobs: JobService) -> None:
    found: list[str] = []
    threads = [threading.Thread(target=lambda: found.append(jobs.ask(replay()))) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == 8
    assert len(set(found)) == 1


def test_workers_that_claim_at_once_get_different_jobs(jobs: JobService) -> None:
    asked = {jobs.ask(replay(str(number))) for number in range(4)}
    found: list[str | None] = []
    begin = threading.Barrier(6)

    def work(number: int) -> None:
        begin.wait()
        # What another one is about to take is passed over: asked again it is gone or to be had.
        for _ in range(3):
            if (got := claim(jobs, f"w{number}@host/0", f"{number:032x}")) is not None:
                found.append(got.id)
                return

    threads = [threading.Thread(target=work, args=(number,)) for number in range(6)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert len(found) == len(set(found)) == 4
    assert set(found) == asked


def test_who_looks_comes_first(jobs: JobService) -> None:
    jobs.ask(replay())
    view = jobs.ask(replay("view", ViewJob(policy=ShippedPolicyName(name="simple"))))
    assert claimed(jobs).id == view


def test_what_takes_minutes_leaves_a_place_to_what_takes_seconds(jobs: JobService) -> None:
    slow, slower = (
        jobs.ask(replay(name, EvaluateJob(policy=BaselineName.model_validate({"name": name}))))
        for name in ("MPPI", "mapping, A* and dynamic window")
    )
    quick = jobs.ask(replay("quick", EvaluateJob(policy=BaselineName(name="VFH+"))))

    def place(number: int, *, long: bool) -> str | None:
        request = JobClaimRequest(worker=f"w@host/jobs{number}", claim_id=f"{number:032x}", kinds=ALL, long=long)
        found = jobs.claim(request)
        return found.id if found else None

    # Asked for last it goes first; the place of what takes seconds stays free then.
    assert place(1, long=True) == quick
    assert place(0, long=False) is None
    assert place(2, long=True) == slow
    # Who waits hears behind what.
    (waits,) = jobs.turns([jobs.find(slower)]).values()
    assert (len(waits.behind), waits.starts_in) == (2, None)
    jobs.report(slow, 1, 0.5)
    (waits,) = jobs.turns([jobs.find(slower)]).values()
    assert waits.starts_in is not None
    another = jobs.ask(replay("another", EvaluateJob(policy=BaselineName(name="random"))))
    assert place(0, long=False) == another


def test_what_nobody_waits_for_goes_last_and_leaves_a_place_to_what_takes_seconds(jobs: JobService) -> None:
    ahead = jobs.ask(replace(replay(), ahead=True))
    short = JobClaimRequest(worker="w@host/jobs0", claim_id="1" * 32, kinds=ALL, long=False)
    assert jobs.claim(short) is None
    evaluation = jobs.ask(replay("evaluation", EvaluateJob(policy=BaselineName(name="random"))))
    first, second = claimed(jobs), claimed(jobs, claim_id="2" * 32)
    assert (first.id, first.ahead) == (evaluation, False)
    assert (second.id, second.ahead) == (ahead, True)


def test_what_nobody_waits_for_makes_way_for_what_somebody_does(
    jobs: JobService, services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jobs_service, "_MAKE_WAY_SECONDS", 0.0)
    ahead = jobs.ask(replace(replay(), ahead=True))
    first = claimed(jobs)
    # Views have places of their own.
    jobs.ask(replay("view", ViewJob(policy=ShippedPolicyName(name="simple"))))
    jobs.report(ahead, first.attempt, 0.4)
    wanted = jobs.ask(replay("wanted"))
    # What is done already is brought all the same.
    jobs.report(ahead, first.attempt, 1.0)
    with pytest.raises(FencedError, match="somebody waits"):
        jobs.report(ahead, first.attempt, 0.5)
    with pytest.raises(FencedError):
        jobs.end(ahead, first.attempt, JobEnd(outcome="done"))
    # A place that can't take what is waited for does not begin it again and again.
    with services.database.write() as session:
        session.get_one(tables.Job, wanted).lost_by = {"a@host": 3}
    jobs.board.heard("b@host/0")
    jobs.cancel(claimed(jobs, claim_id="5" * 32).id)
    assert claim(jobs, claim_id="6" * 32) is None
    assert claimed(jobs, "b@host/0", "7" * 32).id == wanted
    assert claimed(jobs, claim_id="8" * 32) == JobClaim(
        id=ahead, attempt=2, spec=replay().spec, sha256="0" * 64, lease_seconds=LEASE, ahead=True
    )


def test_what_was_to_be_made_ahead_hurries_once_somebody_asks_for_it(
    jobs: JobService, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jobs_service, "_MAKE_WAY_SECONDS", 0.0)
    ahead = jobs.ask(replace(replay(), ahead=True))
    assert jobs.ask(replay()) == ahead
    first = claimed(jobs)
    assert not first.ahead
    jobs.report(ahead, first.attempt, 0.5)
    jobs.end(ahead, first.attempt, JobEnd(outcome="done"))
    # Also where it is under way, at a pace that leaves the processors to others: then it begins anew.
    again = jobs.ask(replace(replay(), ahead=True))
    slow = claimed(jobs, claim_id="1" * 32)
    assert slow.ahead
    assert jobs.ask(replay()) == again
    # Asked for ahead once more it is no less urgent.
    jobs.ask(replace(replay(), ahead=True))
    with pytest.raises(FencedError):
        jobs.report(again, slow.attempt, 0.5)
    quick = claimed(jobs, claim_id="2" * 32)
    assert (quick.id, quick.attempt, quick.ahead) == (again, 2, False)
    jobs.report(again, quick.attempt, 0.5)


def test_only_so_much_waits_that_nobody_waits_for(jobs: JobService) -> None:
    for number in range(jobs_service.MAX_AHEAD):
        jobs.ask(replace(replay(str(number)), ahead=True))
    with pytest.raises(BusyError, match="nobody waits for"):
        jobs.ask(replace(replay("more"), ahead=True))
    jobs.ask(replay("more"))


def test_one_place_alone_takes_everything_and_of_two_one_stays_for_what_is_short() -> None:
    assert [takes.long for takes in places(1) if "evaluate" in takes.kinds] == [True]
    assert [takes.long for takes in places(2) if "evaluate" in takes.kinds] == [False, True]
    assert [takes.long for takes in places(3) if "evaluate" in takes.kinds] == [False, True, True]


def test_a_claim_whose_answer_was_lost_is_the_same_claim(jobs: JobService) -> None:
    jobs.ask(replay())
    jobs.ask(replay("two"))
    assert claimed(jobs) == claimed(jobs)
    assert claimed(jobs, claim_id="1" * 32).attempt == 1
    assert claim(jobs, claim_id="2" * 32) is None


def test_a_silent_worker_loses_its_job_and_is_fenced_out(jobs: JobService, clock: Clock) -> None:
    jobs.ask(replay())
    first = claimed(jobs)
    jobs.lose_expired()
    clock.now += LEASE - 1.0
    jobs.report(first.id, first.attempt, 0.5)
    clock.now += LEASE - 1.0
    jobs.lose_expired()
    assert jobs.find(first.id).state == "running"
    clock.now += 2.0
    jobs.lose_expired()
    assert jobs.find(first.id).state == "queued"
    second = claimed(jobs, "b@host/0", "1" * 32)
    assert (second.id, second.attempt) == (first.id, 2)
    for late in (
        lambda: jobs.report(first.id, 1, 0.9),
        lambda: jobs.end(first.id, 1, JobEnd(outcome="done")),
        lambda: jobs.archive(first.id, 1),
    ):
        with pytest.raises(FencedError):
            late()
    jobs.end(second.id, 2, JobEnd(outcome="done"))
    # Said again, because the answer got lost.
    jobs.end(second.id, 2, JobEnd(outcome="done"))
    assert jobs.find(first.id).state == "done"


def test_three_workers_that_lose_a_job_fail_it(jobs: JobService) -> None:
    jobs.ask(replay())
    for number, worker in enumerate(("a@host/0", "b@host/0", "c@host/0")):
        got = claimed(jobs, worker, f"{number:032x}")
        jobs.end(got.id, got.attempt, JobEnd(outcome="lost", error="out of memory"))
    job = jobs.find(got.id)
    assert (job.state, job.losses) == ("failed", 3)
    assert job.error is not None
    assert "out of memory" in job.error


def test_a_sick_worker_alone_fails_no_job_that_another_would_do(jobs: JobService) -> None:
    jobs.board.heard("b@host/0")
    jobs.ask(replay())
    for number in range(3):
        got = claimed(jobs, "a@host/0", f"{number:032x}")
        jobs.end(got.id, got.attempt, JobEnd(outcome="lost", error="no disk"))
    assert jobs.find(got.id).state == "queued"
    assert claim(jobs, "a@host/1", "8" * 32) is None
    assert claimed(jobs, "b@host/0", "9" * 32).id == got.id


def test_a_worker_that_ends_hands_its_job_back(jobs: JobService) -> None:
    jobs.ask(replay())
    got = claimed(jobs)
    jobs.end(got.id, got.attempt, JobEnd(outcome="released"))
    job = jobs.find(got.id)
    assert (job.state, job.losses, job.worker) == ("queued", 0, None)


def test_a_cancelled_job_is_never_begun_and_its_worker_hears_of_it(jobs: JobService) -> None:
    jobs.cancel(jobs.ask(replay()))
    assert claim(jobs) is None
    jobs.ask(replay())
    got = claimed(jobs)
    jobs.cancel(got.id)
    with pytest.raises(FencedError, match="cancelled"):
        jobs.report(got.id, got.attempt, 0.5)


def test_a_restarted_server_keeps_what_waits_and_drops_views(jobs: JobService, services: Services) -> None:
    kept = jobs.ask(replay())
    view = jobs.ask(replay("view", ViewJob(policy=ShippedPolicyName(name="simple"))))
    again = JobService(create_services(services.settings))
    again.cancel_all("view")
    assert (again.find(kept).state, again.find(view).state) == ("queued", "cancelled")
    again.lose_expired()
    again._services.database.dispose()


def test_the_queue_has_an_end(jobs: JobService, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(jobs_service, "MAX_QUEUED", 2)
    jobs.ask(replay("1"))
    first = jobs.ask(replay("2"))
    with pytest.raises(BusyError, match="wait for a worker already") as refused:
        jobs.ask(replay("3"))
    assert refused.value.retry_after == 10.0
    # What is in it already may be asked for again.
    assert jobs.ask(replay("2")) == first


def test_what_ended_long_ago_is_forgotten(jobs: JobService, services: Services) -> None:
    ended, waits = jobs.ask(replay()), jobs.ask(replay("two"))
    jobs.cancel(ended)
    with services.database.write() as session:
        session.get_one(tables.Job, ended).finished_at = 1.0
        session.get_one(tables.Job, waits).created_at = 1.0
    jobs.forget_old()
    with services.database.read() as session:
        assert [job.id for job in session.query(tables.Job)] == [waits]

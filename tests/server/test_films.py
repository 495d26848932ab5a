"""Films are jobs of workers: made once for all who ask, made again where one was lost, taken back where nobody waits."""

import asyncio
import io
import shutil
import threading
import time
from pathlib import Path
from typing import Any

import httpx
import pytest
from fastapi.testclient import TestClient
from mcap.reader import make_reader

from server.jobs import service as jobs_service
from server.jobs.asked import Asked
from server.jobs.results import ResultStore
from server.jobs.service import JobService
from server.services import Services
from server.worker_api.leases import Leases
from tests.server.harness import WORKER_TOKEN
from tests.server.job_worker import DirectClient, working
from tests.server.test_claims_at_once import Clock
from workers.errors import RunRefusedError
from workers.job_protocol import JobClaim, JobEnd, ReplayJob, ShippedPolicyName
from workers.shipped.library import shipped_policy

RECORDED = shipped_policy("complex").evaluation("complex-200")
SUBJECT = "policy:complex:complex-200"
MCAP = f"/api/replays/{SUBJECT}/7/mcap"


@pytest.fixture(scope="module")
def driven(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Keeps the recording between tests, so that it is driven once."""
    return tmp_path_factory.mktemp("driven")


@pytest.fixture
def kept(client: TestClient, services: Services, driven: Path, tmp_path: Path) -> Path:
    """The recording is there, and no film."""
    directory = tmp_path / "kept"
    services.results = ResultStore(driven, max_bytes=2**30)
    with working(client, services, tmp_path / "first"):
        assert client.get(f"/api/replays/{SUBJECT}/7").status_code == 200
    shutil.copytree(driven, directory)
    services.results = ResultStore(directory, max_bytes=2**30)
    return directory


def jobs(client: TestClient, kind: str = "film") -> list[dict[str, Any]]:
    return [job for job in client.get("/api/jobs").json()["items"] if job["kind"] == kind]


def until(client: TestClient, state: str) -> dict[str, Any]:
    """The film's job, once it is in this state."""
    deadline = time.monotonic() + 30.0
    while time.monotonic() < deadline:
        if found := [job for job in jobs(client) if job["state"] == state]:
            return found[0]
        time.sleep(0.05)
    raise AssertionError(jobs(client))


class Asking:
    """Somebody who waits for an answer."""

    def __init__(self, client: TestClient, path: str = MCAP) -> None:
        self._answers: list[httpx.Response] = []
        self._thread = threading.Thread(target=lambda: self._answers.append(client.get(path)))
        self._thread.start()

    def answer(self) -> httpx.Response:
        self._thread.join(60.0)
        return self._answers[0]


@pytest.fixture
def by_hand(client: TestClient, services: Services) -> DirectClient:
    """A worker whose every step the test takes itself."""
    services.board.heard("hand@host/jobs0")
    return DirectClient(client)


def claimed(worker: DirectClient, name: str = "hand@host/jobs0") -> JobClaim:
    claim = worker.claim_job(name, ("film",), f"{time.monotonic_ns():032x}", 10.0)
    assert claim is not None
    return claim


def scans(data: bytes) -> int:
    return sum(channel.topic == "/scan" for _, channel, _ in make_reader(io.BytesIO(data)).iter_messages())


def test_a_film_is_a_job_with_a_name_of_its_own_and_is_made_once(
    client: TestClient, services: Services, kept: Path, tmp_path: Path
) -> None:
    with working(client, services, tmp_path / "work"):
        first = client.get(MCAP)
        again = client.get(MCAP)
    assert scans(first.content) == RECORDED.episodes[7].steps + 1
    assert again.content == first.content
    (job,) = jobs(client)
    assert (job["kind"], job["state"], job["title"]) == ("film", "done", shipped_policy("complex").card.title)
    assert client.get(f"/api/replays/{SUBJECT}/7/progress?form=mcap").json() == {"ready": True, "share": 1.0}
    # Another form, theme or episode is another film.
    assert client.get(f"/api/replays/{SUBJECT}/7/progress?form=scene").json() == {"ready": False, "share": 0.0}
    assert client.get(f"/api/replays/{SUBJECT}/8/progress?form=mcap").json()["ready"] is False


def test_two_who_ask_at_once_wait_for_one_job(
    client: TestClient, by_hand: DirectClient, kept: Path, services: Services
) -> None:
    askers = [Asking(client), Asking(client)]
    claim = claimed(by_hand)
    by_hand.report_job(claim.id, claim.attempt, 0.25)
    assert client.get(f"/api/replays/{SUBJECT}/7/progress?form=mcap").json() == {"ready": False, "share": 0.25}
    result = kept / "made"
    result.write_bytes(b"what the worker made")
    by_hand.bring_result(claim.id, claim.attempt, result)
    by_hand.end_job(claim.id, claim.attempt, JobEnd(outcome="done"))
    assert [asker.answer().content for asker in askers] == [b"what the worker made"] * 2
    assert len(jobs(client)) == 1


def test_what_a_worker_that_died_had_begun_another_one_makes(
    client: TestClient, services: Services, by_hand: DirectClient, kept: Path, tmp_path: Path
) -> None:
    clock = Clock()
    services.job_leases = Leases(services.settings.lease_seconds, clock)
    asker = Asking(client)
    claim = claimed(by_hand)
    recording = tmp_path / "recording"
    by_hand.fetch_recording(claim.id, claim.attempt, 0, recording)
    assert recording.read_bytes() in [path.read_bytes() for path in kept.iterdir()]
    # Not heard of any more.
    clock.now += services.settings.lease_seconds + 1.0
    JobService(services).lose_expired()
    with working(client, services, tmp_path / "work"):
        assert scans(asker.answer().content) == RECORDED.episodes[7].steps + 1
    assert until(client, "done")["attempt"] == 2
    late = tmp_path / "late"
    late.write_bytes(b"too late")
    with pytest.raises(RunRefusedError):
        by_hand.bring_result(claim.id, claim.attempt, late)
    with pytest.raises(RunRefusedError):
        by_hand.fetch_recording(claim.id, claim.attempt, 0, recording)
    assert b"too late" not in client.get(MCAP).content


def test_whoever_leaves_takes_the_film_back(
    services: Services, client: TestClient, by_hand: DirectClient, kept: Path
) -> None:
    """As `AbandonedRequestsMiddleware` does it: the request is cancelled."""
    from server.replays.films import episode_film, film_of
    from server.replays.references import Reference
    from server.replays.subjects import subject_of

    subjects = [subject_of(services, Reference("policy", "complex", "complex-200"))]

    async def leave() -> None:
        task = asyncio.create_task(film_of(services, episode_film(subjects, 7, "mcap"), subjects))
        async with asyncio.timeout(30.0):
            while not jobs_of(services):  # noqa: ASYNC110 - what is waited for is a row
                await asyncio.sleep(0.05)
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)

    def jobs_of(services: Services) -> list[str]:
        from server.http.paging import Window

        page = JobService(services).page(Window(limit=10, offset=0))
        return [job.state for job in page.items if job.kind == "film"]

    assert client.portal is not None
    client.portal.call(leave)
    assert until(client, "cancelled")["attempt"] == 0


def test_too_many_that_wait_are_told_when_to_come_again(
    client: TestClient, services: Services, kept: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(jobs_service, "MAX_QUEUED", 2)
    for number in range(2):
        JobService(services).ask(
            Asked(ReplayJob(policy=ShippedPolicyName(name="simple")), f"{number}", "A policy", "0" * 64)
        )
    for path in (MCAP, f"/replays/{SUBJECT}/7/dark/"):
        refused = client.get(path)
        assert refused.status_code == 503
        assert int(refused.headers["Retry-After"]) == 10
        assert "wait for a worker already" in refused.text


def test_a_film_whose_recording_has_gone_meanwhile_is_made_of_a_new_one(
    client: TestClient, services: Services, kept: Path, tmp_path: Path
) -> None:
    asker = Asking(client)
    until(client, "queued")
    for path in kept.iterdir():
        path.unlink()
    with working(client, services, tmp_path / "work"):
        assert scans(asker.answer().content) == RECORDED.episodes[7].steps + 1
    assert sorted(job["state"] for job in jobs(client)) == ["done", "failed"]
    assert "is not kept any more" in next(job["error"] for job in jobs(client) if job["error"])


def test_a_damaged_recording_is_driven_again_for_the_film(
    client: TestClient, services: Services, kept: Path, tmp_path: Path
) -> None:
    (recording,) = kept.iterdir()
    recording.write_bytes(recording.read_bytes()[:1_000])
    with working(client, services, tmp_path / "work"):
        assert scans(client.get(MCAP).content) == RECORDED.episodes[7].steps + 1


def test_a_worker_gets_the_recordings_of_its_film_and_no_others(
    client: TestClient, services: Services, by_hand: DirectClient, kept: Path, tmp_path: Path
) -> None:
    asker = Asking(client)
    claim = claimed(by_hand)
    path = f"/api/worker/jobs/{claim.id}/recordings/0"
    as_worker = {"Authorization": f"Bearer {WORKER_TOKEN}"}
    for attempt, headers, status in ((1, {}, 401), (1, as_worker, 200), (2, as_worker, 409)):
        assert client.get(path, params={"attempt": attempt}, headers=headers).status_code == status
    with pytest.raises(RunRefusedError):
        by_hand.fetch_recording(claim.id, claim.attempt, 1, tmp_path / "other")
    # It is tried once more, in case a recording had gone; then whoever asked is told.
    again = claimed(by_hand)
    by_hand.end_job(again.id, again.attempt, JobEnd(outcome="failed", error="out of ink"))
    refused = asker.answer()
    assert refused.status_code == 500
    assert refused.json()["detail"] == "The film could not be made: out of ink"


def test_where_no_film_can_be_made_its_frame_says_why_and_what_to_do(
    client: TestClient, by_hand: DirectClient, kept: Path
) -> None:
    asker = Asking(client, f"/replays/{SUBJECT}/7/dark/")
    for _ in range(2):
        claim = claimed(by_hand)
        by_hand.end_job(claim.id, claim.attempt, JobEnd(outcome="failed", error="no <ink> left"))
    shown = asker.answer()
    assert (shown.status_code, shown.headers["content-type"]) == (500, "text/html; charset=utf-8")
    assert "The film could not be made: no &lt;ink&gt; left" in shown.text
    assert 'data-theme="dark"' in shown.text
    assert '<a href="">Try again</a>' in shown.text
    assert "default-src 'none'" in shown.headers["Content-Security-Policy"]

"""Stands in for workers: claims runs and reports twenty series for each over its link, twice a second."""

import asyncio
import threading
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from benchmarks.dashboard.data import SERIES
from benchmarks.dashboard.server import WORKER_TOKEN, Server
from workers.protocol import Batch, Claim, MetricItem

EVERY_SECONDS = 0.5
_STEPS_A_REPORT = 512
_CLAIMS_AT_ONCE = 10


def claim(server: Server, run_id: str) -> Claim:
    """Take up a queued run as a worker would."""
    with server.client() as people:
        attempt = people.get(f"/api/runs/{run_id}").raise_for_status().json()["attempt"]
    return _claim(server, run_id, attempt)[0]


def time_claims(server: Server, run_ids: Sequence[str]) -> tuple[list[float], list[float]]:
    """Resume the runs, and take them up: the first half one by one, the others all at once.

    Returns:
        Milliseconds that each of the claims took, one by one and at once.
    """
    run_ids = run_ids[: 2 * _CLAIMS_AT_ONCE]
    attempts = {}
    with server.client() as people:
        for run_id in run_ids:
            attempts[run_id] = people.post(f"/api/runs/{run_id}/resume").raise_for_status().json()["attempt"]
    half = len(run_ids) // 2
    alone = [_claim(server, run_id, attempts[run_id])[1] for run_id in run_ids[:half]]
    with ThreadPoolExecutor(_CLAIMS_AT_ONCE) as pool:
        together = list(pool.map(lambda run_id: _claim(server, run_id, attempts[run_id])[1], run_ids[half:]))
    return alone, together


def _claim(server: Server, run_id: str, attempt: int) -> tuple[Claim, float]:
    with server.client(WORKER_TOKEN) as worker:
        worker.post("/api/worker/heartbeat", json={"worker": f"bench-{run_id}", "queue": "cpu"}).raise_for_status()
        began = time.perf_counter()
        answer = worker.post(
            f"/api/worker/runs/{run_id}/claim", json={"worker": f"bench-{run_id}", "published_attempt": attempt}
        )
        took = 1000.0 * (time.perf_counter() - began)
        return Claim.model_validate_json(answer.raise_for_status().content), took


class Reporters:
    """Runs that report until they are told to end; `sent` holds when each step of each run was reported, seconds."""

    def __init__(self, server: Server, run_ids: Sequence[str]) -> None:
        self._server = server
        self._claims = {run_id: claim(server, run_id) for run_id in run_ids}
        self._stop = threading.Event()
        self.sent: dict[str, dict[int, float]] = {run_id: {} for run_id in run_ids}
        self.acknowledged = 0

    async def _report(self, run_id: str, offset: float) -> None:
        claimed = self._claims[run_id]
        url = f"{self._server.origin.replace('http', 'ws', 1)}/api/worker/runs/{run_id}/link?attempt={claimed.attempt}"
        seq, step = claimed.last_seq, claimed.last_seq * _STEPS_A_REPORT
        async with connect(url, additional_headers={"Authorization": f"Bearer {WORKER_TOKEN}"}) as link:
            listening = asyncio.create_task(self._listen(link))
            await asyncio.sleep(offset)
            while not self._stop.is_set():
                seq, step = seq + 1, step + _STEPS_A_REPORT
                values: dict[str, float | None] = dict.fromkeys(SERIES, 0.5 + 0.5 * ((seq * 7919) % 1000) / 1000)
                batch = Batch(items=(MetricItem(seq=seq, step=step, at=time.time(), values=values),))
                self.sent[run_id][step] = time.time()
                await link.send(batch.model_dump_json())
                await asyncio.sleep(EVERY_SECONDS)
            listening.cancel()

    async def _listen(self, link: object) -> None:
        async for _ in link:  # type: ignore[attr-defined]
            self.acknowledged += 1

    def run(self) -> None:
        """Report until the end; for a thread."""

        async def all_of_them() -> None:
            offsets = [EVERY_SECONDS * index / len(self._claims) for index in range(len(self._claims))]
            reports = [self._report(run_id, offset) for run_id, offset in zip(self._claims, offsets, strict=True)]
            for outcome in await asyncio.gather(*reports, return_exceptions=True):
                if isinstance(outcome, BaseException) and not isinstance(outcome, ConnectionClosed):
                    raise outcome

        asyncio.run(all_of_them())

    def end(self) -> None:
        """Let every report that is under way be the last."""
        self._stop.set()


@contextmanager
def reporting(server: Server, run_ids: Sequence[str]) -> Iterator[Reporters]:
    """All of the runs report until the block is left."""
    reporters = Reporters(server, run_ids)
    thread = threading.Thread(target=reporters.run, name="reporters", daemon=True)
    thread.start()
    try:
        yield reporters
    finally:
        reporters.end()
        thread.join(30.0)

"""Stands in for workers: claims runs and reports twenty series for each over its link, twice a second."""

import asyncio
import threading
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

from websockets.asyncio.client import connect
from websockets.exceptions import ConnectionClosed

from benchmarks.dashboard.claims import claim
from benchmarks.dashboard.data import SERIES
from benchmarks.dashboard.server import WORKER_TOKEN, Server
from workers.protocol import Batch, MetricItem

EVERY_SECONDS = 0.5
_STEPS_A_REPORT = 512


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

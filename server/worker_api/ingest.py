"""Takes in what the workers report: what several have said while one transaction was under way shares the next one.

A transaction costs little more for fifty batches than for one, and a hundred threads that each want their own keep one
another and the pages waiting. Here one thread at a time stores, at most so often, and takes along whatever has come; a
worker's acknowledgement follows the commit, and waits for a pause, one transaction under way and its own at most.
"""

import asyncio
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

from anyio import CapacityLimiter, to_thread

from workers.protocol import Batch, Orders, Refusal

# Reports in one transaction, at most: those of a hundred runs, and milliseconds of it.
_MAX_GROUP = 100
# From the beginning of one transaction to that of the next, at least, unless so many wait. Nobody sees a tenth of a second
# on a curve, and where a hundred runs report twice a second, twenty share a transaction.
_PAUSE_SECONDS = 0.1


@dataclass(frozen=True, slots=True)
class Report:
    """One message of a worker.

    Attributes:
        run_id: the run that it trains.
        attempt: its fencing token.
        batch: what it reports.
        refused: what came behind the batch and can never be stored.
        damaged: the checkpoint that the worker could not go on from, where its archive is damaged indeed.
    """

    run_id: str
    attempt: int
    batch: Batch
    refused: Refusal | None = None
    damaged: str | None = None


Outcome = Orders | Exception
"""What to answer to a report, or why it was not stored."""


class Store(Protocol):
    """Stores reports in one transaction; blocks."""

    def __call__(self, reports: Sequence[Report], /) -> list[Outcome]:
        """One outcome a report, in order."""


class Ingest:
    """The queue of reports. Belongs to the server's event loop."""

    def __init__(self, store: Store) -> None:
        self._store = store
        self._waiting: deque[tuple[Report, asyncio.Future[Orders]]] = deque()
        self._limiter = CapacityLimiter(1)
        self._task: asyncio.Task[None] | None = None
        self._next_at = 0.0

    async def receive(self, report: Report) -> Orders:
        """The answer to a report, once it is stored.

        Raises:
            FencedError: the attempt is over.
            Exception: the database's, where it could not be stored; nothing of it was, and it may come again.
        """
        answer: asyncio.Future[Orders] = asyncio.get_running_loop().create_future()
        self._waiting.append((report, answer))
        if self._task is None:
            self._task = asyncio.create_task(self._store_all())
        return await answer

    async def close(self) -> None:
        """Store what has arrived."""
        if self._task is not None:
            await self._task

    async def _store_all(self) -> None:
        now = asyncio.get_running_loop().time
        try:
            while self._waiting:
                if len(self._waiting) < _MAX_GROUP:
                    await asyncio.sleep(self._next_at - now())
                self._next_at = now() + _PAUSE_SECONDS
                group = [self._waiting.popleft() for _ in range(min(_MAX_GROUP, len(self._waiting)))]
                for (_, answer), outcome in zip(group, await self._outcomes([report for report, _ in group]), strict=True):
                    # Whoever waited for it may have gone.
                    if answer.done():
                        continue
                    if isinstance(outcome, Exception):
                        answer.set_exception(outcome)
                    else:
                        answer.set_result(outcome)
        finally:
            self._task = None

    async def _outcomes(self, reports: list[Report]) -> Sequence[Outcome]:
        try:
            return await to_thread.run_sync(self._store, reports, limiter=self._limiter)
        except Exception as error:
            return [error] * len(reports)

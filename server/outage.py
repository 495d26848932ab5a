"""Parts outside of this process (database, broker, store) that go away and come back: said once each, asked at intervals.

While one is away everybody who needs it is refused at once, but for one who asks now and then whether it is back: the log
does not fill, and no thread waits for what can't answer.
"""

import asyncio
import logging
import threading
import time
from collections.abc import Awaitable, Callable
from typing import TypeVar

from server.errors import PartAwayError

logger = logging.getLogger(__name__)

_T = TypeVar("_T")

# Between two looks whether it is back; who waits for that long hardly notices.
_FIRST_PAUSE = 0.1
_LAST_PAUSE = 2.0
RETRY_AFTER = 2.0
"""Seconds after which whoever was refused may come again."""


class Outage:
    """Whether one part is away. Thread-safe.

    Args:
        name: of the part, as a sentence begins with it.
        clock: seconds that only grow.
    """

    def __init__(self, name: str, clock: Callable[[], float] = time.monotonic) -> None:
        self.name = name
        self._clock = clock
        self._lock = threading.Lock()
        self._since: float | None = None
        self._pause = _FIRST_PAUSE
        self._next = 0.0

    def may_ask(self) -> bool:
        """Whether the part is there, or it is this caller's turn to find out."""
        with self._lock:
            if self._since is None:
                return True
            now = self._clock()
            if now < self._next:
                return False
            self._postpone(now)
            return True

    @property
    def until_next(self) -> float | None:
        """Seconds until it is worth asking again; None while the part is there."""
        with self._lock:
            return None if self._since is None else max(0.0, self._next - self._clock())

    def gone(self, reason: str) -> None:
        """The part did not answer."""
        with self._lock:
            if self._since is not None:
                return
            self._since = self._clock()
            self._pause = _FIRST_PAUSE
            self._postpone(self._since)
        reason = reason.strip().rstrip(".")
        logger.warning(
            "%s can't be reached: %s. Whoever needs it is asked to come again until it is back.", self.name, reason
        )

    def back(self) -> None:
        """The part has answered whoever asked it after it had gone."""
        with self._lock:
            if self._since is None:
                return
            seconds = self._clock() - self._since
            self._since = None
        logger.info("%s is back after %.1f s.", self.name, seconds)

    def _postpone(self, now: float) -> None:
        self._next = now + self._pause
        self._pause = min(2 * self._pause, _LAST_PAUSE)


async def patiently(do: Callable[[], Awaitable[_T]]) -> _T:
    """What `do` answers, asked again for as long as a part that it needs is away."""
    while True:
        try:
            return await do()
        except PartAwayError:
            await asyncio.sleep(RETRY_AFTER)

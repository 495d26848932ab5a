"""What several threads do with the robots of one step: each follows a stretch of them."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor, wait
from itertools import pairwise
from typing import TypeVar

_ENOUGH = 64
"""Robots of a stretch, at least: fewer are done before another thread has begun."""

_Found = TypeVar("_Found")


class Crew:
    """Threads that share work, the one that asks among them.

    The others begin with the first work that there is for them, and flush denormal numbers if the one does that asks then.

    Args:
        threads: how many.

    Attributes:
        threads: likewise.
    """

    def __init__(self, threads: int = 1) -> None:
        self.threads = threads
        self._others = ThreadPoolExecutor(threads - 1, "stretch") if threads > 1 else None

    def stretches(self, robots: int) -> list[tuple[int, int]]:
        """The first robot of each thread and the one after its last, for as many threads as have enough to do."""
        count = max(1, min(self.threads, robots // _ENOUGH))
        return list(pairwise(robots * k // count for k in range(count + 1)))

    def share(self, work: Callable[[int], _Found], parts: int) -> list[_Found]:
        """What the work of each part finds, the first one's in this thread.

        Raises:
            Exception: what the work of a part raises, once all have ended.
        """
        if parts == 1 or self._others is None:
            return [work(part) for part in range(parts)]
        others = [self._others.submit(work, part) for part in range(1, parts)]
        try:
            mine = work(0)
        finally:
            wait(others)
        return [mine, *(other.result() for other in others)]

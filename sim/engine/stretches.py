"""What several threads do with the robots of one step: each follows a stretch of them."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from itertools import pairwise
from typing import TypeVar

_ENOUGH = 64
"""Robots of a stretch, at least: fewer are done before another thread has begun."""

_Found = TypeVar("_Found")


def stretches(robots: int, threads: int) -> list[tuple[int, int]]:
    """The first robot of each thread and the one after its last, for as many threads as have enough to do."""
    count = max(1, min(threads, robots // _ENOUGH))
    return list(pairwise(robots * k // count for k in range(count + 1)))


def side_by_side(work: Callable[[int], _Found], parts: int) -> list[_Found]:
    """What the work of each part finds, the first one's in this thread.

    Raises:
        Exception: what the work of a part raises, once all have ended.
    """
    if parts == 1:
        return [work(0)]
    # Made anew each time: a thread flushes denormal numbers as the one did that started it.
    with ThreadPoolExecutor(parts - 1, "stretch") as pool:
        others = [pool.submit(work, part) for part in range(1, parts)]
        return [work(0), *(other.result() for other in others)]

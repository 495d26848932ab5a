"""How many threads a training takes: as many as it can use, or fewer where other programs keep the cores busy."""

from collections.abc import Callable
from pathlib import Path

from workers.config import Threads
from workers.processes import usable_cores

_MOST = 2
"""Threads that any algorithm can use."""

# A look sees one moment: it moves what is believed by this much.
_TRUST = 0.2

# Of a core that must be free for a thread more.
_SPARE = 0.5


def runnable_threads() -> int:
    """Threads of the whole machine that compute or wait for a core at this moment, this one among them; 1 if untold."""
    try:
        return int(Path("/proc/loadavg").read_text(encoding="ascii").split()[3].partition("/")[0])
    except (OSError, ValueError, IndexError):
        return 1


class ThreadCount:
    """Threads for the next update. Results do not depend on it, so it may change at any time.

    Args:
        threads: as configured; 'auto' is what others leave free.
        cores: that there are.
        look: how many threads of the machine are runnable now.
    """

    def __init__(self, threads: Threads, cores: int | None = None, look: Callable[[], int] = runnable_threads) -> None:
        self._fixed = None if threads == "auto" else int(threads)
        self._cores, self._look = usable_cores() if cores is None else cores, look
        self._others: float | None = None

    def now(self) -> int:
        """Looks around, while the asking thread is the only one of its training that computes."""
        if self._fixed is not None:
            return self._fixed
        others = max(self._look() - 1, 0)
        self._others = others if self._others is None else self._others + _TRUST * (others - self._others)
        free = self._cores - self._others
        return max(1, min(_MOST, int(free + _SPARE)))

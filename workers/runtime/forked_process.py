"""A process that the nursery has forked, as the one that asked for it sees it."""

from collections.abc import Callable
from concurrent.futures import Future


class ForkedProcess:
    """Runs until it ends, is killed, or the connection closes over which it was asked for.

    Args:
        pid: its id, which is its process group's too.
        ended: its status, once it has one.
        kill: ends it and whatever it has started, at once; of one that has ended it does nothing.
    """

    def __init__(self, pid: int, ended: "Future[int]", kill: Callable[[], None]) -> None:
        self.pid = pid
        self.kill = kill
        self._ended = ended

    @property
    def alive(self) -> bool:
        """Whether it still runs."""
        return not self._ended.done()

    @property
    def status(self) -> int:
        """How it ended, as `subprocess` tells it; waits for that."""
        return self._ended.result()

    def wait(self, seconds: float) -> bool:
        """Whether it has ended within that time."""
        try:
            self._ended.result(seconds)
        except TimeoutError:
            return False
        return True

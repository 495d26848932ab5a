"""A lock that lets those who wait in, one after another, in the order in which they came."""

import threading
from collections import deque
from collections.abc import Iterator
from contextlib import contextmanager

from server.errors import DatabaseBusyError


class FairLock:
    """Handed over from owner to owner: nobody polls, and nobody who comes later is served earlier. Not reentrant."""

    def __init__(self) -> None:
        self._guard = threading.Lock()
        self._waiting: deque[threading.Lock] = deque()
        self._taken = False
        self._owner: int | None = None

    @contextmanager
    def held(self, timeout: float) -> Iterator[None]:
        """Hold the lock for the block.

        Raises:
            DatabaseBusyError: it was not to be had within `timeout` seconds.
        """
        self._acquire(timeout)
        try:
            yield
        finally:
            self._release()

    def _acquire(self, timeout: float) -> None:
        me = threading.get_ident()
        with self._guard:
            assert self._owner != me, "a write transaction within another one would wait for itself"
            if not self._taken:
                self._taken, self._owner = True, me
                return
            turn = threading.Lock()
            turn.acquire()
            self._waiting.append(turn)
        if not turn.acquire(timeout=timeout):
            with self._guard:
                # Handed over at this very moment, it is no longer in the queue, and ours.
                if turn in self._waiting:
                    self._waiting.remove(turn)
                    raise DatabaseBusyError("The database is busy with other writers: try again in a moment.")
        self._owner = me

    def _release(self) -> None:
        with self._guard:
            self._owner = None
            if self._waiting:
                # Taken all the while: who comes now queues up behind those who wait.
                self._waiting.popleft().release()
            else:
                self._taken = False

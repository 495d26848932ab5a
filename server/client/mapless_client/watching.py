"""Follows a training to its end: woken by the server's events, and by a clock where those do not come through."""

import threading
import time
from collections.abc import Callable, Iterator
from typing import TypeVar

from mapless_client.errors import RefusedError, UnreachableError
from mapless_client.transport import Transport, pause

T = TypeVar("T")

# The server says something at least every 15 s. A proxy may hold all of it back: then the clock wakes.
_SILENCE = 40.0
_LONGEST_WAIT = 20.0


class _Doorbell:
    """Listens to the changes of one experiment on a thread, and says when there was one."""

    def __init__(self, transport: Transport, experiment_id: str) -> None:
        self._transport = transport
        self._query = {"experiment": [experiment_id], "follow": "shown"}
        self._rung = threading.Event()
        self._closed = threading.Event()
        self.heard = False
        self._thread = threading.Thread(target=self._listen, daemon=True)
        self._thread.start()

    def wait(self, seconds: float) -> None:
        """Until something has changed, or for so long."""
        self._rung.wait(seconds)
        self._rung.clear()

    def close(self) -> None:
        """Stop listening; the thread ends with the next thing that the server says, or with the connection."""
        self._closed.set()

    def _listen(self) -> None:
        failures = 0
        while not self._closed.is_set():
            try:
                with self._transport.stream("/api/events", self._query, read_seconds=_SILENCE) as response:
                    for line in response.iter_lines():
                        if self._closed.is_set():
                            return
                        failures = 0
                        if line.startswith("event:"):
                            self.heard = True
                            self._rung.set()
            except UnreachableError:
                pass
            except RefusedError:
                # The watcher's next question is refused as well, and says so.
                return
            self.heard = False
            failures += 1
            self._closed.wait(pause(failures))


def watch(
    transport: Transport, experiment_id: str, read: Callable[[], T], ended: Callable[[T], bool], at_most: float
) -> Iterator[T]:
    """What `read` says now, and again each time it says something else, until that has ended.

    Args:
        transport: to the server.
        experiment_id: whose changes wake it.
        read: asks the server.
        ended: whether nothing more comes.
        at_most: seconds between two questions at least.

    Raises:
        RefusedError: it is gone, or may not be seen any more.
        UnreachableError: the server was away for too long.
    """
    bell = _Doorbell(transport, experiment_id)
    last, quiet = None, 0
    try:
        while True:
            now = read()
            quiet = 0 if now != last else quiet + 1
            if now != last:
                yield now
                last = now
            if ended(now):
                return
            time.sleep(at_most)
            bell.wait(_LONGEST_WAIT if bell.heard else min(_LONGEST_WAIT, pause(quiet + 1)))
    finally:
        bell.close()

"""Answers that stay true until a run reports again: many who look at one run are answered by one computation."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable

from server.recent import Turns

_MAX_BYTES = 32 * 2**20


class AnswerCache:
    """The answers asked for last, by what they depend on; bounded in bytes. Thread-safe."""

    def __init__(self, max_bytes: int = _MAX_BYTES) -> None:
        self._max_bytes = max_bytes
        self._turns = Turns()
        self._lock = threading.Lock()
        self._answers: OrderedDict[Hashable, bytes] = OrderedDict()
        self._bytes = 0

    def get(self, key: Hashable, make: Callable[[], bytes]) -> bytes:
        """The answer under `key`, made where it is not there; others get theirs meanwhile, since that takes its time."""
        with self._turns.of(key):
            with self._lock:
                if (known := self._answers.get(key)) is not None:
                    self._answers.move_to_end(key)
                    return known
            made = make()
            with self._lock:
                self._answers[key] = made
                self._bytes += len(made)
                while self._bytes > self._max_bytes:
                    _, oldest = self._answers.popitem(last=False)
                    self._bytes -= len(oldest)
            return made

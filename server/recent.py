"""What was made last, by what it was made of: several requests of one page are answered from one look at the database."""

import threading
from collections import OrderedDict
from collections.abc import Callable, Hashable, Iterator
from contextlib import contextmanager
from typing import Generic, TypeVar

_T = TypeVar("_T")


class Turns:
    """One thread at a time for each key: who asks for what is being made waits for it, and does not make it too."""

    def __init__(self) -> None:
        self._guard = threading.Lock()
        # With how many hold one or wait for it.
        self._turns: dict[Hashable, tuple[threading.Lock, int]] = {}

    @contextmanager
    def of(self, key: Hashable) -> Iterator[None]:
        """The turn for a key; not to be asked for again within it."""
        with self._guard:
            turn, asking = self._turns.get(key, (threading.Lock(), 0))
            self._turns[key] = turn, asking + 1
        try:
            with turn:
                yield
        finally:
            with self._guard:
                turn, asking = self._turns.pop(key)
                if asking > 1:
                    self._turns[key] = turn, asking - 1


class Recent(Generic[_T]):
    """The last few things that were made; nobody may change one. Thread-safe.

    Args:
        count: that are kept at most.
    """

    def __init__(self, count: int) -> None:
        self._count = count
        self._turns = Turns()
        self._lock = threading.Lock()
        self._made: OrderedDict[Hashable, _T] = OrderedDict()

    def get(self, key: Hashable, make: Callable[[], _T]) -> _T:
        """What is kept under `key`, made where nothing is; others get theirs meanwhile, since that takes its time."""
        with self._turns.of(key):
            with self._lock:
                if key in self._made:
                    self._made.move_to_end(key)
                    return self._made[key]
            made = make()
            with self._lock:
                self._made[key] = made
                while len(self._made) > self._count:
                    self._made.popitem(last=False)
            return made

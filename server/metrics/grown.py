"""The runs that have reported so much that their rows may be worth compacting."""

import threading
from collections.abc import Iterable

from server.background import Wake


class GrownRuns:
    """Each once, in the order in which they came. Thread-safe.

    Attributes:
        wake: rung when there are some.
    """

    def __init__(self) -> None:
        self.wake = Wake()
        self._lock = threading.Lock()
        self._runs: dict[str, None] = {}

    def __len__(self) -> int:
        with self._lock:
            return len(self._runs)

    def add(self, run_ids: Iterable[str]) -> None:
        """These too, once what they have reported is committed."""
        added = dict.fromkeys(run_ids)
        if added:
            with self._lock:
                self._runs |= added
            self.wake.ring()

    def take(self) -> str | None:
        """The one that came first, who is no longer among them; None where there is none."""
        with self._lock:
            run_id = next(iter(self._runs), None)
            if run_id is not None:
                del self._runs[run_id]
            return run_id

"""The playgrounds that are open, each its owner's alone; they live in memory and are forgotten when nobody uses them."""

import threading
import time
from collections.abc import Callable

from server.errors import BusyError, NotFoundError
from server.playground.ground import Ground
from server.security.principal import Principal

PLAY_PREFIX = "play-"
"""Of the ids of playgrounds: no run's id has a hyphen."""

MAX_OPEN = 64
"""Playgrounds at a time; one takes some kilobytes while nobody watches."""
MAX_EACH = 4
"""Of one person: who opens another loses the one that was used longest ago."""
FORGOTTEN_SECONDS = 3_600.0
"""After the last use."""


def owner_of(principal: Principal) -> str:
    """Whose what somebody opens is."""
    return principal.user_id or principal.name


class Playgrounds:
    """Those that are open. Thread-safe.

    Args:
        clock: seconds, for tests.
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._lock = threading.Lock()
        self._grounds: dict[str, Ground] = {}

    def add(self, ground: Ground) -> None:
        """Another one is open.

        Raises:
            BusyError: too many are.
        """
        with self._lock:
            now = self._clock()
            self._grounds = {name: each for name, each in self._grounds.items() if now - each.used_at < FORGOTTEN_SECONDS}
            own = sorted(
                (each for each in self._grounds.values() if each.owner == ground.owner), key=lambda one: one.used_at
            )
            for each in own[: len(own) + 1 - MAX_EACH] if len(own) >= MAX_EACH else []:
                del self._grounds[each.id]
            if len(self._grounds) >= MAX_OPEN:
                raise BusyError(f"{MAX_OPEN} playgrounds are open already. Try again later.", retry_after=60.0)
            self._grounds[ground.id] = ground

    def get(self, identifier: str) -> Ground:
        """One of them.

        Raises:
            NotFoundError: there is none of that id any more.
        """
        with self._lock:
            ground = self._grounds.get(identifier)
        if ground is None:
            raise NotFoundError.of("playground", identifier)
        return ground

    def of(self, identifier: str, principal: Principal) -> Ground:
        """One of somebody's own.

        Raises:
            NotFoundError: there is none, or it is somebody else's.
        """
        ground = self.get(identifier)
        if ground.owner != owner_of(principal):
            raise NotFoundError.of("playground", identifier)
        return ground

    def close(self, identifier: str) -> None:
        """It is not used any more."""
        with self._lock:
            self._grounds.pop(identifier, None)

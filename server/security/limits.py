"""A brake on guessing tokens."""

import time
from collections import defaultdict, deque
from collections.abc import Callable

from starlette.requests import HTTPConnection

from server.errors import TooManyAttemptsError

_MAX_FAILURES = 10
_WINDOW_SECONDS = 60.0
# More addresses than this within a minute are an attack from many; forgetting them all bounds the memory.
_MAX_ADDRESSES = 10_000


class LoginLimiter:
    """Counts wrong tokens by client address: ten a minute, then no more are looked at. Used on the event loop only."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self._failures: defaultdict[str, deque[float]] = defaultdict(deque)

    def check(self, connection: HTTPConnection) -> None:
        """Look before comparing a token.

        Raises:
            TooManyAttemptsError: too many wrong ones came from this address lately.
        """
        failures = self._failures.get(_address(connection))
        if failures is None:
            return
        while failures and failures[0] < self._clock() - _WINDOW_SECONDS:
            failures.popleft()
        if len(failures) >= _MAX_FAILURES:
            raise TooManyAttemptsError("Too many wrong tokens from your address: wait a minute.")

    def failed(self, connection: HTTPConnection) -> None:
        """Note a wrong token."""
        if len(self._failures) >= _MAX_ADDRESSES:
            self._failures.clear()
        self._failures[_address(connection)].append(self._clock())


def _address(connection: HTTPConnection) -> str:
    return connection.client.host if connection.client else ""

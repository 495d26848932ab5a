"""A brake on guessing secrets that never locks out who holds the right one."""

import asyncio
import hashlib
import ipaddress
import time
from collections import OrderedDict, deque
from collections.abc import Callable
from dataclasses import dataclass, field

from starlette.requests import HTTPConnection

from server.errors import TooManyAttemptsError

_MAX_FAILURES = 10
_WINDOW_SECONDS = 60.0
# Attempts of an address that has guessed too often wait in a line, and are looked at one in so many seconds.
_PAUSE_SECONDS = 1.0
_MAX_WAITING = 8
# More addresses than this within a minute are an attack from many; the one that guessed longest ago is forgotten.
_MAX_ADDRESSES = 10_000
# A network is given to one customer at least this large: who guesses may use each of its addresses.
_IPV6_CUSTOMER_BITS = 64


@dataclass
class _Guesser:
    """An address that sent wrong secrets lately."""

    failures: deque[tuple[float, bytes]] = field(default_factory=deque)
    line: asyncio.Lock = field(default_factory=asyncio.Lock)
    waiting: int = 0


class GuessLimiter:
    """Counts wrong secrets of every kind by client address: after ten within a minute, further ones are refused.

    A login token may be one that a person thought of, so it is not even compared at full speed any more: attempts from
    that address take turns, one a second, and the right one is let in when its turn comes. Cookies and workers' tokens are
    too long to be guessed: the right one is let in at once, always. Used on the event loop only.

    Args:
        clock: seconds that only grow.
        pause: seconds between two turns.
        on_guess: called for every wrong secret that counts.
    """

    def __init__(
        self,
        clock: Callable[[], float] = time.monotonic,
        pause: float = _PAUSE_SECONDS,
        on_guess: Callable[[], None] = lambda: None,
    ) -> None:
        self._clock = clock
        self._on_guess = on_guess
        self._pause = pause
        self._guessers: OrderedDict[str, _Guesser] = OrderedDict()

    async def turn(self, connection: HTTPConnection) -> None:
        """Wait for the turn of a login token from this address; at once where it has not guessed too often.

        Raises:
            TooManyAttemptsError: too many wait already.
        """
        guesser = self._guessers.get(_address(connection))
        if guesser is None or not self._over(guesser):
            return
        if guesser.waiting >= _MAX_WAITING:
            raise self._refusal(guesser)
        guesser.waiting += 1
        try:
            async with guesser.line:
                await asyncio.sleep(self._pause)
        finally:
            guesser.waiting -= 1

    def failed(self, connection: HTTPConnection, secret: str, *, once: bool = False) -> None:
        """Note a wrong secret.

        Args:
            connection: that brought it.
            secret: which.
            once: the same one again is no new guess: a browser sends a cookie that has expired with every request.

        Raises:
            TooManyAttemptsError: too many wrong ones came from this address lately.
        """
        address = _address(connection)
        digest = hashlib.blake2b(secret.encode(errors="surrogateescape"), digest_size=8).digest()
        guesser = self._guessers.setdefault(address, _Guesser())
        self._guessers.move_to_end(address)
        if len(self._guessers) > _MAX_ADDRESSES:
            self._guessers.popitem(last=False)
        over = self._over(guesser)
        if once and any(digest == known for _, known in guesser.failures):
            return
        self._on_guess()
        guesser.failures.append((self._clock(), digest))
        if len(guesser.failures) > _MAX_FAILURES:
            guesser.failures.popleft()
        if over:
            raise self._refusal(guesser)

    def _over(self, guesser: _Guesser) -> bool:
        while guesser.failures and guesser.failures[0][0] < self._clock() - _WINDOW_SECONDS:
            guesser.failures.popleft()
        return len(guesser.failures) >= _MAX_FAILURES

    def _refusal(self, guesser: _Guesser) -> TooManyAttemptsError:
        wait = guesser.failures[0][0] + _WINDOW_SECONDS - self._clock()
        return TooManyAttemptsError("Too many wrong tokens from your address: wait a minute.", retry_after=wait)


def _address(connection: HTTPConnection) -> str:
    """Whose failures count together."""
    host = connection.client.host if connection.client else ""
    try:
        address = ipaddress.ip_address(host.partition("%")[0])
    except ValueError:
        return host
    if isinstance(address, ipaddress.IPv6Address):
        if address.ipv4_mapped is not None:
            return str(address.ipv4_mapped)
        return str(ipaddress.ip_network((address, _IPV6_CUSTOMER_BITS), strict=False))
    return str(address)

"""Whether the service can do its work: each part is asked for an answer, and none of them can keep the asker waiting."""

import asyncio
import time
from collections.abc import Awaitable, Callable

import anyio
from anyio import CapacityLimiter, to_thread

from server.services import Services
from server.system.schemas import Readiness

# A part that is slower than this does not work.
_SECONDS = 3.0
# Everybody may ask; the answer is looked for once in so long.
_KEPT_SECONDS = 1.0
# Sweeps come five a lease; one that is later than this by more than a lease has stopped.
_LATE_SECONDS = 10.0


class ReadinessProbe:
    """Asks the parts of a service. Used on the event loop.

    Args:
        services: to ask.
        seconds: after which a part counts as silent.
    """

    def __init__(self, services: Services, seconds: float = _SECONDS) -> None:
        self._services = services
        self._seconds = seconds
        # Of its own, so that neither readers nor workers keep it from asking; who hangs keeps a thread, and there are few.
        self._limiter = CapacityLimiter(4)
        self._asking = asyncio.Lock()
        self._answer: tuple[float, Readiness] | None = None

    async def ask(self) -> Readiness:
        """What each part says; as it was up to a second ago."""
        async with self._asking:
            if self._answer is None or time.monotonic() - self._answer[0] > _KEPT_SECONDS:
                self._answer = time.monotonic(), await self._ask_all()
            return self._answer[1]

    async def _ask_all(self) -> Readiness:
        services = self._services
        parts: dict[str, Callable[[], Awaitable[object]]] = {
            "database": lambda: self._on_thread(services.database.ping),
            "store": lambda: self._on_thread(services.files.ping),
            "sweeper": self._sweeper,
            "readers": lambda: to_thread.run_sync(_nothing),
            "workers": lambda: services.lanes.workers.run(_nothing),
        }
        found = await asyncio.gather(*(self._check(part) for part in parts.values()))
        checks = dict(zip(parts, found, strict=True))
        return Readiness(ready=all(found == "ok" for found in checks.values()), checks=checks)

    async def _check(self, ask: Callable[[], Awaitable[object]]) -> str:
        try:
            with anyio.fail_after(self._seconds):
                await ask()
        except TimeoutError:
            return f"no answer within {self._seconds:g} s"
        except Exception:
            # Why stands in the server's log and in `mapless doctor`: this answer is for everybody.
            return "failed"
        return "ok"

    async def _on_thread(self, ask: Callable[[], object]) -> None:
        await to_thread.run_sync(ask, limiter=self._limiter, abandon_on_cancel=True)

    async def _sweeper(self) -> None:
        if self._services.pulse.age > self._services.settings.lease_seconds + _LATE_SECONDS:
            raise TimeoutError


def _nothing() -> None:
    """What takes no time, where there is a thread for it."""

"""Processes that drive finished policies for whoever watches: what a worker's link is to a training, these are after it."""

import asyncio
import contextlib
import logging
import os
import sys
import tempfile
from collections.abc import AsyncGenerator, Callable
from pathlib import Path

from server.live.hub import LiveHub, TooManyViewsError
from server.processes import ROOT
from workers.frames import FrameError
from workers.reporting import WatchRequest

_log = logging.getLogger(__name__)

# As `workers.live.drive` writes them; its module imports the simulator, which the server never does.
_LENGTH_BYTES = 4


class PolicyDrivers:
    """One process for each finished policy that is watched.

    Lives on the server's event loop, as the hub does.

    Args:
        hub: takes their frames, and says what somebody wants to see.
        capacity: processes at the same time; each takes 150 MB and, while watched, a few percent of a core.
        linger: seconds that one outlives its last watcher, so that a reload finds it again.
    """

    def __init__(self, hub: LiveHub, *, capacity: int = 4, linger: float = 10.0) -> None:
        self._hub = hub
        self._capacity = capacity
        self._linger = linger
        self._drivers: dict[str, _Driver] = {}

    @contextlib.asynccontextmanager
    async def driving(self, subject: str, save: Callable[[Path], None]) -> AsyncGenerator[None]:
        """Keeps a policy driving for as long as the context lasts.

        Args:
            subject: under which the hub knows it.
            save: writes its archive to a file.

        Raises:
            TooManyViewsError: the cap on processes is reached.
        """
        driver = self._drivers.get(subject)
        if driver is None or driver.ended:
            if (reason := self.refusal(subject)) is not None:
                raise TooManyViewsError(reason)
            driver = self._drivers[subject] = _Driver(self._hub, subject, save)
        driver.watchers += 1
        try:
            yield
        finally:
            driver.watchers -= 1
            asyncio.get_running_loop().call_later(self._linger, self._end_if_unwatched, subject, driver)

    def refusal(self, subject: str) -> str | None:
        """Why this policy can't drive now, and what to do about it; None where it drives, or has room to."""
        driver = self._drivers.get(subject)
        if driver is not None and not driver.ended:
            return None
        if sum(not other.ended for other in self._drivers.values()) < self._capacity:
            return None
        return f"{self._capacity} finished policies are watched already. Close one of their pages, and this one drives."

    async def close(self) -> None:
        """Ends every process."""
        drivers, self._drivers = tuple(self._drivers.values()), {}
        for driver in drivers:
            await driver.end()

    def _end_if_unwatched(self, subject: str, driver: "_Driver") -> None:
        if not driver.watchers and self._drivers.get(subject) is driver:
            del self._drivers[subject]
            driver.cancel()


class _Driver:
    """One process, and the task that reads its frames."""

    def __init__(self, hub: LiveHub, subject: str, save: Callable[[Path], None]) -> None:
        self.watchers = 0
        self._hub = hub
        self._subject = subject
        self._save = save
        self._task = asyncio.get_running_loop().create_task(self._run())

    @property
    def ended(self) -> bool:
        """Whether the process is gone."""
        return self._task.done()

    def cancel(self) -> None:
        """Ends the process soon."""
        self._task.cancel()

    async def end(self) -> None:
        """Ends the process and waits until it is gone."""
        self.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self._task

    async def _run(self) -> None:
        with tempfile.TemporaryDirectory(prefix="mapless-live-") as scratch:
            archive = Path(scratch) / "policy.zip"
            try:
                await asyncio.to_thread(self._save, archive)
                await self._drive(archive)
            except asyncio.CancelledError:
                raise
            except Exception:
                # Whatever it is, the server and all other views go on.
                _log.exception("The live view of the finished policy %s has ended", self._subject)

    async def _drive(self, archive: Path) -> None:
        path = os.pathsep.join(filter(None, (str(ROOT), os.environ.get("PYTHONPATH"))))
        process = await asyncio.create_subprocess_exec(
            sys.executable,
            "-m",
            "workers.live.drive",
            str(archive),
            stdin=asyncio.subprocess.PIPE,
            stdout=asyncio.subprocess.PIPE,
            env={**os.environ, "OMP_NUM_THREADS": "1", "PYTHONPATH": path},
        )
        assert process.stdin is not None
        assert process.stdout is not None
        wishes = process.stdin

        def tell(request: WatchRequest | None) -> None:
            line = "null" if request is None else request.model_dump_json()
            if not wishes.is_closing():
                wishes.write(f"{line}\n".encode())

        detach = self._hub.attach_driver(self._subject, tell)
        try:
            with contextlib.suppress(asyncio.IncompleteReadError):
                while True:
                    length = int.from_bytes(await process.stdout.readexactly(_LENGTH_BYTES), "little")
                    frame = await process.stdout.readexactly(length)
                    with contextlib.suppress(FrameError):
                        self._hub.driven_frames(self._subject, frame)
        finally:
            detach()
            with contextlib.suppress(ProcessLookupError):
                process.kill()
            await asyncio.shield(process.wait())

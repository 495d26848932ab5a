"""Finished policies that workers drive for whoever watches: what a link is to a training, a view job is after it."""

import asyncio
import contextlib
import logging
from collections.abc import AsyncGenerator
from dataclasses import dataclass, field
from functools import partial
from typing import TYPE_CHECKING, Protocol

from server.errors import ServiceError
from server.ids import new_id
from server.jobs.asked import Asked
from server.jobs.needed import nobody_for
from server.jobs.repository import OPEN
from server.live.hub import LiveHub, TooManyViewsError
from server.outage import patiently
from workers.errors import FrameError
from workers.frames import Frame
from workers.job_protocol import FRAME_LENGTH_BYTES, WatchedJob
from workers.play_protocol import PlayOrders, PlaySeen
from workers.reporting import WatchRequest

if TYPE_CHECKING:
    from collections.abc import Callable

    from server.jobs.service import JobService

logger = logging.getLogger(__name__)

_LOOK_SECONDS = 1.0


class Player(Protocol):
    """A playground: what its worker is to know, and what comes back."""

    def orders(self, revision: int) -> PlayOrders | None:
        """What a worker has to know that has those of `revision`; None where nothing is new."""

    def take_frame(self, frame: Frame) -> None:
        """A moment has arrived."""

    def take_seen(self, seen: PlaySeen) -> None:
        """What is about to happen has arrived."""


@dataclass(frozen=True)
class Driven:
    """A finished policy to look at.

    Attributes:
        job: what a worker is asked to do.
        sha256: of the policy's archive.
        title: for people.
        player: the playground that it is in; None where it drives as it likes.
    """

    job: WatchedJob
    sha256: str
    title: str
    player: Player | None = None


@dataclass(eq=False)
class _Driver:
    """One view job, and who has it."""

    subject: str
    player: Player | None = None
    watchers: int = 0
    job_id: str | None = None
    failure: str | None = None
    waits_in_vain: str | None = None
    wish: WatchRequest | None = None
    detach: "Callable[[], None] | None" = None
    task: "asyncio.Task[None] | None" = field(default=None)

    @property
    def ended(self) -> bool:
        return self.task is not None and self.task.done()


class PolicyDrivers:
    """One view job for each finished policy that is watched.

    Lives on the server's event loop, as the hub does.

    Args:
        hub: takes their frames, and says what somebody wants to see.
        capacity: view jobs at the same time; each takes 150 MB of a worker and, while watched, a few percent of a core.
        linger: seconds that one outlives its last watcher, so that a reload finds it again.
    """

    def __init__(self, hub: LiveHub, *, capacity: int = 4, linger: float = 10.0) -> None:
        self._hub = hub
        self._capacity = capacity
        self._linger = linger
        self._drivers: dict[str, _Driver] = {}
        self._by_job: dict[str, _Driver] = {}

    @contextlib.asynccontextmanager
    async def driving(self, jobs: "JobService", subject: str, driven: Driven) -> AsyncGenerator[None]:
        """Keeps a policy driving for as long as the context lasts.

        Args:
            jobs: where it is asked for.
            subject: under which the hub knows it.
            driven: the policy.

        Raises:
            TooManyViewsError: the cap on view jobs is reached.
        """
        driver = self._drivers.get(subject)
        if driver is None or driver.ended:
            if self._full(subject) is not None:
                self._end_one_unwatched()
            if (reason := self._full(subject)) is not None:
                raise TooManyViewsError(reason)
            driver = self._drivers[subject] = _Driver(subject, driven.player)
            driver.task = asyncio.create_task(self._keep(jobs, driver, driven))
        driver.watchers += 1
        try:
            yield
        finally:
            driver.watchers -= 1
            asyncio.get_running_loop().call_later(self._linger, self._end_if_unwatched, driver)

    def refusal(self, subject: str) -> str | None:
        """Why this policy can't drive now, and what to do about it; None where it drives, or has room to."""
        driver = self._drivers.get(subject)
        if driver is not None and driver.ended and driver.failure is not None:
            return driver.failure
        if driver is not None and driver.waits_in_vain:
            return driver.waits_in_vain
        return self._full(subject)

    def frames(self, job_id: str, data: bytes | None = None) -> WatchRequest | None:
        """The job's worker is there, with frames (each after its length) or without; what somebody wants to see."""
        driver = self._by_job.get(job_id)
        if driver is None:
            return None
        if driver.detach is None:
            driver.detach = self._hub.attach_driver(driver.subject, lambda wish: setattr(driver, "wish", wish))
        for encoded in _split(data or b""):
            with contextlib.suppress(FrameError):
                frame = encoded if driver.player is None else Frame.decode(encoded)
                if driver.player is not None and isinstance(frame, Frame):
                    driver.player.take_frame(frame)
                self._hub.driven_frames(driver.subject, frame)
        return driver.wish

    def orders(self, job_id: str, revision: int, seen: PlaySeen | None = None) -> PlayOrders | None:
        """What the worker of a playground has to know that has those of `revision`, and perhaps tells what it sees."""
        driver = self._by_job.get(job_id)
        if driver is None or driver.player is None:
            return None
        if seen is not None:
            driver.player.take_seen(seen)
        return driver.player.orders(revision)

    async def close(self) -> None:
        """Ends every view."""
        for driver in tuple(self._drivers.values()):
            if driver.task is not None:
                driver.task.cancel()
                with contextlib.suppress(asyncio.CancelledError):
                    await driver.task

    def _full(self, subject: str) -> str | None:
        driver = self._drivers.get(subject)
        if driver is not None and not driver.ended:
            return None
        if sum(not other.ended for other in self._drivers.values()) < self._capacity:
            return None
        return f"{self._capacity} finished policies are watched already. Close one of their pages, and this one drives."

    def _end_one_unwatched(self) -> None:
        """Who has looked away gives way to who looks: one slides along the checkpoints of a run."""
        lingering = (driver for driver in self._drivers.values() if not driver.watchers and not driver.ended)
        if (driver := next(lingering, None)) is not None:
            self._end_if_unwatched(driver)

    def _end_if_unwatched(self, driver: _Driver) -> None:
        if not driver.watchers and self._drivers.get(driver.subject) is driver:
            del self._drivers[driver.subject]
            if driver.task is not None:
                driver.task.cancel()

    async def _keep(self, jobs: "JobService", driver: _Driver, driven: Driven) -> None:
        """Asks for the job, waits for its end, and takes it back when nobody watches any more."""
        # Each view is a job of its own: what comes out of it is not kept.
        asked = Asked(driven.job, f"view-{new_id()}", driven.title, driven.sha256)
        try:
            driver.job_id = await asyncio.shield(jobs.lane.run(jobs.ask, asked))
            self._by_job[driver.job_id] = driver
            with jobs.board.asking(driver.job_id) as ended:
                look = partial(jobs.lane.run, jobs.find, driver.job_id)
                while (job := await patiently(look)).state in OPEN and not jobs.board.closed:
                    lacking = await patiently(partial(jobs.lane.run, jobs.lacking, job))
                    nobody = job.state == "queued" and (bool(lacking) or not jobs.board.workers())
                    driver.waits_in_vain = nobody_for("drives finished policies", lacking) if nobody else None
                    if job.state == "queued":
                        self._left(driver)
                    with contextlib.suppress(TimeoutError):
                        async with asyncio.timeout(_LOOK_SECONDS):
                            await ended.wait()
            driver.failure = f"This view has ended. {job.error or ''}".strip()
        except ServiceError as error:
            driver.failure = error.message
        except Exception:
            # Whatever it is, the server and all other views go on.
            logger.exception("The live view of the finished policy %s has ended", driver.subject)
            driver.failure = "This view has ended: the server's log says why."
        finally:
            self._left(driver)
            if driver.job_id is not None:
                self._by_job.pop(driver.job_id, None)
                jobs.board.start(patiently(partial(jobs.lane.run, jobs.cancel, driver.job_id)))

    @staticmethod
    def _left(driver: _Driver) -> None:
        """No worker has the job."""
        if driver.detach is not None:
            driver.detach()
            driver.detach = None


def _split(data: bytes) -> list[bytes]:
    """Frames, each after its length; what is cut short is none."""
    frames = []
    start = 0
    while start + FRAME_LENGTH_BYTES <= len(data):
        length = int.from_bytes(data[start : start + FRAME_LENGTH_BYTES], "little")
        start += FRAME_LENGTH_BYTES + length
        if start <= len(data):
            frames.append(data[start - length : start])
    return frames

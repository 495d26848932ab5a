"""What has changed, told to whoever listens in this process, at a price that does not grow with their number.

Changes of half a second are one event. It is written once for all who show the same; each listener has a short queue of
such events, and one that reads too slowly, or was away for too long, is told to read everything anew ("resync").
"""

import asyncio
import secrets
import threading
from collections import OrderedDict, deque
from collections.abc import AsyncIterator, Callable, Collection, Iterator, Mapping
from contextlib import contextmanager

from server.errors import BusyError
from server.events.changes import Change, Shown
from server.outage import patiently

# Seconds between two events: a page redraws once a second.
_PAUSE = 0.5
# Of the newest changes, for whoever comes back: each is three short names.
_REMEMBERED = 4096
# Events that wait for a listener; eight seconds' worth.
_QUEUE = 16
_MAX_LISTENERS = 1000
# Proxies close a stream on which nothing comes for a minute; a client that has gone is noticed by sending.
_SILENCE = 15.0

_PING = b": still here\n\n"


def _event(position: str, name: str, data: str) -> bytes:
    return f"id: {position}\nevent: {name}\ndata: {data}\n\n".encode()


class Subscription:
    """One listener's pending events. Belongs to the event loop."""

    def __init__(self, shown: Shown | None, projects: frozenset[str] | None = None) -> None:
        self.shown = shown
        self.projects = projects
        self._pending: deque[bytes] = deque()
        self._closed = False
        self._woken = asyncio.Event()

    def put(self, event: bytes, resync: bytes) -> None:
        """Add an event; a queue that is full becomes the one event that stands for all."""
        if len(self._pending) >= _QUEUE:
            self._pending.clear()
            event = resync
        self._pending.append(event)
        self._woken.set()

    def close(self) -> None:
        """End the stream once what is pending has been read."""
        self._closed = True
        self._woken.set()

    async def events(self, silence: float = _SILENCE) -> AsyncIterator[bytes]:
        """Server-sent events as they come, as bytes; a comment where none comes for `silence` seconds."""
        while True:
            while self._pending:
                yield self._pending.popleft()
            if self._closed:
                return
            self._woken.clear()
            try:
                await asyncio.wait_for(self._woken.wait(), silence)
            except TimeoutError:
                yield _PING


class EventBus:
    """Fans changes out to subscriptions; `publish` may be called from any thread, after the commit that it tells of.

    Args:
        pause: seconds between two events of a stream.
        remembered: that many of the newest changes are told to whoever comes back and says where it was.
        find_projects: the project of each of the experiments, on a thread; asked for what `belongs` has not told, and only
            while somebody listens who may not hear everything.
    """

    def __init__(
        self,
        pause: float = _PAUSE,
        remembered: int = _REMEMBERED,
        find_projects: Callable[[Collection[str]], Mapping[str, str]] = lambda _: {},
    ) -> None:
        self._find_projects = find_projects
        self._pause = pause
        self._remembered = remembered
        self._lock = threading.Lock()
        # Each change with the number under which it happened last, the newest at the end.
        self._recent: OrderedDict[Change, int] = OrderedDict()
        self._newest = 0
        self._forgotten = 0
        self._told = 0
        # Numbers of another process of ours mean nothing here.
        self._epoch = secrets.token_hex(4)
        self._subscriptions: set[Subscription] = set()
        self._projects: OrderedDict[str, str] = OrderedDict()
        self._loop: asyncio.AbstractEventLoop | None = None
        self._woken = asyncio.Event()
        self._asleep = True
        self._teller: asyncio.Task[None] | None = None
        self._closed = False

    @property
    def listeners(self) -> int:
        """How many streams are open."""
        return len(self._subscriptions)

    @property
    def position(self) -> str:
        """Before which everything has been published; from any thread."""
        return f"{self._epoch}-{self._newest}"

    def publish(self, change: Change) -> None:
        """Tell everybody whom it concerns; equal changes that wait are one."""
        with self._lock:
            self._newest += 1
            self._recent[change] = self._newest
            self._recent.move_to_end(change)
            if len(self._recent) > self._remembered:
                _, self._forgotten = self._recent.popitem(last=False)
            wake, self._asleep = self._asleep and self._loop is not None, False
        if wake:
            self._wake()

    def belongs(self, experiment_id: str, project_id: str) -> None:
        """Say in which project an experiment is, from now on; from any thread."""
        with self._lock:
            self._projects[experiment_id] = project_id
            self._projects.move_to_end(experiment_id)
            if len(self._projects) > self._remembered:
                self._projects.popitem(last=False)

    @contextmanager
    def subscribe(
        self, shown: Shown | None = None, since: str | None = None, projects: frozenset[str] | None = None
    ) -> Iterator[Subscription]:
        """Listen to the end of the block; on the event loop.

        Args:
            shown: what the listener shows; None for everything.
            since: the position from which it goes on; None from now on.
            projects: it hears of these only; None for all.

        Raises:
            BusyError: so many listen that another one would harm them all.
        """
        if len(self._subscriptions) >= _MAX_LISTENERS:
            raise BusyError(f"{_MAX_LISTENERS} pages are open already: close some.", retry_after=_SILENCE)
        subscription = Subscription(shown, projects)
        with self._lock:
            missed = self._since(since)
            if missed and projects is not None:
                # Where a change belongs may have to be looked up, which is not done on the event loop.
                unknown = any(change.experiment_id not in self._projects for change in missed)
                missed = None if unknown else self._heard(missed, projects)
            position = self.position
        subscription.put(_event(position, "opened", "{}"), b"")
        if missed is None:
            subscription.put(self._resync(), b"")
        elif told := _told(missed, shown):
            subscription.put(_event(position, "changes", _json(told)), b"")
        self._subscriptions.add(subscription)
        if self._closed:
            subscription.close()
        elif self._teller is None:
            with self._lock:
                # What was published before anybody listened is nobody's news.
                self._told, self._asleep = self._newest, True
                self._loop = asyncio.get_running_loop()
            self._teller = self._loop.create_task(self._tell())
        try:
            yield subscription
        finally:
            self._subscriptions.discard(subscription)

    def close(self) -> None:
        """End every subscription, those to come included; called when the server begins to shut down, on its loop."""
        self._closed = True
        self._wake()
        for subscription in tuple(self._subscriptions):
            subscription.close()

    async def _tell(self) -> None:
        """Write an event for each group of listeners whenever something has changed."""
        while not self._closed:
            await self._woken.wait()
            self._woken.clear()
            if any(subscription.projects is not None for subscription in self._subscriptions):
                await patiently(lambda: asyncio.to_thread(self._look_up))
            self._tell_now()
            await asyncio.sleep(self._pause)

    def _tell_now(self) -> None:
        with self._lock:
            self._asleep = True
            # More than can be remembered happened at once: nobody knows what.
            lost = self._forgotten > self._told
            batch = self._after(self._told)
            self._told = self._newest
            position = self.position
        resync = self._resync()
        texts: dict[tuple[Shown | None, frozenset[str] | None], bytes] = {}
        for subscription in tuple(self._subscriptions):
            audience = subscription.shown, subscription.projects
            if audience not in texts:
                told = _told(self._heard(batch, subscription.projects), subscription.shown)
                texts[audience] = resync if lost else _event(position, "changes", _json(told)) if told else b""
            if event := texts[audience]:
                subscription.put(event, resync)

    def _look_up(self) -> None:
        """Learn where the changes that are to be told belong."""
        with self._lock:
            changed = {change.experiment_id for change in self._after(self._told)}
            unknown = [each for each in changed if each is not None and each not in self._projects]
        if not unknown:
            return
        for experiment_id, project_id in self._find_projects(unknown).items():
            self.belongs(experiment_id, project_id)

    def _heard(self, changes: list[Change], projects: frozenset[str] | None) -> list[Change]:
        """The changes of experiments in these projects; where one belongs that nobody can say, it is not told."""
        if projects is None:
            return changes
        return [change for change in changes if self._projects.get(change.experiment_id or "") in projects]

    def _since(self, position: str | None) -> list[Change] | None:
        """What was told after a position; None where that is not known."""
        if position is None:
            return []
        epoch, _, number = position.partition("-")
        if epoch != self._epoch or not number.isdecimal() or not self._forgotten <= int(number) <= self._newest:
            return None
        return self._after(int(number))

    def _after(self, number: int) -> list[Change]:
        """The remembered changes after a number, oldest first; costs as many steps as there are."""
        found = []
        for change in reversed(self._recent):
            if self._recent[change] <= number:
                break
            found.append(change)
        return found[::-1]

    def _resync(self) -> bytes:
        return _event(self.position, "resync", "{}")

    def _wake(self) -> None:
        # The loop may have ended before its listeners did, at shutdown; nobody is left to be woken then.
        if self._loop is not None and not self._loop.is_closed():
            self._loop.call_soon_threadsafe(self._woken.set)


def _told(changes: list[Change], shown: Shown | None) -> list[Change]:
    return changes if shown is None else shown.of(changes)


def _json(changes: list[Change]) -> str:
    return f"[{','.join(change.model_dump_json() for change in changes)}]"

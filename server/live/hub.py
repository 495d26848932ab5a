"""Who watches which run: brings the frames of a worker's link to the browsers, and their wishes back to the worker.

The hub lives on the server's event loop, and every method is called from there. For the worker's link:

    hub: LiveHub = services.live
    detach = hub.attach(run_id, on_watch)    # `on_watch(WatchRequest | None)`: now, and again whenever it changes
    hub.frames(run_id, data)                 # for every binary message, in order; returns at once
    detach()                                 # when the link ends

After a training, `attach_driver` and `driven_frames` are the same for a process that drives by its best policy.

Nobody watches: `on_watch(None)`, and frames that still come are dropped unread.
"""

import asyncio
import contextlib
import time
from collections.abc import AsyncGenerator, Callable, Coroutine
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from server.live.scoreboard import Score
from server.live.settings import RECEIVING_SECONDS, LiveSettings, LiveStatus
from sim.config import TaskConfig
from sim.errors import MaplessError
from workers.frames import Frame
from workers.reporting import WatchRequest
from workers.scene.themes import Theme

if TYPE_CHECKING:
    from server.live.picture import Sight
    from workers.scene.stage import Stage

_T = TypeVar("_T")

WatchCallback = Callable[[WatchRequest | None], None]


class LiveError(MaplessError):
    """The live view cannot be shown; the message says why."""


class TooManyViewsError(LiveError):
    """So many runs are being watched that another view would harm them all."""


class View(Protocol):
    """The scene of one run in one theme, on a port of its own."""

    @property
    def port(self) -> int:
        """Port of the scene's WebSocket on 127.0.0.1."""

    def look(self) -> "Sight":
        """For a browser that watches: what moves in the scene, as it changes."""

    def show(self, frame: Frame) -> None:
        """Queues a frame; returns at once, and drops what cannot be shown in time.

        Raises:
            FrameError: the frame is of another task.
        """

    def apply(self, settings: LiveSettings, connected: bool) -> None:
        """Changes what is shown; `connected` tells whether a worker is there to send frames."""

    def score(self) -> Score:
        """What the head-up display shows."""

    def close(self) -> None:
        """Stops the thread and the port; blocks until both are gone."""


class ViewFactory(Protocol):
    """Builds the scene of a run, or of a playground with its stage."""

    def __call__(  # noqa: D102 - its class says it
        self, task: TaskConfig, theme: Theme, settings: LiveSettings, stage: "Stage | None" = None, /
    ) -> View: ...


@dataclass
class _Screen:
    """A scene that is being watched, was a moment ago, or is about to be."""

    watchers: int = 0
    view: View | None = None
    lock: asyncio.Lock = field(default_factory=asyncio.Lock)


@dataclass
class _Channel:
    """All that is known about one run's live view.

    Attributes:
        common: of which mode and speed count, since whoever drives sends one picture to all: as somebody chose last.
        chosen: what each person has chosen, where that is not what everybody has at first.
    """

    common: LiveSettings = field(default_factory=LiveSettings)
    chosen: dict[str, LiveSettings] = field(default_factory=dict)
    callbacks: list[WatchCallback] = field(default_factory=list)
    driver: WatchCallback | None = None
    told: WatchRequest | None = None
    screens: dict[tuple[str, Theme], _Screen] = field(default_factory=dict)
    last_frame: float = float("-inf")
    playground: bool = False

    @property
    def views(self) -> list[tuple[str, View]]:
        """Who looks, and at which scene."""
        return [
            (person, screen.view)
            for (person, _), screen in self.screens.items()
            if screen.watchers and screen.view is not None
        ]

    def settings_of(self, person: str) -> LiveSettings:
        """What a person sees, or would see."""
        own = self.chosen.get(person, _AT_FIRST)
        return own.model_copy(update={"mode": self.common.mode, "speed": self.common.speed})

    def choose(self, person: str, settings: LiveSettings) -> None:
        """Follows a person's choice."""
        self.common = settings
        self.chosen[person] = settings

    @property
    def connected(self) -> bool:
        """Whether anybody is there to send frames."""
        return bool(self.callbacks) or self.driver is not None

    def request(self) -> WatchRequest | None:
        """What is asked of whoever drives: as many robots as anybody who looks wants to see."""
        watching = [self.settings_of(person) for person, _ in self.views]
        return max(watching, key=lambda one: one.robots).watch_request() if watching else None


_AT_FIRST = LiveSettings()


class LiveHub:
    """The live views of all runs. A person is named by the account; what all share, as a playground, is nobody's: "".

    Args:
        view_factory: builds the scene of a run; called in a thread, at the first watcher.
        linger: seconds that a scene outlives its last watcher, so that a reload finds it again.
        capacity: scenes at the same time; each is a thread of viser's and about a megabyte.
    """

    def __init__(self, view_factory: ViewFactory, *, linger: float = 10.0, capacity: int = 32) -> None:
        self._view_factory = view_factory
        self._linger = linger
        self._capacity = capacity
        self._channels: dict[str, _Channel] = {}
        self._open_scenes = 0
        self._tasks: set[asyncio.Task[Any]] = set()

    # -- the worker's side ------------------------------------------------------------------------------------------------

    def attach(self, run_id: str, on_watch: WatchCallback) -> Callable[[], None]:
        """A worker is linked for this run.

        Args:
            run_id: the run that it trains.
            on_watch: called before this returns and at every change with what somebody wants to see, None for nothing.

        Returns:
            What to call when the link has ended; calling it twice does no harm.
        """
        channel = self._channel(run_id)
        channel.callbacks.append(on_watch)
        on_watch(channel.request())
        self._apply(channel)

        def detach() -> None:
            if on_watch in channel.callbacks:
                channel.callbacks.remove(on_watch)
                self._apply(channel)

        return detach

    def attach_driver(self, run_id: str, on_watch: WatchCallback) -> Callable[[], None]:
        """The same for whoever drives by a finished policy; while a worker is linked, its frames are the ones shown."""
        channel = self._channel(run_id)
        channel.driver = on_watch
        on_watch(channel.request())
        self._apply(channel)

        def detach() -> None:
            if channel.driver is on_watch:
                channel.driver = None
                self._apply(channel)

        return detach

    def driven_frames(self, run_id: str, data: bytes | Frame) -> None:
        """A frame of the driver has arrived; see `frames`."""
        if not self._channel(run_id).callbacks:
            self.frames(run_id, data)

    def frames(self, run_id: str, data: bytes | Frame) -> None:
        """A frame has arrived; dropped where nobody watches.

        Raises:
            FrameError: `data` is no frame of this version or task (checked only while somebody watches).
        """
        channel = self._channels.get(run_id)
        if channel is None or not (views := channel.views):
            return
        frame = data if isinstance(data, Frame) else Frame.decode(data)
        for _, view in views:
            view.show(frame)
        channel.last_frame = time.monotonic()

    def watch_request(self, run_id: str) -> WatchRequest | None:
        """What somebody wants to see of this run now; None where nobody watches."""
        channel = self._channels.get(run_id)
        return channel.request() if channel else None

    # -- the pages' side --------------------------------------------------------------------------------------------------

    def settings(self, run_id: str, person: str = "") -> LiveSettings:
        """What the live view of this run shows to a person, or would show."""
        return self._channels.get(run_id, _NOBODY).settings_of(person)

    def configure(self, run_id: str, settings: LiveSettings, person: str = "") -> None:
        """Changes what the live view of this run shows: mode and speed for all who watch it, the rest for a person."""
        channel = self._channel(run_id)
        channel.choose(person, settings)
        self._apply(channel)

    def status(self, run_id: str) -> LiveStatus:
        """Whether the live view of this run has anything to show."""
        channel = self._channels.get(run_id, _NOBODY)
        return LiveStatus(
            connected=channel.connected,
            receiving=time.monotonic() - channel.last_frame < RECEIVING_SECONDS,
            watchers=sum(screen.watchers for screen in channel.screens.values()),
        )

    @contextlib.asynccontextmanager
    async def watch(
        self, run_id: str, task: TaskConfig, theme: Theme = "light", stage: "Stage | None" = None, person: str = ""
    ) -> AsyncGenerator[View]:
        """Counts a watcher of this run for as long as the context lasts.

        Args:
            run_id: what is watched.
            task: what to draw.
            theme: light or dark.
            stage: of a playground.
            person: who watches, in a scene of their own.

        Raises:
            TooManyViewsError: the cap on scenes is reached.
        """
        channel = self._channel(run_id)
        channel.playground = stage is not None
        screen = channel.screens.setdefault((person, theme), _Screen())
        screen.watchers += 1
        try:
            # Shielded: a browser that leaves meanwhile must not leave a scene behind that nobody knows of.
            yield await asyncio.shield(self._start(self._open(channel, screen, task, theme, stage, person)))
        finally:
            screen.watchers -= 1
            self._apply(channel)
            if not screen.watchers:
                asyncio.get_running_loop().call_later(self._linger, self._close_if_unwatched, screen)

    @property
    def open_scenes(self) -> int:
        """How many scenes there are, those that nobody watches for the moment included."""
        return self._open_scenes

    @property
    def watchers(self) -> int:
        """How many browsers watch any run; from any thread."""
        return sum(
            screen.watchers for channel in tuple(self._channels.values()) for screen in tuple(channel.screens.values())
        )

    def score(self, run_id: str, theme: Theme, person: str = "") -> Score:
        """What the head-up display of a person's scene shows."""
        channel = self._channels.get(run_id, _NOBODY)
        screen = channel.screens.get((person, theme))
        if screen is None or screen.view is None:
            score = Score(state="waiting" if channel.connected else "no worker")
            if self._open_scenes >= self._capacity:
                score = score.model_copy(update={"refusal": self._full})
        else:
            score = screen.view.score()
        driven = channel.driver is not None and not channel.callbacks
        return score.model_copy(update={"after_training": driven, "playground": channel.playground})

    async def close(self) -> None:
        """Closes every scene; the hub is of no use afterwards."""
        for channel in self._channels.values():
            for screen in channel.screens.values():
                self._start(self._close(screen))
        while self._tasks:
            await asyncio.gather(*self._tasks, return_exceptions=True)

    # ---------------------------------------------------------------------------------------------------------------------

    @property
    def _full(self) -> str:
        return f"{self._capacity} live views are open already. Close one of their pages, and this one opens."

    def _channel(self, run_id: str) -> _Channel:
        return self._channels.setdefault(run_id, _Channel())

    def _apply(self, channel: _Channel) -> None:
        """Tells the scene and the worker's link where they stand, the latter only what is new to it."""
        for person, view in channel.views:
            view.apply(channel.settings_of(person), channel.connected)
        request = channel.request()
        if request != channel.told:
            channel.told = request
            for on_watch in (*channel.callbacks, *filter(None, [channel.driver])):
                on_watch(request)

    def _start(self, work: Coroutine[Any, Any, _T]) -> asyncio.Task[_T]:
        """A task of the hub's own, which outlives whoever waits for it."""
        task = asyncio.get_running_loop().create_task(work)
        self._tasks.add(task)
        task.add_done_callback(self._tasks.discard)
        return task

    async def _open(
        self, channel: _Channel, screen: _Screen, task: TaskConfig, theme: Theme, stage: "Stage | None", person: str
    ) -> View:
        async with screen.lock:
            if screen.view is None:
                if self._open_scenes >= self._capacity:
                    raise TooManyViewsError(self._full)
                self._open_scenes += 1
                try:
                    settings = channel.settings_of(person)
                    screen.view = await asyncio.to_thread(self._view_factory, task, theme, settings, stage)
                except BaseException:
                    self._open_scenes -= 1
                    raise
            self._apply(channel)
            return screen.view

    def _close_if_unwatched(self, screen: _Screen) -> None:
        if not screen.watchers and screen.view is not None:
            self._start(self._close(screen, unless_watched=True))

    async def _close(self, screen: _Screen, *, unless_watched: bool = False) -> None:
        async with screen.lock:
            if screen.view is None or (unless_watched and screen.watchers):
                return
            view, screen.view = screen.view, None
            await asyncio.to_thread(view.close)
            self._open_scenes -= 1


_NOBODY = _Channel()

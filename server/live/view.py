"""The scene of one watched run on a viser server of its own."""

import logging
import threading
import time

from server.live.artist import ARTIST
from server.live.picture import Picture, Sight
from server.live.playout import PlayoutBuffer
from server.live.scoreboard import Score, Scoreboard, ViewState
from server.live.settings import MAX_ROBOTS, RECEIVING_SECONDS, LiveSettings
from sim.config import MAX_MOVERS, ArenaPool, TaskConfig
from workers.errors import FrameError
from workers.frames import Frame
from workers.scene.camera import CameraRig
from workers.scene.quiet import start_viser, stop_viser
from workers.scene.scene import Scene
from workers.scene.stage import Stage
from workers.scene.themes import Theme

logger = logging.getLogger(__name__)

COMPLAIN_SECONDS = 10.0
"""Between two messages of a view that cannot draw."""


class LiveView:
    """One run in one theme: a viser server on a free port of 127.0.0.1, and what moves in its scene.

    Calls come from any thread and return at once; only the artist's thread touches the scene.

    Args:
        task: arena, robot and LiDAR to draw.
        theme: light or dark.
        settings: what to show.
        stage: of a playground, which draws what stands in the arena.
    """

    def __init__(self, task: TaskConfig, theme: Theme, settings: LiveSettings, stage: Stage | None = None) -> None:
        self._server = start_viser()
        self._rays = task.lidar.scan_size
        self._arenas = task.arena.maps if isinstance(task.arena, ArenaPool) else 1
        self._picture = Picture(self._server)
        self._scene = Scene(self._server, task, theme, self._picture)
        self._stage = None if stage is None else self._scene.add_stage(stage)
        self._camera = CameraRig(self._server, self._scene.half_size)
        self._scoreboard = Scoreboard()
        self._lock = threading.Lock()
        self._buffer = PlayoutBuffer()
        self._settings = settings
        self._connected = False
        self._arrived = float("-inf")
        self._positions: list[list[float]] = []
        self._complained = float("-inf")
        self._drawing = threading.Lock()
        self._closed = False
        ARTIST.add(self)

    @property
    def port(self) -> int:
        """Port of the scene's WebSocket on 127.0.0.1."""
        return self._server.get_port()

    def look(self) -> Sight:
        """For a browser that watches, on the event loop that it is served by."""
        return self._picture.look()

    def show(self, frame: Frame) -> None:
        """Queues a frame; returns at once, and drops what cannot be shown in time.

        Raises:
            FrameError: the frame is of another task.
        """
        robots, rays = frame.ranges.shape
        if rays != self._rays or frame.arena >= self._arenas or not 1 <= robots <= MAX_ROBOTS:
            raise FrameError(f"{robots} robots with {rays} rays in arena {frame.arena}: not what this training has")
        if len(frame.movers) > MAX_MOVERS:
            raise FrameError(f"{len(frame.movers)} movers: an arena has {MAX_MOVERS} at most, not what this training has")
        with self._lock:
            self._buffer.put(frame)
            self._arrived = time.monotonic()

    def apply(self, settings: LiveSettings, connected: bool) -> None:
        """Changes what is shown; `connected` tells whether a worker is there to send frames."""
        with self._lock:
            if (settings.mode, settings.robots) != (self._settings.mode, self._settings.robots):
                self._buffer.clear()
            self._settings = settings
            self._connected = connected

    def score(self) -> Score:
        """What the head-up display shows."""
        with self._lock:
            silent: ViewState = "waiting" if self._connected else "no worker"
            live = time.monotonic() - self._arrived < RECEIVING_SECONDS
            return self._scoreboard.score("live" if live else silent, self._settings.follow)

    def close(self) -> None:
        """Closes the port; blocks until it is gone and nothing is drawn any more."""
        ARTIST.remove(self)
        with self._drawing:
            self._closed = True
        stop_viser(self._server)

    def draw(self, now: float) -> tuple[Sight, ...]:
        """Draws what is due; called by the artist.

        Args:
            now: seconds of a steady clock.

        Returns:
            Who has something new to see.
        """
        with self._drawing:
            if self._closed:
                return ()
            try:
                self._tick(now)
                return self._picture.sights if self._picture.publish() else ()
            except Exception:
                # The next frame may be drawn: a view that stood still for ever would look as if the robots did.
                if now - self._complained > COMPLAIN_SECONDS:
                    logger.exception("a frame could not be drawn")
                    self._complained = now
                return ()

    def _tick(self, now: float) -> None:
        with self._lock:
            frame = self._buffer.take()
            settings = self._settings
            if frame is not None:
                frame = frame.of_first(settings.robots)  # somebody else may watch more of them
                self._scoreboard.update(frame)
        self._scene.show_rays(settings.rays, None if settings.ray_robots == "all" else settings.follow or 0)
        self._camera.follow(settings.follow, now)
        if frame is not None:
            self._positions = frame.poses[:, :2].tolist()
            self._scene.update(frame, now)
        if self._stage is not None:
            with self._server.atomic():
                self._stage.update(frame)
        self._scene.centre_on(*self._camera.centre(self._positions, now))

"""Makes the frames of a training that somebody watches: a thread beside the training that sends thirty a second.

The training's own thread does next to nothing for it: a look at one attribute per step and per update while nobody
watches, and a copy of a few arrays or weights while somebody does.
"""

import threading
import time
from collections.abc import Callable
from typing import TYPE_CHECKING

from sim.arrays import PolicyFunction
from sim.config import TaskConfig
from workers.live.clips import ClipRecorder
from workers.live.showcase import Showcase
from workers.reporting import Reporter, WatchRequest

if TYPE_CHECKING:
    from sim.envs.vector import NavigationVectorEnv

FRAME_RATE = 30.0
"""Frames per second of wall time."""

# Newer weights than this make no difference to the eye, and a copy takes time from the training.
_WEIGHTS_INTERVAL = 0.2
# This far behind, the view gives up catching up: it goes on from now.
_TOO_LATE = 0.25


class LiveViewer:
    """A `workers.live.viewing.TrainingViewer` that watches what its reporter asks for.

    Args:
        task: environment of the training.
        reporter: says what to watch and takes the frames; its calls come from two threads.
    """

    def __init__(self, task: TaskConfig, reporter: Reporter) -> None:
        self._task = task
        self._reporter = reporter
        self._thread: threading.Thread | None = None
        self._closing = threading.Event()
        self._recorder: ClipRecorder | None = None
        self._policy: tuple[PolicyFunction, int] | None = None
        self._policy_at = float("-inf")

    def on_step(self, env: "NavigationVectorEnv", step: int) -> None:
        """After each step of the training robots; see `TrainingViewer`."""
        recorder = self._recorder
        if recorder is not None:
            recorder.record(env, step)

    def on_weights(self, snapshot: Callable[[], PolicyFunction], step: int) -> None:
        """After each update; see `TrainingViewer`."""
        request = self._reporter.watch
        if request is None or self._closing.is_set():
            return
        now = time.monotonic()
        if request.mode == "policy" and now - self._policy_at >= _WEIGHTS_INTERVAL:
            self._policy = (snapshot(), step)
            self._policy_at = now
        if self._thread is None or not self._thread.is_alive():
            self._thread = threading.Thread(target=self._watch, args=(step,), name="live-viewer", daemon=True)
            self._thread.start()

    def close(self) -> None:
        """Ends the view and waits for its thread."""
        self._closing.set()
        if self._thread is not None:
            self._thread.join()

    def _watch(self, step: int) -> None:
        """Sends frames until nobody watches any more. Whatever goes wrong here must not touch the training."""
        try:
            self._send_frames()
        except Exception as error:
            self._closing.set()
            self._reporter.event(step, "warning", f"The live view of this training has stopped: {error!r}.")
        finally:
            self._recorder = None

    def _send_frames(self) -> None:
        showcase: Showcase | None = None
        due = time.monotonic()
        while not self._closing.wait(max(0.0, due - time.monotonic())):
            now = time.monotonic()
            due = now if now - due > _TOO_LATE else due
            due += 1.0 / FRAME_RATE
            request = self._reporter.watch
            if request is None:
                return
            if request.mode == "training":
                self._send_clip(request)
                continue
            self._recorder = None
            if self._policy is None:
                continue
            if showcase is None or showcase.robots != request.robots:
                showcase = Showcase(self._task, request.robots)
            policy, step = self._policy
            showcase.advance(policy, request.speed / FRAME_RATE)
            self._reporter.frames([showcase.frame(step, request.speed)])

    def _send_clip(self, request: WatchRequest) -> None:
        if self._recorder is None or self._recorder.robots != request.robots:
            self._recorder = ClipRecorder(request.robots, self._task.control_period, FRAME_RATE)
        frame = self._recorder.take()
        if frame is not None:
            self._reporter.frames([frame])

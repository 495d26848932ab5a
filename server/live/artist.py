"""One thread that draws all views, thirty times a second, or less often where the server has other things to do.

Pages and workers come first. A round is not begun before the event loop has taken up what the last one has brought, and
then not before as long again as that took; between two rounds there is at least the time that one takes. So where the
server is busy there are fewer frames, but none that is late.
"""

import contextlib
import threading
import time
from collections.abc import Iterable
from typing import Protocol

from server.live.picture import Sight
from server.live.playout import FRAMES_PER_SECOND

# A loop that is gone never answers, one that is merely stuck for so long gets another round.
_PATIENCE_SECONDS = 1.0


class Drawn(Protocol):
    """A view."""

    def draw(self, now: float) -> Iterable[Sight]:
        """Draws what is due; who has something new to see."""


class Artist:
    """Draws while there is anything to draw; from any thread."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._views: tuple[Drawn, ...] = ()
        self._thread: threading.Thread | None = None

    def add(self, view: Drawn) -> None:
        """The view is drawn from now on."""
        with self._lock:
            self._views = (*self._views, view)
            if self._thread is None:
                self._thread = threading.Thread(target=self._work, name="live-views", daemon=True)
                self._thread.start()

    def remove(self, view: Drawn) -> None:
        """The view is not drawn again, once a round that goes on is over."""
        with self._lock:
            self._views = tuple(other for other in self._views if other is not view)

    def _work(self) -> None:
        due = time.monotonic()
        while True:
            time.sleep(max(0.0, due - time.monotonic()))
            with self._lock:
                views = self._views
                if not views:
                    self._thread = None
                    return
            begun = time.monotonic()
            sights = [sight for view in views for sight in view.draw(begun)]
            drawn = time.monotonic()
            told = _tell(sights)
            due = next_round(due, begun, drawn, told)


def next_round(due: float, begun: float, drawn: float, told: float) -> float:
    """When the next round is due.

    Args:
        due: when the last one was.
        begun: when it began.
        drawn: when all views were drawn.
        told: when the event loop had taken it up.
    """
    return max(due + 1.0 / FRAMES_PER_SECOND, drawn + (drawn - begun), told + (told - drawn))


def _tell(sights: list[Sight]) -> float:
    """Wakes those who have something new to see; when all their event loops had answered."""
    for loop in {sight.loop for sight in sights}:
        answered = threading.Event()
        with contextlib.suppress(RuntimeError):  # the loop is closed
            loop.call_soon_threadsafe(_wake, [sight for sight in sights if sight.loop is loop], answered)
            answered.wait(_PATIENCE_SECONDS)
    return time.monotonic()


def _wake(sights: list[Sight], answered: threading.Event) -> None:
    for sight in sights:
        sight.wake()
    answered.set()


ARTIST = Artist()
"""Of this process: however many views there are, one thread draws them."""

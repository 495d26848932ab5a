"""Even pacing of frames that arrive unevenly: a small reserve is kept, and what is late is dropped."""

from collections import deque

from workers.frames import Frame

FRAMES_PER_SECOND = 30

# A tenth of a second absorbs the jitter of a busy worker; three times that and the view is late: the newest wins.
_RESERVE = 3
_LATE = 9


class PlayoutBuffer:
    """Frames in as they come, one out per tick of the display."""

    def __init__(self) -> None:
        self._frames: deque[Frame] = deque()
        self._filling = True

    def __len__(self) -> int:
        return len(self._frames)

    def put(self, frame: Frame) -> None:
        """A frame has arrived. One of another kind puts an end to what waits before it."""
        if self._frames and not _same_kind(self._frames[-1], frame):
            self.clear()
        self._frames.append(frame)
        if len(self._frames) > _LATE:
            while len(self._frames) > _RESERVE:
                self._frames.popleft()

    def take(self) -> Frame | None:
        """The frame to show in this tick; None keeps the picture as it is."""
        if self._filling and len(self._frames) < _RESERVE:
            return None
        self._filling = False
        if not self._frames:
            self._filling = True
            return None
        return self._frames.popleft()

    def clear(self) -> None:
        """Forgets what waits."""
        self._frames.clear()
        self._filling = True


def _same_kind(one: Frame, other: Frame) -> bool:
    return one.mode == other.mode and (one.mode == "training" or one.ranges.shape == other.ranges.shape)

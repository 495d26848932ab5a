"""Whether one frame goes on from another, and what ended in between."""

import numpy as np
from numpy.typing import NDArray

from workers.frames import Frame

# Wall seconds that may be missing between two frames before the later one counts as another clip.
_GAP_SECONDS = 0.5
_GAP_SIM_SECONDS = 0.5


def continues(last: Frame | None, frame: Frame) -> bool:
    """Whether `frame` shows the same robots as `last`, a moment later, rather than the beginning of another clip."""
    if last is None or last.mode != frame.mode or last.arena != frame.arena or last.ranges.shape != frame.ranges.shape:
        return False
    return 0.0 <= frame.sim_time - last.sim_time <= _GAP_SECONDS * frame.speed + _GAP_SIM_SECONDS


def ended(last: Frame, frame: Frame) -> NDArray[np.bool_]:
    """(robots,) whose attempt has ended between two frames of which one continues the other: their targets differ."""
    changed: NDArray[np.bool_] = (last.targets != frame.targets).any(axis=1) & (frame.outcomes > 0)
    return changed

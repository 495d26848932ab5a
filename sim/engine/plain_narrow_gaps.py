"""The gaps that one robot does not fit through, in plain Python: the reference of `sim.kernels.narrow_gaps`."""

import math
from collections import deque

import numpy as np

from sim.engine.plain_views import Place, PlainView, angle_of, end_of
from sim.kernels.narrow_gaps import NEAR_BY, POST, ROOM_TO_PASS, SAME_GAP
from sim.kernels.room import GAP_ROOM
from sim.kernels.views import VIEW_DIRECTIONS
from sim.kernels.walls import JUMP

Gap = tuple[Place, Place]
"""Where the line that closes a gap begins and ends, metres."""


class PlainGaps:
    """The gaps of one attempt that its robot does not fit through, the newest ones.

    Args:
        near: metres, see `sim.observations.near_distance`.
    """

    def __init__(self, near: float) -> None:
        self._width = 2.0 * ROOM_TO_PASS * near
        self._known: deque[Gap] = deque(maxlen=GAP_ROOM)

    def measure(self, view: PlainView) -> list[Gap]:
        """Those that a view measures and that were not known; from now on they are."""
        found = []
        for k in range(VIEW_DIRECTIONS):
            gap = self._beside(view, k)
            if gap is not None and not any(_is_same(gap, known) for known in self._known):
                self._known.append(gap)
                found.append(gap)
        return found

    def lead_through(self, begin: Place, end: Place) -> bool:
        """Whether the line from one place to another goes through one of them."""
        return any(crosses(begin, end, gap) for gap in self._known)

    def _beside(self, view: PlainView, k: int) -> Gap | None:
        """The gap between directions k and k + 1 of a view, if they show one and it is narrow and near by."""
        following = (k + 1) % VIEW_DIRECTIONS
        right, left = view.readings[k], view.readings[following]
        if min(right, left) <= 0.0 or abs(right - left) <= JUMP:
            return None
        near, beyond, step = (k, following, 1) if right < left else (following, k, -1)
        across = (beyond + step * np.arange(VIEW_DIRECTIONS // 4)) % VIEW_DIRECTIONS
        other = view.readings[across]
        edge = np.array(end_of(view, near, view.readings[near]))
        ends = np.stack((np.cos(angle_of(across)), np.sin(angle_of(across))), axis=1) * other[:, None] + view.place
        # A ray meets a post up to one direction's arc behind its edge, and half of that on average.
        widths = np.hypot(*(ends - edge).T) - math.pi / VIEW_DIRECTIONS * (view.readings[near] + other)
        widths[(other <= 0.0) | (other > NEAR_BY) | (view.readings[near] > NEAR_BY)] = math.inf
        least = int(widths.argmin())
        # Between two readings side by side no ray went through: a wall seen at a flat angle looks like this.
        if widths[least] >= self._width or least == 0:
            return None
        into = (ends[least] - edge) * POST / math.dist(edge, ends[least])
        (x, y), (other_x, other_y) = (edge - into).tolist(), (ends[least] + into).tolist()
        return (x, y), (other_x, other_y)


def crosses(begin: Place, end: Place, gap: Gap) -> bool:
    """Whether the line from one place to another crosses the one that closes a gap."""

    def is_left(start: Place, stop: Place, place: Place) -> bool:
        along, towards = (stop[0] - start[0], stop[1] - start[1]), (place[0] - start[0], place[1] - start[1])
        return along[0] * towards[1] - along[1] * towards[0] > 0.0

    one, other = gap
    return is_left(begin, end, one) != is_left(begin, end, other) and is_left(*gap, begin) != is_left(*gap, end)


def _is_same(gap: Gap, other: Gap) -> bool:
    """Whether both ends of two gaps are the same, whichever is named first."""
    return any(math.dist(gap[0], one) < SAME_GAP and math.dist(gap[1], two) < SAME_GAP for one, two in (other, other[::-1]))

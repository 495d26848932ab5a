"""Gaps that the robot measured from near by and does not fit through: no way and no sight leads through them.

Measured is the gap beside each jump of a view, from where the nearer of the two readings ends to where one of the 30 on the
other side does, both at most 1.6 m away: to the one to which it is the narrowest. Where that is the jump's other reading no
ray went through, as where a wall is seen at a flat angle: that is no gap. A ray meets a post up to 3 degrees behind its
edge, so half of that is taken from the width on each side. Below 1.125 times what the body needs it is closed by the line
between these ends, 0.1 m longer on either side. The newest 64 are remembered, two whose ends lie within 0.2 m are one.
"""

import numpy as np
from numpy.typing import NDArray

from .observation import Reals

NEAR_BY = 1.6
ROOM_TO_PASS = 1.125
POST = 0.1
SAME = 0.2
GAP_ROOM = 64


class Gaps:
    """The gaps of one way that the body does not fit through.

    Args:
        near: metres that the robot keeps from obstacles.
        jump: metres by which two readings side by side differ where what they met is not one thing.
    """

    def __init__(self, near: float, jump: float) -> None:
        self._width, self._jump = 2.0 * ROOM_TO_PASS * near, jump
        self._known: Reals = np.empty((0, 2, 2))

    def measure(self, readings: Reals, ends: Reals) -> list[Reals]:
        """The gaps that a view measures and that were not known, (2, 2) each: where their lines begin and end, metres.

        Args:
            readings: (directions,) of the view, metres.
            ends: (directions, 2) where they end, metres.
        """
        found = []
        following = np.roll(readings, -1)
        for k in np.flatnonzero((np.minimum(readings, following) > 0.0) & (np.abs(readings - following) > self._jump)):
            gap = self._beside(readings, ends, int(k))
            if gap is not None and not self._is_known(gap):
                self._known = np.concatenate((self._known, gap[None]))[-GAP_ROOM:]
                found.append(gap)
        return found

    def lead_through(self, begin: Reals, end: Reals) -> bool:
        """Whether the line from one place to another goes through one of them."""
        return bool(crossed(begin, end, self._known).any())

    def _beside(self, readings: Reals, ends: Reals, k: int) -> Reals | None:
        """The gap between directions k and k + 1, if it is narrow and near by."""
        count = len(readings)
        following = (k + 1) % count
        near, beyond, step = (k, following, 1) if readings[k] < readings[following] else (following, k, -1)
        across = (beyond + step * np.arange(count // 4)) % count
        other = readings[across]
        apart = np.hypot(*(ends[across] - ends[near]).T)
        widths = apart - np.pi / count * (readings[near] + other)
        widths[(other <= 0.0) | (other > NEAR_BY) | (readings[near] > NEAR_BY)] = np.inf
        least = int(widths.argmin())
        if widths[least] >= self._width or least == 0:
            return None
        one, two = ends[near], ends[across[least]]
        into = (two - one) * POST / apart[least]
        return np.stack((one - into, two + into))

    def _is_known(self, gap: Reals) -> bool:
        """Whether it is one of those that are remembered, whichever end is named first."""
        return any(
            bool((np.hypot(*np.moveaxis(known - gap, -1, 0)) < SAME).all(axis=-1).any())
            for known in (self._known, self._known[:, ::-1])
        )


def crossed(begin: Reals, end: Reals, gaps: Reals) -> NDArray[np.bool_]:
    """Which of the lines that close gaps (n, 2, 2) the one from one place to another crosses, (n,) bool."""
    one, two = gaps[:, 0], gaps[:, 1]
    of_gaps = _is_left(begin, end, one) != _is_left(begin, end, two)
    return np.asarray(of_gaps & (_is_left(one, two, begin) != _is_left(one, two, end)))


def _is_left(begin: Reals, end: Reals, place: Reals) -> NDArray[np.bool_]:
    """Whether places lie to the left of lines."""
    along, towards = end - begin, place - begin
    return np.asarray(along[..., 0] * towards[..., 1] - along[..., 1] * towards[..., 0] > 0.0)

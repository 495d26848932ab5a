"""What moves in an arena; where it starts and how it goes on is decided by the simulation (`sim.engine.movers`)."""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from sim.config import MoverKind

Kind = MoverKind | Literal["timed"]
"""How a mover goes; a timed one only comes from a file."""


@dataclass(frozen=True)
class Mover:
    """A disc that moves.

    Attributes:
        kind: how it goes.
        radius: metres.
        speed: top speed, m/s.
        waypoints: x, y, metres: the corners of a patrol's round, those of a pedestrian's route from its start on, or where a
            timed mover is at its `times`. A patrol without any goes to and fro on a line that is drawn when it starts, a
            pedestrian to places that are drawn one after another; with one alone, a pedestrian stays there.
        times: seconds from 0 on, one for each waypoint of a timed mover, in order.
        loops: whether a timed mover begins anew when its times are over, and a pedestrian its route; it stays where it is
            otherwise.
        sees_robots: whether it gives way to robots; to others a robot makes no difference. A timed one sees nothing.
    """

    kind: Kind
    radius: float
    speed: float
    waypoints: tuple[tuple[float, float], ...] = ()
    times: tuple[float, ...] = ()
    loops: bool = True
    sees_robots: bool = False

    @property
    def fastest(self) -> float:
        """Highest speed at which it ever goes, m/s."""
        legs = zip(pairwise(self.times), pairwise(self.waypoints), strict=True) if self.times else ()
        return max((math.dist(*places) / (after - before) for (before, after), places in legs), default=self.speed)

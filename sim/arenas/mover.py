"""What moves in an arena; where it starts and how it goes on is decided by the simulation (`sim.movers`)."""

from dataclasses import dataclass

from sim.config import MoverKind


@dataclass(frozen=True)
class Mover:
    """A disc that moves.

    Attributes:
        kind: how it goes.
        radius: metres.
        speed: top speed, m/s.
        waypoints: x, y, metres: the corners of a patrol's round. A patrol without any goes to and fro on a line that is
            drawn when it starts.
    """

    kind: MoverKind
    radius: float
    speed: float
    waypoints: tuple[tuple[float, float], ...] = ()

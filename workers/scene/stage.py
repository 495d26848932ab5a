"""What a playground draws beside robots and people, and what it hears of clicks and drags; `stage_nodes` draws it."""

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class StagePicture:
    """What there is to draw.

    Attributes:
        circles: (C, 3) x, y, radius.
        boxes: (B, 5) x, y, half length, half width, angle in radians.
        chosen: what has handles, and its place among those of its kind.
        way: (P, 2) where the robot is about to go.
        arrows: (A, 4) x, y of a place, and of where it would go from there.
        outcome: how the robot's attempt is about to end.
    """

    circles: NDArray[np.float64]
    boxes: NDArray[np.float64]
    chosen: tuple[str, int] | None
    way: NDArray[np.float64]
    arrows: NDArray[np.float64]
    outcome: str | None


class Stage(Protocol):
    """Whose stage it is; calls come from the threads of the scene and return at once."""

    def picture(self) -> StagePicture:
        """What there is to draw."""

    def shown(self, sim_time: float) -> None:
        """The moment that is drawn now, as frames say it."""

    def put(self, thing: str, index: int, x: float, y: float, heading: float) -> None:
        """Something was dragged; metres and degrees."""

    def choose(self, thing: str | None, index: int) -> None:
        """Something was clicked."""

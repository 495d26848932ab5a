"""What every family of arenas draws with: a plan with its dimensions, and walls with gaps."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

# How much wider than the robot's own space the narrowest and the widest passages are, metres.
_TIGHT, _WIDE = 0.4, 1.3

WALL = 0.12
"""Thickness of an inner wall, metres."""


@dataclass
class Plan:
    """A square floor, centred at the origin, that a family fills with circles and boxes.

    Attributes:
        size: edge of the floor, metres.
        difficulty: 0 to 1.
        clearance: what the robot needs around its centre, metres; every passage is wider than twice this.
        random: where everything that is random comes from.
    """

    size: float
    difficulty: float
    clearance: float
    random: np.random.Generator
    circles: list[tuple[float, float, float]] = field(default_factory=list)
    boxes: list[tuple[float, float, float, float, float]] = field(default_factory=list)

    @property
    def half(self) -> float:
        """Metres from the centre to a wall."""
        return 0.5 * self.size

    @property
    def passage(self) -> float:
        """Width of a passage at this difficulty, metres."""
        return 2.0 * self.clearance + self.between(_WIDE, _TIGHT)

    def between(self, easy: float, hard: float) -> float:
        """A value that goes from `easy` to `hard` with the difficulty."""
        return easy + (hard - easy) * self.difficulty

    def rectangle(self, low_x: float, low_y: float, high_x: float, high_y: float) -> None:
        """Add an upright box, unless it is empty."""
        if high_x - low_x > 1e-6 and high_y - low_y > 1e-6:
            self.boxes.append(
                (0.5 * (low_x + high_x), 0.5 * (low_y + high_y), 0.5 * (high_x - low_x), 0.5 * (high_y - low_y), 0.0)
            )

    def strip(self, across: bool, at: float, thickness: float, low: float, high: float) -> None:
        """Add a wall centred at `at`, from `low` to `high` along the other axis; `across` is along x, else along y."""
        if across:
            self.rectangle(low, at - 0.5 * thickness, high, at + 0.5 * thickness)
        else:
            self.rectangle(at - 0.5 * thickness, low, at + 0.5 * thickness, high)

    def turned(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """All circles (C, 3) and boxes (B, 5), turned by a random number of quarter turns."""
        circles = np.array(self.circles, dtype=np.float64).reshape(-1, 3)
        boxes = np.array(self.boxes, dtype=np.float64).reshape(-1, 5)
        for _ in range(int(self.random.integers(4))):
            for shapes in (circles, boxes):
                shapes[:, 0], shapes[:, 1] = -shapes[:, 1], shapes[:, 0].copy()
            # An upright box stays upright: its sides change places instead of its angle.
            upright = boxes[:, 4] == 0.0
            boxes[upright, 2:4] = boxes[upright, 3:1:-1]
            boxes[~upright, 4] += 0.5 * np.pi
        return circles, boxes

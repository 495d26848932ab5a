"""An arena is walls all round, circles, oriented boxes and movers; and how far a point is from what stands in it."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.arenas.mover import Mover
from sim.config import MAX_MOVERS
from sim.errors import ArenaError

Float = NDArray[np.float64]


def _no_circles() -> Float:
    return np.empty((0, 3))


def _no_boxes() -> Float:
    return np.empty((0, 5))


@dataclass(frozen=True, eq=False)
class Arena:
    """A walled rectangle centred at the origin with obstacles in it; metres and radians throughout.

    Attributes:
        name: what people call it.
        half_width, half_height: the walls' inner faces stand at x = ±half_width and y = ±half_height.
        circles: (C, 3) x, y, radius.
        boxes: (B, 5) x, y, half length, half width, angle of the length against the x axis.
        start_inset, target_inset: start poses and targets keep this far from the outer walls, on top of the clearance
            that they keep from everything.
        movers: what moves in it, at most `MAX_MOVERS`.

    Raises:
        ArenaError: a shape is not finite, has no size, or an array has the wrong shape; or there are too many movers.
    """

    name: str
    half_width: float = 5.0
    half_height: float = 5.0
    circles: Float = field(default_factory=_no_circles)
    boxes: Float = field(default_factory=_no_boxes)
    start_inset: float = 0.0
    target_inset: float = 0.0
    movers: tuple[Mover, ...] = ()

    def __post_init__(self) -> None:
        if not (0.0 < self.half_width < np.inf and 0.0 < self.half_height < np.inf):
            raise ArenaError(f"arena {self.name!r}: the walls need a positive, finite distance from the centre")
        for name, columns, sizes in (("circles", 3, slice(2, 3)), ("boxes", 5, slice(2, 4))):
            array = np.array(getattr(self, name), dtype=np.float64)
            if array.ndim != 2 or array.shape[1] != columns:
                raise ArenaError(f"arena {self.name!r}: {name} must have shape (n, {columns}), not {array.shape}")
            if not np.isfinite(array).all():
                raise ArenaError(f"arena {self.name!r}: {name} hold a number that is not finite")
            if (array[:, sizes] <= 0.0).any():
                raise ArenaError(f"arena {self.name!r}: {name} must have positive sizes")
            array.setflags(write=False)
            object.__setattr__(self, name, array)
        if len(self.movers) > MAX_MOVERS:
            raise ArenaError(f"arena {self.name!r}: {len(self.movers)} movers are too many: at most {MAX_MOVERS}")

    @property
    def diagonal(self) -> float:
        """Metres from corner to corner."""
        return 2.0 * float(np.hypot(self.half_width, self.half_height))


def free_distance(arena: Arena, points: ArrayLike) -> Float:
    """Signed distance from points to the nearest surface of what stands.

    Args:
        arena: the place.
        points: (..., 2) x, y in metres.

    Returns:
        (...) metres, negative inside an obstacle or beyond a wall. Inside an obstacle it is the depth in the nearest
        shape, exact for one shape on its own.
    """
    p = np.asarray(points, dtype=np.float64)
    x, y = p[..., 0], p[..., 1]
    distance: Any = np.minimum(arena.half_width - np.abs(x), arena.half_height - np.abs(y))
    for circle in arena.circles:
        distance = np.minimum(distance, circle_distance(circle, x, y))
    for box in arena.boxes:
        distance = np.minimum(distance, box_distance(box, x, y))
    return np.asarray(distance, dtype=np.float64)


def circle_distance(circle: Float, x: Float, y: Float) -> Float:
    """Signed distance from points to one circle, a row of `Arena.circles`; x and y broadcast."""
    return np.asarray(np.hypot(x - circle[0], y - circle[1]) - circle[2], dtype=np.float64)


def box_distance(box: Float, x: Float, y: Float) -> Float:
    """Signed distance from points to one box, a row of `Arena.boxes`; x and y broadcast."""
    cx, cy, half_length, half_width, angle = box
    along, across = x - cx, y - cy
    if angle != 0.0:  # walls along the axes need half of the time, where x and y are a row and a column
        cos, sin = np.cos(angle), np.sin(angle)
        along, across = cos * along + sin * across, cos * across - sin * along
    along, across = np.abs(along) - half_length, np.abs(across) - half_width
    outside = np.hypot(np.maximum(along, 0.0), np.maximum(across, 0.0))
    return np.asarray(outside + np.minimum(np.maximum(along, across), 0.0), dtype=np.float64)

"""Arenas as the kernels read them: one float32 table of each kind of shape for a whole pool."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sim.arenas import Arena
from sim.kernels.records import BOX_COLUMNS, CIRCLE_COLUMNS

_ROUNDING = 1e-5  # m by which a hull is larger than what it holds
_FAR = 1e6  # m

Shapes = tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.float32]]
"""Bounds, circles and boxes of a pool of arenas, as `sim.kernels.bundles.Geometry` has them."""


def pack_shapes(arenas: Sequence[Arena]) -> Shapes:
    """Bounds (M, 2), circles (M, C, 3) and boxes (M, B, 6) of a pool of arenas, padded with empty slots."""
    bounds = np.array([(arena.half_width, arena.half_height) for arena in arenas], dtype=np.float32)
    circles = np.full((len(arenas), max(len(a.circles) for a in arenas), CIRCLE_COLUMNS), -1.0, dtype=np.float32)
    boxes = np.full((len(arenas), max(len(a.boxes) for a in arenas), BOX_COLUMNS), -1.0, dtype=np.float32)
    for k, arena in enumerate(arenas):
        circles[k, : len(arena.circles)] = arena.circles
        boxes[k, : len(arena.boxes), :4] = arena.boxes[:, :4]
        boxes[k, : len(arena.boxes), 4] = np.cos(arena.boxes[:, 4])
        boxes[k, : len(arena.boxes), 5] = np.sin(arena.boxes[:, 4])
    return bounds, circles, boxes


def hulls(circles: NDArray[np.float32], boxes: NDArray[np.float32]) -> NDArray[np.float64]:
    """Discs round all circles (M, C, 3) and boxes (M, B, 6): (M, 3, C + B) x, y, radius, far away for an empty slot."""
    radii = np.concatenate([circles[..., 2], np.hypot(boxes[..., 2], boxes[..., 3])], axis=1)
    centres = np.concatenate([circles[..., :2], boxes[..., :2]], axis=1)
    present = np.concatenate([circles[..., 2], boxes[..., 2]], axis=1) > 0.0
    x = np.where(present, centres[..., 0], _FAR)
    return np.stack([x, centres[..., 1], radii + _ROUNDING], axis=1).astype(np.float64)

"""How far a rectangular body is from everything, written plainly; `sim.kernels.footprint` is the same compiled."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.arenas.geometry import Arena, box_distance

Float = NDArray[np.float64]


def rectangle_clearance(arena: Arena, pose: ArrayLike, half_length: float, half_width: float) -> float:
    """Signed distance from a rectangle to the nearest surface, metres.

    Outside of everything it is the distance; where the rectangle overlaps an obstacle or a wall it is negative: the depth
    along the axis in which the two are least apart.

    Args:
        arena: the place.
        pose: (3,) x, y of the rectangle's middle, metres, and direction of its length, radians.
        half_length: of the rectangle, metres.
        half_width: of the rectangle, metres.
    """
    x, y, heading = np.asarray(pose, dtype=np.float64)
    body = np.array([x, y, half_length, half_width, heading])
    corners = box_corners(body)
    beyond = np.array([arena.half_width, arena.half_height]) - np.abs(corners)
    distance = float(beyond.min())
    for circle in arena.circles:
        distance = min(distance, float(box_distance(body, circle[0], circle[1])) - float(circle[2]))
    for box in arena.boxes:
        distance = min(distance, _between(body, box))
    return distance


def box_corners(box: Float) -> Float:
    """Corners (4, 2) of a box, a row of `Arena.boxes`."""
    x, y, half_length, half_width, angle = box
    along = half_length * np.array([np.cos(angle), np.sin(angle)])
    across = half_width * np.array([-np.sin(angle), np.cos(angle)])
    corners: Float = np.array([x, y]) + np.array([-along - across, along - across, along + across, across - along])
    return corners


def _between(one: Float, other: Float) -> float:
    """Signed distance between two boxes: convex bodies are apart where an edge's normal separates them."""
    gaps = [_gap(one, other), _gap(other, one)]
    if max(gaps) <= 0.0:
        return max(gaps)
    # Two rectangles that are apart are nearest at a corner of one of them.
    nearest = [box_distance(box, *box_corners(corners).T).min() for box, corners in ((one, other), (other, one))]
    return float(min(nearest))


def _gap(box: Float, other: Float) -> float:
    """The wider of the two gaps that the axes of `box` see between it and `other`; negative where they overlap."""
    x, y, half_length, half_width, angle = box
    cos, sin = np.cos(angle), np.sin(angle)
    corners = (box_corners(other) - (x, y)) @ np.array([[cos, -sin], [sin, cos]])
    low, high = corners.min(axis=0), corners.max(axis=0)
    half = np.array([half_length, half_width])
    return float(np.maximum(low - half, -half - high).max())

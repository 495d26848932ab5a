"""Shortest paths around obstacles for a disc, by a visibility graph over the inflated shapes.

Circles and rounded corners are replaced by circumscribed polygons, so a path is at most a few millimetres per corner longer
than the true shortest one, and never touches an obstacle.
"""

import numpy as np
from numpy.typing import NDArray

from sim.arenas.geometry import Arena, free_distance

_CIRCLE_VERTICES = 24
_CORNER_VERTICES = 3  # of the polygon around a box's rounded corner, a quarter of a circle
_SLACK = 1e-6  # m; lets a path touch what it goes around

Float = NDArray[np.float64]


class PathPlanner:
    """Lengths of shortest paths in one arena.

    Args:
        arena: the place.
        clearance: distance that the centre of the disc keeps from everything, metres; its radius.
    """

    def __init__(self, arena: Arena, clearance: float) -> None:
        self._arena = arena
        self._clearance = clearance
        nodes = _corners(arena, clearance)
        self._nodes = nodes[free_distance(arena, nodes) >= clearance - _SLACK]
        lengths = self._visible_lengths(self._nodes, self._nodes)
        np.fill_diagonal(lengths, 0.0)
        for middle in range(len(lengths)):  # Floyd and Warshall, one row at a time
            np.minimum(lengths, lengths[:, middle, None] + lengths[middle], out=lengths)
        self._lengths = lengths

    def length(self, start: Float, target: Float) -> float:
        """Metres from `start` (2,) to `target` (2,); infinite when there is no way."""
        direct = float(self._visible_lengths(start[None], target[None])[0, 0])
        if np.isfinite(direct) or not len(self._nodes):
            return direct
        first = self._visible_lengths(start[None], self._nodes)[0]
        last = self._visible_lengths(self._nodes, target[None])[:, 0]
        return float((first[:, None] + self._lengths + last).min())

    def _visible_lengths(self, sources: Float, goals: Float) -> Float:
        """Lengths (n, m) of the straight ways from sources (n, 2) to goals (m, 2); infinite where one is blocked."""
        a = np.broadcast_to(sources[:, None], (len(sources), len(goals), 2))
        b = np.broadcast_to(goals, a.shape)
        reach = self._clearance - _SLACK
        clear = np.ones(a.shape[:2], dtype=np.bool_)
        for x, y, radius in self._arena.circles:
            clear &= _distance_to_segment(np.array([x, y]), a, b) >= radius + reach
        for box in self._arena.boxes:
            clear &= _box_to_segment(box, a, b) >= reach
        lengths = np.linalg.norm(b - a, axis=-1)
        return np.where(clear, lengths, np.inf)


def _corners(arena: Arena, clearance: float) -> Float:
    """Vertices of the polygons around all inflated shapes, (n, 2)."""
    half = np.pi / _CIRCLE_VERTICES
    turn = 2.0 * half * np.arange(_CIRCLE_VERTICES)
    ring = np.stack([np.cos(turn), np.sin(turn)], axis=-1) / np.cos(half)
    points = [np.empty((0, 2))]
    points += [circle[:2] + (circle[2] + clearance) * ring for circle in arena.circles]
    half = np.pi / 4 / _CORNER_VERTICES
    turn = half * (1 + 2 * np.arange(_CORNER_VERTICES))
    arc = clearance * np.stack([np.cos(turn), np.sin(turn)], axis=-1) / np.cos(half)
    for box in arena.boxes:
        quadrants = [np.array([sx, sy]) * (arc + box[2:4]) for sx in (-1, 1) for sy in (-1, 1)]
        points.append(np.concatenate(quadrants) @ _rotation(box[4]).T + box[:2])
    return np.concatenate(points)


def _rotation(angle: float) -> Float:
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def _distance_to_segment(point: Float, a: Float, b: Float) -> Float:
    """Distance from `point` (2,) to the segments from a (..., 2) to b (..., 2)."""
    along = b - a
    squared = np.maximum((along**2).sum(axis=-1), 1e-18)
    part = np.clip(((point - a) * along).sum(axis=-1) / squared, 0.0, 1.0)
    distance: Float = np.linalg.norm(a + part[..., None] * along - point, axis=-1)
    return distance


def _box_to_segment(box: Float, a: Float, b: Float) -> Float:
    """Distance from an oriented box to the segments from a (..., 2) to b (..., 2); 0 where they meet."""
    turn = _rotation(box[4])
    half = box[2:4]
    a, b = (a - box[:2]) @ turn, (b - box[:2]) @ turn
    # The part of the segment within the slab of each axis; the box is met where the parts overlap.
    along = np.where(np.abs(b - a) < 1e-12, 1e-12, b - a)
    enter = np.minimum((-half - a) / along, (half - a) / along).max(axis=-1)
    leave = np.maximum((-half - a) / along, (half - a) / along).min(axis=-1)
    meets = (enter <= leave) & (leave >= 0.0) & (enter <= 1.0)
    distance = np.minimum(*(np.linalg.norm(np.maximum(np.abs(end) - half, 0.0), axis=-1) for end in (a, b)))
    for corner in half * np.array([[-1, -1], [-1, 1], [1, -1], [1, 1]]):
        distance = np.minimum(distance, _distance_to_segment(corner, a, b))
    return np.where(meets, 0.0, distance)

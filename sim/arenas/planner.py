"""The shortest way for a disc robot between two points of an arena: what an efficient path is measured against.

Lazy Theta* (Nash, Koenig and Tovey, AAAI 2010) over the arena's free cells, 8-connected; whether two cells see each other is
decided on the exact geometry, not on the cells. Then the corners are pulled tight, again on the exact geometry.

Accuracy: the path keeps the clearance exactly, so its length is never below the true shortest; against closed forms (round a
pillar, round a corner, through a gap) it is less than 1 % above. A passage wider than twice the clearance by less than
2.5 cells (0.125 m) may be missed. A few milliseconds a query at 10 x 10 m.
"""

import heapq
import math
from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import ArrayLike, NDArray

from sim.arenas.cells import CELL, Grid, components, free_mask
from sim.arenas.geometry import Arena, free_distance
from sim.errors import PlacementError

Float = NDArray[np.float64]

# A start or target that keeps less than the clearance is joined to a free cell this near, metres.
_JOIN = 0.5
# Rounds of pulling and cutting, halvings within each, and the metres below which a cut is not worth a corner.
_ROUNDS = 8
_HALVINGS = 10
_WORTHWHILE = 1e-4
# Lets a path touch what it may touch, metres.
_TOLERANCE = 1e-9


@dataclass(frozen=True, eq=False)
class Path:
    """A way through an arena: (P, 2) corner points from start to target, and its length in metres."""

    points: Float
    length: float


class Planner:
    """Shortest paths through one arena for a robot that keeps `clearance` metres from everything."""

    def __init__(self, arena: Arena, clearance: float, cell: float = CELL) -> None:
        self.arena = arena
        self.clearance = clearance
        self._grid = Grid.over(arena, cell)
        self._labels, _ = components(free_mask(arena, clearance, cell))

    def shortest_path(self, start: ArrayLike, target: ArrayLike) -> Path:
        """The shortest path between two points, (2,) metres each.

        Raises:
            PlacementError: a point has no free cell nearby, or there is no path between them.
        """
        begin, end = np.asarray(start, dtype=np.float64), np.asarray(target, dtype=np.float64)
        if self._visible(begin, end, self.clearance):
            return _path(np.stack([begin, end]))
        first, last = self._join(begin), self._join(end)
        parts = self._labels[first], self._labels[last]
        if parts[0] != parts[1]:
            raise PlacementError(
                f"there is no path from {_point(begin)} to {_point(end)} in arena {self.arena.name!r} that keeps "
                f"{self.clearance:g} m clear: place them in the same part of the free space"
            )
        cells = _lazy_theta_star(
            self._labels == parts[0], self._grid.cell, first, last, *_geometry(self.arena), self.clearance - _TOLERANCE
        )
        rows, columns = cells.T
        corners = np.stack([self._grid.xs()[columns], self._grid.ys()[rows]], axis=1)
        points = np.concatenate([begin[None], corners, end[None]])
        return _path(_tighten(points, *_geometry(self.arena), self.clearance - _TOLERANCE))

    def _join(self, point: Float) -> tuple[int, int]:
        """The nearest free cell that a point reaches without coming closer to anything than it is or the path may be."""
        rows, columns = self._grid.window(point[0], point[1], _JOIN, _JOIN)
        near_rows, near_columns = np.nonzero(self._labels[rows, columns] >= 0)
        near_rows, near_columns = near_rows + rows.start, near_columns + columns.start
        centres = np.stack([self._grid.xs()[near_columns], self._grid.ys()[near_rows]], axis=1)
        distances = np.hypot(*(centres - point).T)
        clearance = min(self.clearance, float(free_distance(self.arena, point)))
        for index in np.argsort(distances, kind="stable"):
            if self._visible(point, centres[index], clearance):
                return int(near_rows[index]), int(near_columns[index])
        raise PlacementError(
            f"{_point(point)} is not in the free space of arena {self.arena.name!r}: a robot that keeps "
            f"{self.clearance:g} m clear does not fit there"
        )

    def _visible(self, begin: Float, end: Float, clearance: float) -> bool:
        (ax, ay), (bx, by) = begin.tolist(), end.tolist()
        return clearance > 0.0 and bool(_clear(ax, ay, bx, by, *_geometry(self.arena), clearance - _TOLERANCE))


def shortest_path(arena: Arena, start: ArrayLike, target: ArrayLike, clearance: float) -> Path:
    """The shortest path for one query; keep a `Planner` for several in the same arena.

    Raises:
        PlacementError: a point is not in the free space, or there is no path between them.
    """
    return Planner(arena, clearance).shortest_path(start, target)


def _path(points: Float) -> Path:
    return Path(points, float(np.hypot(*np.diff(points, axis=0).T).sum()))


def _point(point: Float) -> str:
    return f"({point[0]:.2f}, {point[1]:.2f})"


def _geometry(arena: Arena) -> tuple[float, float, Float, Float]:
    return arena.half_width, arena.half_height, arena.circles, arena.boxes


@njit(cache=True)
def _point_segment(px: float, py: float, ax: float, ay: float, bx: float, by: float) -> float:
    """Squared distance from a point to the segment a-b."""
    dx, dy = bx - ax, by - ay
    square = dx * dx + dy * dy
    t = 0.0 if square == 0.0 else min(max(((px - ax) * dx + (py - ay) * dy) / square, 0.0), 1.0)
    ex, ey = px - ax - t * dx, py - ay - t * dy
    return ex * ex + ey * ey


@njit(cache=True)
def _point_box(px: float, py: float, half_length: float, half_width: float) -> float:
    """Squared distance from a point to a box at the origin, 0 inside."""
    dx, dy = max(abs(px) - half_length, 0.0), max(abs(py) - half_width, 0.0)
    return dx * dx + dy * dy


@njit(cache=True)
def _crosses_box(ax: float, ay: float, bx: float, by: float, half_length: float, half_width: float) -> bool:
    """Whether the segment a-b meets a box at the origin (slab test)."""
    low, high = 0.0, 1.0
    for start, delta, half in ((ax, bx - ax, half_length), (ay, by - ay, half_width)):
        if delta == 0.0:
            if abs(start) > half:
                return False
        else:
            t0, t1 = (-half - start) / delta, (half - start) / delta
            low, high = max(low, min(t0, t1)), min(high, max(t0, t1))
    return low <= high


@njit(cache=True)
def _clear(
    ax: float, ay: float, bx: float, by: float, wide: float, high: float, circles: Float, boxes: Float, clearance: float
) -> bool:
    """Whether every point of the segment a-b keeps `clearance` from walls, circles and boxes."""
    if max(abs(ax), abs(bx)) > wide - clearance or max(abs(ay), abs(by)) > high - clearance:
        return False
    for i in range(len(circles)):
        reach = circles[i, 2] + clearance
        if _point_segment(circles[i, 0], circles[i, 1], ax, ay, bx, by) < reach * reach:
            return False
    square = clearance * clearance
    for i in range(len(boxes)):
        x, y, half_length, half_width, angle = boxes[i]
        reach = math.hypot(half_length, half_width) + clearance
        if _point_segment(x, y, ax, ay, bx, by) >= reach * reach:
            continue
        cos, sin = math.cos(angle), math.sin(angle)
        px, py = cos * (ax - x) + sin * (ay - y), cos * (ay - y) - sin * (ax - x)
        qx, qy = cos * (bx - x) + sin * (by - y), cos * (by - y) - sin * (bx - x)
        if _crosses_box(px, py, qx, qy, half_length, half_width):
            return False
        if min(_point_box(px, py, half_length, half_width), _point_box(qx, qy, half_length, half_width)) < square:
            return False
        for sx in (-half_length, half_length):
            for sy in (-half_width, half_width):
                if _point_segment(sx, sy, px, py, qx, qy) < square:
                    return False
    return True


@njit(cache=True)
def _lazy_theta_star(
    free: NDArray[np.bool_],
    cell: float,
    first: tuple[int, int],
    last: tuple[int, int],
    wide: float,
    high: float,
    circles: Float,
    boxes: Float,
    clearance: float,
) -> NDArray[np.int64]:
    """(K, 2) rows and columns of the corner cells from first to last, which must hang together."""
    rows, columns = free.shape
    first_row, first_column = first
    last_row, last_column = last
    left, low = (0.5 - 0.5 * columns) * cell, (0.5 - 0.5 * rows) * cell
    cost = np.full((rows, columns), np.inf)
    parent = np.full((rows, columns), -1, dtype=np.int64)
    closed = np.zeros((rows, columns), dtype=np.bool_)
    cost[first_row, first_column] = 0.0
    parent[first_row, first_column] = first_row * columns + first_column
    queue = [(0.0, first_row * columns + first_column)]
    while queue:
        _, here = heapq.heappop(queue)
        row, column = here // columns, here % columns
        if closed[row, column]:
            continue
        closed[row, column] = True
        r, c = parent[row, column] // columns, parent[row, column] % columns
        if not _clear(
            left + c * cell, low + r * cell, left + column * cell, low + row * cell, wide, high, circles, boxes, clearance
        ):
            # The parent was assumed to be in sight. It is not: come from the best neighbour that is settled.
            cost[row, column] = np.inf
            for r in range(max(row - 1, 0), min(row + 2, rows)):
                for c in range(max(column - 1, 0), min(column + 2, columns)):
                    if closed[r, c] and not (r == row and c == column):
                        through = cost[r, c] + math.hypot(r - row, c - column)
                        if through < cost[row, column]:
                            cost[row, column] = through
                            parent[row, column] = r * columns + c
        if row == last_row and column == last_column:
            break
        origin = parent[row, column]
        r0, c0 = origin // columns, origin % columns
        for r in range(max(row - 1, 0), min(row + 2, rows)):
            for c in range(max(column - 1, 0), min(column + 2, columns)):
                if free[r, c] and not closed[r, c]:
                    through = cost[r0, c0] + math.hypot(r - r0, c - c0)
                    if through < cost[r, c]:
                        cost[r, c] = through
                        parent[r, c] = origin
                        heapq.heappush(queue, (through + math.hypot(r - last_row, c - last_column), r * columns + c))
    found = [last_row * columns + last_column]
    start = first_row * columns + first_column
    while found[-1] != start:
        found.append(parent[found[-1] // columns, found[-1] % columns])
    cells = np.empty((len(found), 2), dtype=np.int64)
    for i in range(len(found)):
        cells[i, 0], cells[i, 1] = found[-1 - i] // columns, found[-1 - i] % columns
    return cells


@njit(cache=True)
def _tighten(points: Float, wide: float, high: float, circles: Float, boxes: Float, clearance: float) -> Float:
    """The path pulled tight: corners left out, moved towards their chords, cut off, until nothing is gained."""
    path = points
    for _ in range(_ROUNDS):
        path = _cut(_pull(path, wide, high, circles, boxes, clearance), wide, high, circles, boxes, clearance)
    return _pull(path, wide, high, circles, boxes, clearance)


@njit(cache=True)
def _pull(points: Float, wide: float, high: float, circles: Float, boxes: Float, clearance: float) -> Float:
    """The path without corners that can be left out, the others moved towards their chords as far as they go."""
    path = points.copy()
    count = len(path)
    i = 1
    while i < count - 1:
        ax, ay = path[i - 1]
        bx, by = path[i + 1]
        if _clear(ax, ay, bx, by, wide, high, circles, boxes, clearance):
            path[i : count - 1] = path[i + 1 : count].copy()
            count -= 1
            continue
        x, y = path[i]
        dx, dy = bx - ax, by - ay
        square = dx * dx + dy * dy
        t = 0.5 if square == 0.0 else min(max(((x - ax) * dx + (y - ay) * dy) / square, 0.0), 1.0)
        px, py = ax + t * dx - x, ay + t * dy - y
        reached, step = 0.0, 1.0
        for _ in range(_HALVINGS):
            step *= 0.5
            s = reached + step
            if _clear(ax, ay, x + s * px, y + s * py, wide, high, circles, boxes, clearance) and _clear(
                x + s * px, y + s * py, bx, by, wide, high, circles, boxes, clearance
            ):
                reached = s
        path[i, 0], path[i, 1] = x + reached * px, y + reached * py
        i += 1
    return path[:count].copy()


@njit(cache=True)
def _cut(points: Float, wide: float, high: float, circles: Float, boxes: Float, clearance: float) -> Float:
    """The path with every corner cut off by the longest clear edge across it, where that saves anything."""
    path = np.empty((2 * len(points), 2))
    path[0] = points[0]
    count = 1
    for i in range(1, len(points) - 1):
        x, y = points[i]
        # Towards the corner before, which may have been cut already, and half-way to the next, whose turn comes.
        ax, ay = path[count - 1, 0] - x, path[count - 1, 1] - y
        bx, by = 0.5 * (points[i + 1, 0] - x), 0.5 * (points[i + 1, 1] - y)
        a, b = math.hypot(ax, ay), math.hypot(bx, by)
        if a == 0.0 or b == 0.0:
            continue
        edge = min(a, b)
        reached, step = 0.0, 1.0
        for _ in range(_HALVINGS):
            step *= 0.5
            p, q = (reached + step) * edge / a, (reached + step) * edge / b
            if _clear(x + p * ax, y + p * ay, x + q * bx, y + q * by, wide, high, circles, boxes, clearance):
                reached += step
        p, q = reached * edge / a, reached * edge / b
        saved = 2.0 * reached * edge - math.hypot(p * ax - q * bx, p * ay - q * by)
        if saved > _WORTHWHILE:
            path[count, 0], path[count, 1] = x + p * ax, y + p * ay
            path[count + 1, 0], path[count + 1, 1] = x + q * bx, y + q * by
            count += 2
        else:
            path[count, 0], path[count, 1] = x, y
            count += 1
    path[count] = points[-1]
    return path[: count + 1].copy()

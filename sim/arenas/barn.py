"""Worlds as the BARN benchmark draws them (Perille, Truong, Xiao and Stone 2020, "Benchmarking Metric Ground Navigation").

A cellular automaton over 30 x 30 cells of 0.15 m, each of which may hold a pillar: filled with one of four chances, smoothed
two, three or four times; pockets that part the robot's side from the goal's are opened. The way that the challenge takes the
optimal time from leads from a random free cell of the field's near edge to one of its far edge, and to start and goal on
straight lines: it is not the shortest one.

The published worlds are drawn with other random numbers and are none of these.
"""

import heapq
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.arenas.cells import components
from sim.arenas.geometry import Arena
from sim.errors import ArenaError

Cells = NDArray[np.bool_]
Cell = tuple[int, int]

SIDE = 30
"""Cells along either side of the field."""

CELL = 0.15
"""Edge of a cell and diameter of a pillar, metres."""

FILLS, ROUNDS = (0.15, 0.20, 0.25, 0.30), (2, 3, 4)
"""Chances of a pillar, and rounds of smoothing: the benchmark has as many worlds of each of the twelve pairs."""

_CROWDED, _LONELY = 4, 2
_WIDTH, _LENGTH = SIDE * CELL, 14.0  # of the arena, m: the field, an open square before it and room behind it
_FIRST = 34  # rows of cells before the field, whose sides are walls
_START, _GOAL = (0.0, -4.0), (0.0, 6.0)
_KEEP = 2.0  # cells that the middle of the robot keeps from that of a pillar: half its width and half a pillar's
_NEAR = 0.25  # what a cell beside a pillar costs more
_ATTEMPTS = 20


@dataclass(frozen=True, eq=False)
class BarnWorld:
    """A world of the benchmark's kind.

    Attributes:
        arena: the field between its walls, metres.
        filled: (across, along) the cells that hold a pillar.
        free: likewise, where the middle of a robot has room.
        first: the random cell of the near edge at which the challenge's path enters the field.
        last: that of the far edge at which it leaves.
    """

    arena: Arena
    filled: Cells
    free: Cells
    first: Cell
    last: Cell

    @property
    def start(self) -> tuple[float, float, float]:
        """The robot's x, y and heading, metres and radians."""
        return (*_START, math.pi / 2)

    @property
    def target(self) -> tuple[float, float]:
        """Its goal, metres."""
        return _GOAL

    def path_length(self) -> float:
        """Metres of the challenge's path: from the start over the cells of its way to the goal."""
        way = shortest_way(self.free, self.filled, self.first, self.last)
        points = np.array([_START, *map(_centre, way), _GOAL])
        return float(np.hypot(*np.diff(points, axis=0).T).sum())


def barn_world(number: int, seed: int) -> BarnWorld:
    """World `number` of those of a seed.

    Args:
        number: from 0 on; it decides how full and how smooth the world is, modulo twelve.
        seed: of all that is random.

    Raises:
        ArenaError: no world came out; does not happen.
    """
    fill, rounds = FILLS[number % len(FILLS)], ROUNDS[number // len(FILLS) % len(ROUNDS)]
    for attempt in range(_ATTEMPTS):
        random = np.random.default_rng([seed, number, attempt])
        filled = _automaton(random, fill, rounds)
        labels = _regions(_free(filled))
        if not ((labels[:, 0] >= 0).any() and (labels[:, -1] >= 0).any()):
            continue
        filled = _connected(filled, labels)
        free = _free(filled)
        labels = _regions(free)
        near, far = (np.where(labels[:, column] >= 0, labels[:, column], labels.size) for column in (0, SIDE - 1))
        if near.min() != far.min():
            continue
        first, last = (int(random.choice(np.flatnonzero(edge == near.min()))) for edge in (near, far))
        return BarnWorld(_arena(f"barn-{seed}-{number}", filled), filled, free, (first, 0), (last, SIDE - 1))
    raise ArenaError(f"no world {number} of seed {seed} came out of {_ATTEMPTS} attempts")


def _automaton(random: np.random.Generator, fill: float, rounds: int) -> Cells:
    """The pillars: the first and last row are the sides, beyond which all counts as filled."""
    filled = random.random((SIDE, SIDE)) < fill
    filled[[0, -1]] = True
    for _ in range(rounds):
        around = np.pad(np.pad(filled, ((1, 1), (0, 0)), constant_values=True), ((0, 0), (1, 1))).astype(np.int8)
        neighbours = sum(around[i : i + SIDE, j : j + SIDE] for i in range(3) for j in range(3)) - filled
        filled = (filled | (neighbours > _CROWDED)) & (neighbours >= _LONELY)
    return np.asarray(filled)


def _free(filled: Cells) -> Cells:
    """Where the middle of a robot has room."""
    reach = math.ceil(_KEEP) - 1
    free = ~filled
    padded = np.pad(filled, reach)
    for i in range(-reach, reach + 1):
        for j in range(-reach, reach + 1):
            if math.hypot(i, j) < _KEEP:
                free &= ~padded[reach + i : reach + i + SIDE, reach + j : reach + j + SIDE]
    return free


def _regions(free: Cells) -> NDArray[np.int32]:
    """Which free cells hang together, over edges: the largest region is 0, and -1 is not free."""
    return components(free, corners=False)[0]


def _connected(filled: Cells, labels: NDArray[np.int32]) -> Cells:
    """The pillars without those in an angled way between the largest regions at either edge, where these are apart.

    The way leads from the near one's furthest cell along the field, and then across it to the far one's nearest cell.
    """
    near, far = (int(labels[:, column][labels[:, column] >= 0].min()) for column in (0, SIDE - 1))
    if near == far:
        return filled
    rows, columns = np.nonzero(labels == near)
    begin = int(rows[columns.argmax()]), int(columns.max())
    rows, columns = np.nonzero(labels == far)
    end = int(rows[columns.argmin()]), int(columns.min())
    along = range(min(begin[1], end[1]), max(begin[1], end[1]) + 1)
    across = range(min(begin[0], end[0]), max(begin[0], end[0]) + 1)
    r, c = np.indices(filled.shape)
    for row, column in [(begin[0], column) for column in along] + [(row, end[1]) for row in across]:
        filled = filled & (np.hypot(r - row, c - column) >= _KEEP)
    filled[[0, -1]] = True
    return filled


def shortest_way(free: Cells, filled: Cells, first: Cell, last: Cell) -> list[Cell]:
    """The cells of the challenge's path: A* over eight neighbours, dearer beside pillars; empty where there is none."""
    rows, columns = np.nonzero(filled)
    cells = np.indices(free.shape)
    gaps = np.hypot(cells[0][..., None] - rows, cells[1][..., None] - columns).min(axis=-1, initial=SIDE)
    cost, parent = {first: 0.0}, {first: first}
    queue = [(0.0, first)]
    closed: set[Cell] = set()
    while queue:
        here = heapq.heappop(queue)[1]
        if here in closed:
            continue
        closed.add(here)
        if here == last:
            break
        for i in range(max(here[0] - 1, 0), min(here[0] + 2, SIDE)):
            for j in range(max(here[1] - 1, 0), min(here[1] + 2, SIDE)):
                there = (i, j)
                through = cost[here] + math.dist(here, there) + _NEAR / max(float(gaps[there]), 1.0)
                if free[there] and there not in closed and through < cost.get(there, math.inf):
                    cost[there], parent[there] = through, here
                    heapq.heappush(queue, (through + math.dist(there, last), there))
    if last not in closed:
        return []
    way = [last]
    while way[-1] != first:
        way.append(parent[way[-1]])
    return way[::-1]


def _centre(cell: Cell) -> tuple[float, float]:
    return (cell[0] + 0.5) * CELL - 0.5 * _WIDTH, (_FIRST + cell[1] + 0.5) * CELL - 0.5 * _LENGTH


def _arena(name: str, filled: Cells) -> Arena:
    """The pillars between walls, which stand where the outer sides of the outermost pillars are."""
    pillars = np.array([(*_centre((row, column)), 0.5 * CELL) for row, column in np.argwhere(filled).tolist()])
    return Arena(name, 0.5 * _WIDTH, 0.5 * _LENGTH, pillars)

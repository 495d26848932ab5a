"""Worlds as the BARN benchmark draws them (Perille, Truong, Xiao and Stone 2020, "Benchmarking Metric Ground Navigation").

A cellular automaton over 30 x 30 cells of 0.15 m, each of which may hold a pillar: filled with one of four chances, smoothed
two, three or four times. Worlds without a way for a robot of five by five cells are thrown away, as its generator does
(dperille/jackal-map-creation: gen_world_ca.py, generator.py). The path that the challenge takes the optimal time from leads
from a random free cell of the field's near edge to one of its far edge, and to start and goal on straight lines: it is not
the shortest one.

The published worlds are drawn with other random numbers and are none of these.
"""

import itertools
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
_REACH = 2  # cells that the robot takes on either side of the one that its middle is in
_NEAR, _DEARER = 2.0, 5.0  # cells from those without room within which a step is put off, and by how much at one cell
_POOL = 0x6261726E  # before the seeds of worlds to train in: no suite has it for its own
_ATTEMPTS = 100_000  # the fullest and least smoothed worlds have a way one time in a thousand


@dataclass(frozen=True, eq=False)
class BarnWorld:
    """A world of the benchmark's kind.

    Attributes:
        arena: the field between its walls, metres.
        filled: (across, along) the cells that hold a pillar.
        free: likewise, where the middle of a robot has room.
        first: the random cell of the near edge at which the challenge's path enters the field.
        last: that of the far edge at which it leaves.
        attempt: which of its random draws this is, from 0.
    """

    arena: Arena
    filled: Cells
    free: Cells
    first: Cell
    last: Cell
    attempt: int

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
        points = np.array([_START, *map(_centre, challenge_path(self.free, self.first, self.last)), _GOAL])
        return float(np.hypot(*np.diff(points, axis=0).T).sum())


def barn_world(number: int, seed: int, attempt: int = 0) -> BarnWorld:
    """World `number` of those of a seed.

    Args:
        number: from 0 on; it decides how full and how smooth the world is, modulo twelve.
        seed: of all that is random.
        attempt: the first draw that is tried; the one that it was found at gives the world at once.

    Raises:
        ArenaError: no world came out; does not happen.
    """
    fill, rounds = FILLS[number % len(FILLS)], ROUNDS[number // len(FILLS) % len(ROUNDS)]
    for draw in range(attempt, _ATTEMPTS):
        random = np.random.default_rng([seed, number, draw])
        filled = _automaton(random, fill, rounds)
        free = _free(filled)
        if not free.any(axis=0).all():  # which is seen sooner than that two regions are two
            continue
        near, far = _largest_at_the_edges(free)
        if (near != far).any():
            continue
        rows = (int(random.choice(np.flatnonzero(near[:, column]))) for column in (0, SIDE - 1))
        first, last = zip(rows, (0, SIDE - 1), strict=True)
        return BarnWorld(_arena(f"barn-{seed}-{number}", filled), filled, free, first, last, draw)
    raise ArenaError(f"no world {number} of seed {seed} came out of {_ATTEMPTS} attempts")


def training_world(difficulty: float, seed: int) -> Arena:
    """A field of the benchmark's kind to train in, which has a way since one is opened where there is none.

    Args:
        difficulty: from 0, where all are of the smallest chance of a pillar, to 1, where all four chances are as likely.
        seed: of all that is random; its worlds are none of those of `barn_world`.
    """
    random = np.random.default_rng([_POOL, seed])
    fill = FILLS[int(difficulty * len(FILLS) * random.random() * (1.0 - 1e-9))]
    filled = _automaton(random, fill, ROUNDS[int(random.integers(len(ROUNDS)))])
    near, far = _largest_at_the_edges(_free(filled))
    if not near.any() or (near != far).any():
        _open_way(filled, near, far)
    return _arena(f"barn-{difficulty:g}-{seed}", filled)


def _automaton(random: np.random.Generator, fill: float, rounds: int) -> Cells:
    """The pillars: the first and last row are the sides, beyond which all counts as filled."""
    filled = random.random((SIDE, SIDE)) < fill
    filled[[0, -1]] = True
    around = np.zeros((SIDE + 2, SIDE + 2), dtype=np.int8)
    around[[0, -1], 1:-1] = 1
    for _ in range(rounds):
        around[1:-1, 1:-1] = filled
        across = around[:-2] + around[1:-1] + around[2:]
        neighbours = across[:, :-2] + across[:, 1:-1] + across[:, 2:] - filled
        filled = (filled | (neighbours > _CROWDED)) & (neighbours >= _LONELY)
    return filled


def _free(filled: Cells) -> Cells:
    """Where the middle of a robot has room: nothing is filled in the square around it."""
    padded = np.pad(filled, _REACH)
    rows = np.logical_or.reduce([padded[i : i + SIDE] for i in range(2 * _REACH + 1)])
    return np.asarray(~np.logical_or.reduce([rows[:, j : j + SIDE] for j in range(2 * _REACH + 1)]))


def _largest_at_the_edges(free: Cells) -> tuple[Cells, Cells]:
    """The largest region, joined over edges, that touches the near edge, and the one that touches the far edge."""
    labels, sizes = components(free, corners=False)
    regions = []
    for column in (0, SIDE - 1):
        touching = labels[:, column][labels[:, column] >= 0]
        largest = touching[np.argmax(sizes[touching])] if len(touching) else -2
        regions.append(labels == largest)
    return regions[0], regions[1]


def _open_way(filled: Cells, near: Cells, far: Cells) -> None:
    """Take away the pillars in an angled way between two regions: along the field, then across it.

    It leads from the near one's furthest cell to the far one's nearest; where there is none, from the middle of its edge.
    """
    middle = np.array([[SIDE // 2, 0]]), np.array([[SIDE // 2, SIDE - 1]])
    ones, others = (np.argwhere(region) if region.any() else edge for region, edge in zip((near, far), middle, strict=True))
    begin, end = ones[ones[:, 1].argmax()], others[others[:, 1].argmin()]
    low, high = sorted((int(begin[1]), int(end[1])))
    way = [(int(begin[0]), column) for column in range(low, high + 1)]
    low, high = sorted((int(begin[0]), int(end[0])))
    way += [(row, int(end[1])) for row in range(low, high + 1)]
    for row, column in way:
        filled[max(row - _REACH, 1) : min(row + _REACH + 1, SIDE - 1), max(column - _REACH, 0) : column + _REACH + 1] = False


def challenge_path(free: Cells, first: Cell, last: Cell) -> list[Cell]:
    """The cells of the challenge's path, found as its authors' program finds it; empty where there is none.

    A search over eight neighbours that turns by 45 degrees at most from one step to the next, and passes no corner between
    two cells without room. Cells come next in the order of the way to them, those near what has no room later: by 5 over
    their distance, in cells, up to two cells. Only where a cell is found again, on a shorter way, does its distance from
    the last one count, too. So the path is not the shortest one. On the 16 published worlds at hand whose files tell all
    cells it is 0.03 m off the published length on average, and 11 times the same.
    """
    distance = _distances(free)
    waiting: dict[Cell, tuple[float, float, Cell | None]] = {first: (0.0, 0.0, None)}
    closed: dict[Cell, Cell | None] = {}
    while waiting:
        here = min(waiting, key=lambda cell: waiting[cell][0])
        _, length, parent = waiting.pop(here)
        closed[here] = parent
        if here == last:
            return _back(closed, last)
        for there in _next_cells(free, here, parent):
            if there in closed:
                continue
            through = length + math.dist(here, there)
            later = _DEARER / distance[there] if distance[there] <= _NEAR else 0.0
            if there not in waiting:
                waiting[there] = (through + later, through, here)
            elif through < waiting[there][1]:
                waiting[there] = (through + math.dist(there, last) + later, through, here)
    return []


def _distances(free: Cells) -> NDArray[np.float64]:
    """Cells from each to the nearest without room, from middle to middle; infinite beyond `_NEAR`."""
    reach = int(_NEAR)
    padded = np.pad(~free, reach)
    distances = np.full(free.shape, np.inf)
    for i, j in itertools.product(range(-reach, reach + 1), repeat=2):
        if math.hypot(i, j) <= _NEAR:
            taken = padded[reach + i : reach + i + SIDE, reach + j : reach + j + SIDE]
            distances[taken] = np.minimum(distances[taken], math.hypot(i, j))
    return distances


def _next_cells(free: Cells, here: Cell, parent: Cell | None) -> list[Cell]:
    """The free neighbours of a cell that lie ahead of one who comes from `parent`, or half aside."""
    found = []
    for step in itertools.product((-1, 0, 1), repeat=2):
        there = (here[0] + step[0], here[1] + step[1])
        if step == (0, 0) or not (0 <= there[0] < SIDE and 0 <= there[1] < SIDE) or not free[there]:
            continue
        if not free[there[0], here[1]] and not free[here[0], there[1]]:
            continue
        came = (here[0] - parent[0], here[1] - parent[1]) if parent is not None else step
        # Among steps to neighbours those within 45 degrees of one another differ by one at most, and never stand square.
        ahead = max(abs(step[0] - came[0]), abs(step[1] - came[1])) <= 1 and step[0] * came[0] + step[1] * came[1] > 0
        if ahead:
            found.append(there)
    return found


def _back(closed: dict[Cell, Cell | None], last: Cell) -> list[Cell]:
    way = [last]
    while (before := closed[way[-1]]) is not None:
        way.append(before)
    return way[::-1]


def _centre(cell: Cell) -> tuple[float, float]:
    return (cell[0] + 0.5) * CELL - 0.5 * _WIDTH, (_FIRST + cell[1] + 0.5) * CELL - 0.5 * _LENGTH


def _arena(name: str, filled: Cells) -> Arena:
    """The pillars between walls, which stand where the outer sides of the outermost pillars are."""
    pillars = np.array([(*_centre((row, column)), 0.5 * CELL) for row, column in np.argwhere(filled).tolist()])
    return Arena(name, 0.5 * _WIDTH, 0.5 * _LENGTH, pillars)

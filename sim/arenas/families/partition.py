"""Floors cut in two again and again: corridors between solid blocks, and rooms whose walls have doors."""

from collections.abc import Sequence
from dataclasses import dataclass

from sim.arenas.families.layout import WALL, Plan

# Shortest side of a block between corridors and of a room, metres, from easy to hard.
_BLOCKS = (1.7, 0.9)
_ROOMS = (3.6, 1.9)
# Blocks are at most this share of what a street leaves of the floor.
_SMALL_FLOOR = 0.4
# A wall longer than this gets a second door in easy plans, metres.
_LONG_WALL = 5.0
# Where a cut may lie, as shares of what is possible: never the same grid, never slivers.
_CUT_LOW, _CUT_HIGH = 0.25, 0.75


@dataclass(frozen=True)
class _Area:
    low_x: float
    low_y: float
    high_x: float
    high_y: float

    @property
    def width(self) -> float:
        return self.high_x - self.low_x

    @property
    def height(self) -> float:
        return self.high_y - self.low_y

    def cut(self, across: bool, at: float, gap: float) -> "tuple[_Area, _Area]":
        """The two parts beside a strip of width `gap` around `at`; `across` is along x."""
        low, high = at - 0.5 * gap, at + 0.5 * gap
        if across:
            return _Area(self.low_x, self.low_y, self.high_x, low), _Area(self.low_x, high, self.high_x, self.high_y)
        return _Area(self.low_x, self.low_y, low, self.high_y), _Area(high, self.low_y, self.high_x, self.high_y)


def corridors(plan: Plan) -> None:
    """Streets between solid blocks. Every street runs from one older street (or wall) to another, so all hang together."""
    # However small the floor, there is a street across it.
    smallest = min(plan.between(*_BLOCKS), _SMALL_FLOOR * (plan.size - plan.passage))
    waiting = [_Area(-plan.half, -plan.half, plan.half, plan.half)]
    while waiting:
        area = waiting.pop()
        across = area.height > area.width
        side = max(area.width, area.height)
        room = side - plan.passage - 2.0 * smallest
        if room < 0.0:
            plan.rectangle(area.low_x, area.low_y, area.high_x, area.high_y)
            continue
        low = (area.low_y if across else area.low_x) + smallest + 0.5 * plan.passage
        waiting += area.cut(across, low + room * plan.random.uniform(_CUT_LOW, _CUT_HIGH), plan.passage)


def rooms(plan: Plan) -> None:
    """Rooms with doors. A wall never ends at an older wall's door, so every door stays open."""
    smallest = plan.between(*_ROOMS)
    doors: list[tuple[float, float]] = []
    waiting = [_Area(-plan.half, -plan.half, plan.half, plan.half)]
    while waiting:
        area = waiting.pop()
        across = area.height > area.width
        at = _wall_position(plan, area, across, smallest, doors)
        if at is None:
            continue
        low, high = (area.low_x, area.high_x) if across else (area.low_y, area.high_y)
        middles = _doors(plan, low, high)
        ends = [
            low,
            *(end for middle in middles for end in (middle - 0.5 * plan.passage, middle + 0.5 * plan.passage)),
            high,
        ]
        for begin, end in zip(ends[::2], ends[1::2], strict=True):
            plan.strip(across, at, WALL, begin, end)
        doors += [(middle, at) if across else (at, middle) for middle in middles]
        waiting += area.cut(across, at, WALL)


def _wall_position(
    plan: Plan, area: _Area, across: bool, smallest: float, doors: Sequence[tuple[float, float]]
) -> float | None:
    """Where a wall may cut the area in two rooms without standing in a door; None where the area stays one room."""
    low, high = (area.low_y, area.high_y) if across else (area.low_x, area.high_x)
    room = high - low - WALL - 2.0 * smallest
    if room < 0.0:
        return None
    # A robot that comes through a door turns in front of it: half a door and its own space stay open to both sides.
    keep = 0.5 * plan.passage + 0.5 * WALL + plan.clearance
    near = [y if across else x for x, y in doors if _on_edge(area, x, y)]
    for share in plan.random.uniform(0.0, 1.0, 12):
        at = low + smallest + 0.5 * WALL + room * share
        if all(abs(at - door) >= keep for door in near):
            return float(at)
    return None


def _on_edge(area: _Area, x: float, y: float) -> bool:
    slack = WALL
    return area.low_x - slack <= x <= area.high_x + slack and area.low_y - slack <= y <= area.high_y + slack


def _doors(plan: Plan, low: float, high: float) -> list[float]:
    """Middles of the doors in a wall from `low` to `high`, in order."""
    margin = 0.5 * plan.passage + WALL
    two = high - low > _LONG_WALL and plan.random.random() > plan.difficulty
    parts = [(low, 0.5 * (low + high)), (0.5 * (low + high), high)] if two else [(low, high)]
    return [float(plan.random.uniform(begin + margin, end - margin)) for begin, end in parts]

"""What is wrong with an arena, or of no use in it, before anybody trains there: said in words, with the place."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations, islice

import numpy as np
from numpy.typing import NDArray

from sim.arenas.cells import CELL, Grid, components, free_mask, obstacle_distance
from sim.arenas.document import IMPORT_CLEARANCE, MAX_CELLS, MIN_FREE_AREA, blocked_patrols, free_area, to_arena
from sim.arenas.freespace import SPAWN_MARGIN
from sim.arenas.geometry import Arena, box_distance, free_distance
from sim.config import ArenaFile, Pedestrian, Timed

MAX_REMARKS = 20
"""Remarks of one review: more than anybody mends at a time."""

# Square metres of a closed-off part that are worth a word, and how many of these parts are told of.
_WORTHWHILE = 0.25
_PARTS = 5
# Metres of rounding that are no overlap.
_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Remark:
    """One thing to mend.

    Attributes:
        refused: whether the arena can't be kept as it is.
        text: a sentence for people; things are counted from 1, as pages do.
        x, y: where, metres.
    """

    refused: bool
    text: str
    x: float
    y: float


@dataclass(frozen=True)
class Review:
    """What was found.

    Attributes:
        free_area: square metres in one piece for the robot's centre.
        remarks: what is refused first; at most `MAX_REMARKS`.
    """

    free_area: float
    remarks: tuple[Remark, ...]


def review(document: ArenaFile, clearance: float = IMPORT_CLEARANCE) -> Review:
    """Look an arena over for a robot that needs `clearance` metres around its centre."""
    arena = to_arena(document)
    cell = _cell(arena)
    labels, sizes = components(free_mask(arena, clearance, cell))
    areas = np.asarray(sizes * cell * cell, dtype=np.float64)
    grid = Grid.over(arena, cell)
    found = [
        *_floor(arena, grid, labels, areas, clearance),
        *_scenario(document, arena, grid, labels, clearance),
        *_moving(document, arena),
        *_useless(arena),
    ]
    found.sort(key=lambda remark: not remark.refused)
    return Review(float(areas[0]) if len(areas) else 0.0, tuple(found[:MAX_REMARKS]))


def why_no_scenario(document: ArenaFile, clearance: float = IMPORT_CLEARANCE) -> str | None:
    """What keeps an arena from being a scenario for a robot that needs `clearance` metres around it; None if nothing."""
    if document.start is None or document.target is None:
        return f"The arena {document.name!r} comes without a start and a target of its own: place both."
    arena = to_arena(document)
    cell = _cell(arena)
    labels, _ = components(free_mask(arena, clearance, cell))
    found = _scenario(document, arena, Grid.over(arena, cell), labels, clearance)
    return next((remark.text for remark in found), None)


def _cell(arena: Arena) -> float:
    return max(CELL, 2.0 * max(arena.half_width, arena.half_height) / MAX_CELLS)


def _floor(
    arena: Arena, grid: Grid, labels: NDArray[np.int32], areas: NDArray[np.float64], clearance: float
) -> Iterator[Remark]:
    largest = float(areas[0]) if len(areas) else 0.0
    if largest < MIN_FREE_AREA:
        yield Remark(
            free_area(arena) < MIN_FREE_AREA,
            f"A robot that keeps {clearance:g} m from everything has {largest:.1f} m² in one piece and needs "
            f"{MIN_FREE_AREA:g}: make room for it.",
            0.0,
            0.0,
        )
        return
    room = clearance + SPAWN_MARGIN
    x, y = grid.xs()[None, :], grid.ys()[:, None]
    wall = np.minimum(arena.half_width - np.abs(x), arena.half_height - np.abs(y))
    if not ((labels == 0) & (np.minimum(wall, obstacle_distance(arena, grid, room)) >= room)).any():
        yield Remark(
            False,
            f"Robots start {room:g} m from everything, and nowhere is so much room: none can be trained here.",
            0.0,
            0.0,
        )
    for part, area in enumerate(areas[1 : 1 + _PARTS].tolist(), start=1):
        if area >= _WORTHWHILE:
            rows, columns = np.nonzero(labels == part)
            middle = len(rows) // 2
            yield Remark(
                False,
                f"{area:.1f} m² are closed off: a robot that keeps {clearance:g} m from everything neither starts there nor "
                "gets there.",
                float(grid.xs()[columns[middle]]),
                float(grid.ys()[rows[middle]]),
            )


def _scenario(
    document: ArenaFile, arena: Arena, grid: Grid, labels: NDArray[np.int32], clearance: float
) -> Iterator[Remark]:
    places = {"start": document.start, "target": document.target}
    standing = {name: place for name, place in places.items() if place is not None}
    if len(standing) == 1:
        ((name, place),) = standing.items()
        other = "target" if name == "start" else "start"
        yield Remark(False, f"The {name} is not used without a {other}: place both, or neither.", place.x, place.y)
        return
    parts = []
    for name, place in standing.items():
        room = float(free_distance(arena, (place.x, place.y)))
        if room < clearance:
            where = f"{room:.2f} m from an obstacle or a wall" if room > 0.0 else "in an obstacle or a wall"
            yield Remark(
                False,
                f"The {name} is {where}, and a robot needs {clearance:g} m: this scenario is left out.",
                place.x,
                place.y,
            )
            return
        parts.append(_part_near(grid, labels, place.x, place.y))
    if len(parts) == 2 and not (parts[0] & parts[1]) and document.target is not None:
        yield Remark(
            False,
            f"There is no way from the start to the target that keeps {clearance:g} m clear: this scenario is left out.",
            document.target.x,
            document.target.y,
        )


def _part_near(grid: Grid, labels: NDArray[np.int32], x: float, y: float) -> set[int]:
    """The parts of the floor that a point with room enough stands in: cells are free where all of them is."""
    rows, columns = grid.window(x, y, 2.0 * grid.cell, 2.0 * grid.cell)
    return set(labels[rows, columns].ravel().tolist()) - {-1}


def _moving(document: ArenaFile, arena: Arena) -> Iterator[Remark]:
    begins: list[tuple[str, float, float, float]] = []
    timed: set[str] = set()
    for number, mover in enumerate(document.movers, start=1):
        name = f"Mover {number}"
        if isinstance(mover, Timed):
            begins.append((name, mover.keyframes[0].x, mover.keyframes[0].y, mover.radius))
            timed.add(name)
        elif isinstance(mover, Pedestrian) and mover.waypoints:
            places = [(place.x, place.y) for place in mover.waypoints]
            blocked = np.flatnonzero(free_distance(arena, places) < mover.radius).tolist()
            if 0 in blocked:
                yield Remark(False, f"{name} has no room where it begins: it is left out.", *places[0])
            else:
                begins.append((name, *places[0], mover.radius))
            for index in (index for index in blocked if index):
                yield Remark(False, f"{name} never reaches corner {index + 1} of its way: no room.", *places[index])
    for index, x, y in blocked_patrols(document):
        yield Remark(True, f"Mover {index + 1} does not get past ({x:.2f}, {y:.2f}) on its round: move its corners.", x, y)
    for (one, x, y, radius), (other, other_x, other_y, other_radius) in combinations(begins, 2):
        # Timed ones are where they are said to be, whatever is there.
        if not {one, other} <= timed and math.hypot(other_x - x, other_y - y) < radius + other_radius:
            text = f"{one} and {other} begin in the same place: one of them may be left out."
            yield Remark(False, text, other_x, other_y)


def _useless(arena: Arena) -> Iterator[Remark]:
    """Obstacles beyond the walls, and those that stand within another one."""
    rows = [("Disc", index, row) for index, row in enumerate(arena.circles.tolist(), start=1)]
    rows += [("Box", index, row) for index, row in enumerate(arena.boxes.tolist(), start=1)]
    if not rows:
        return
    centres = np.array([row[:2] for _, _, row in rows])
    outer = np.array([row[2] if kind == "Disc" else math.hypot(*row[2:4]) for kind, _, row in rows])
    inner = np.array([row[2] if kind == "Disc" else min(row[2:4]) for kind, _, row in rows])
    beyond = np.any(np.abs(centres) - outer[:, None] >= [arena.half_width, arena.half_height], axis=1)
    for index in islice(np.flatnonzero(beyond).tolist(), MAX_REMARKS):
        kind, number, row = rows[index]
        yield Remark(False, f"{kind} {number} stands outside the walls: it does nothing.", row[0], row[1])
    apart = np.hypot(*(centres[:, None, :] - centres[None, :, :]).transpose(2, 0, 1))
    near = apart + inner[:, None] <= outer[None, :] + _TOLERANCE
    np.fill_diagonal(near, val=False)
    told: set[int] = set()
    for inside, around in zip(*(found.tolist() for found in np.nonzero(near)), strict=True):
        if inside in told or around in told or len(told) >= MAX_REMARKS or not _within(rows[inside], rows[around]):
            continue
        told.add(inside)
        kind, number, row = rows[inside]
        other, of, _ = rows[around]
        yield Remark(False, f"{kind} {number} stands within {other.lower()} {of}: it does nothing.", row[0], row[1])


def _within(inside: tuple[str, int, list[float]], around: tuple[str, int, list[float]]) -> bool:
    """Whether all of one obstacle lies in another; both are convex."""
    kind, _, row = inside
    other, _, of = around
    if kind == "Disc":
        points, reach = np.array([row[:2]]), row[2]
    else:
        x, y, half_length, half_width, angle = row
        signs = np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)]) * (half_length, half_width)
        cos, sin = math.cos(angle), math.sin(angle)
        points, reach = signs @ np.array([[cos, sin], [-sin, cos]]) + (x, y), 0.0
    if other == "Disc":
        deepest = np.hypot(*(points - of[:2]).T) - of[2]
    else:
        deepest = box_distance(np.array(of), points[:, 0], points[:, 1])
    return bool((deepest <= _TOLERANCE - reach).all())

"""Between our own format and the geometry that the simulator drives in; and whether a robot can drive there at all."""

import math
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from sim.arenas.cells import CELL, components, free_mask
from sim.arenas.geometry import Arena, free_distance
from sim.arenas.mover import Mover
from sim.config import AnyMover, ArenaFile, Box, Circle, Keyframe, Patrol, Pedestrian, Timed, Walker, Waypoint
from sim.errors import ArenaFormatError, NoFreeSpaceError

MIN_FREE_AREA = 1.0
"""Square metres that must hang together for a robot to drive in."""

IMPORT_CLEARANCE = 0.2
"""What a robot needs around its centre for that, metres: the Burger's collision distance."""

# Metres between the points of a patrol's way that are looked at.
_PATROL_STEP = 0.02

MAX_CELLS = 1000
"""Cells along the longer side of a large hall: through larger ones the check stays well below a second."""


def to_arena(document: ArenaFile) -> Arena:
    """The geometry of an arena file."""
    return Arena(
        document.name,
        half_width=0.5 * document.width,
        half_height=0.5 * document.height,
        circles=np.array([(c.x, c.y, c.radius) for c in document.circles], dtype=np.float64).reshape(-1, 3),
        boxes=np.array(
            [(b.x, b.y, 0.5 * b.length, 0.5 * b.width, math.radians(b.angle)) for b in document.boxes], dtype=np.float64
        ).reshape(-1, 5),
        movers=tuple(_to_mover(entry) for entry in document.movers),
    )


def to_document(arena: Arena) -> ArenaFile:
    """An arena as a file, for any arena that is small enough for one; lengths to a tenth of a millimetre."""
    return ArenaFile(
        name=arena.name,
        width=round(2.0 * arena.half_width, 4),
        height=round(2.0 * arena.half_height, 4),
        circles=tuple(
            Circle(x=round(x, 4), y=round(y, 4), radius=round(radius, 4)) for x, y, radius in arena.circles.tolist()
        ),
        boxes=tuple(
            Box(
                x=round(x, 4),
                y=round(y, 4),
                length=round(2.0 * half_length, 4),
                width=round(2.0 * half_width, 4),
                angle=round(math.degrees(angle) % 360.0, 4),
            )
            for x, y, half_length, half_width, angle in arena.boxes.tolist()
        ),
        movers=tuple(_to_entry(mover) for mover in arena.movers),
    )


def _to_mover(entry: AnyMover) -> Mover:
    if isinstance(entry, Timed):
        places = tuple((frame.x, frame.y) for frame in entry.keyframes)
        times = tuple(frame.t for frame in entry.keyframes)
        mover = Mover("timed", entry.radius, 0.0, places, times, entry.loops)
        return replace(mover, speed=mover.fastest)
    ways = () if isinstance(entry, Walker) else tuple((corner.x, corner.y) for corner in entry.waypoints)
    loops = not (isinstance(entry, Pedestrian) and entry.stays)
    return Mover(entry.kind, entry.radius, entry.speed, ways, loops=loops, sees_robots=entry.sees_robots)


def _to_entry(mover: Mover) -> AnyMover:
    if mover.kind == "timed":
        frames = zip(mover.times, mover.waypoints, strict=True)
        keyframes = tuple(Keyframe(t=round(t, 4), x=round(x, 4), y=round(y, 4)) for t, (x, y) in frames)
        return Timed(kind="timed", radius=mover.radius, keyframes=keyframes, loops=mover.loops)
    waypoints = tuple(Waypoint(x=round(x, 4), y=round(y, 4)) for x, y in mover.waypoints)
    radius, speed, sees = mover.radius, mover.speed, mover.sees_robots
    if mover.kind == "patrol":
        return Patrol(kind="patrol", radius=radius, speed=speed, sees_robots=sees, waypoints=waypoints)
    if mover.kind == "walker":
        return Walker(kind="walker", radius=radius, speed=speed, sees_robots=sees)
    stays = not mover.loops
    return Pedestrian(
        kind="pedestrian", radius=radius, speed=speed, sees_robots=sees, waypoints=waypoints, stays=stays
    )  # fmt: skip


def free_area(arena: Arena, clearance: float = IMPORT_CLEARANCE) -> float:
    """Square metres in which the robot's centre can move without leaving the largest part of the free space."""
    cell = max(CELL, 2.0 * max(arena.half_width, arena.half_height) / MAX_CELLS)
    _, sizes = components(free_mask(arena, clearance, cell))
    return float(sizes[0]) * cell * cell if len(sizes) else 0.0


def check_free_space(document: ArenaFile) -> float:
    """The free area of an imported arena, square metres.

    Raises:
        NoFreeSpaceError: there is less than `MIN_FREE_AREA` in one piece.
    """
    area = free_area(to_arena(document))
    if area < MIN_FREE_AREA:
        raise NoFreeSpaceError(
            f"{document.name}: a robot that keeps {IMPORT_CLEARANCE} m from everything has {area:.1f} square metres in one "
            f"piece, and needs {MIN_FREE_AREA:g}. Check the scale and, of a map, its thresholds and `negate`."
        )
    return area


def check_patrols(document: ArenaFile) -> None:
    """Whether every patrol of an imported arena gets round.

    Raises:
        ArenaFormatError: a patrol's way runs through an obstacle or a wall.
    """
    for number, x, y in blocked_patrols(document):
        raise ArenaFormatError(
            f"{document.name}: movers.{number} does not get past ({x:.2f}, {y:.2f}) with its radius of "
            f"{document.movers[number].radius:g} m: move its waypoints"
        )


def blocked_patrols(document: ArenaFile) -> Iterator[tuple[int, float, float]]:
    """The patrols that do not get round, by number from 0, and the first place, metres, that each does not get past."""
    arena = to_arena(document)
    for number, mover in enumerate(arena.movers):
        if mover.kind != "patrol":
            continue  # a timed one goes as it is said to, and others find their own way
        corners = np.array([*mover.waypoints, *mover.waypoints[:1]]).reshape(-1, 2)
        ways = [
            np.linspace(start, end, 2 + int(np.hypot(*(end - start)) / _PATROL_STEP)) for start, end in pairwise(corners)
        ]
        points = np.concatenate(ways) if ways else np.empty((0, 2))
        blocked = points[free_distance(arena, points) < mover.radius]
        if len(blocked):
            x, y = blocked[0].tolist()
            yield number, x, y

"""From (family, difficulty, seed) to an arena; the same three give the same arena.

In those of `FAMILIES` a robot gets everywhere; those of `BENCHMARKS` have the shape of a benchmark's worlds.
"""

import hashlib
from collections.abc import Callable
from functools import partial
from typing import Final, get_args

import numpy as np

from sim.arenas.barn import training_world
from sim.arenas.cells import CELL, components, free_mask
from sim.arenas.families.clutter import clutter
from sim.arenas.families.layout import Plan
from sim.arenas.families.maze import maze
from sim.arenas.families.mixed import mixed
from sim.arenas.families.partition import corridors, rooms
from sim.arenas.families.passages import passages
from sim.arenas.families.thicket import thicket
from sim.arenas.families.varied import intricate, varied
from sim.arenas.families.warehouse import warehouse
from sim.arenas.geometry import Arena
from sim.arenas.scenes import training_scene
from sim.config import MAX_MAPS, FamilyName
from sim.errors import ArenaError
from sim.extending.discovery import implementation
from sim.extending.parts import ArenaFamily

FAMILIES: Final[dict[FamilyName, Callable[[Plan], None]]] = {
    "clutter": clutter,
    "corridors": corridors,
    "rooms": rooms,
    "warehouse": warehouse,
    "maze": maze,
    "passages": passages,
    "thicket": thicket,
    "mixed": mixed,
    "varied": varied,
    "intricate": intricate,
}

BENCHMARKS: Final[dict[FamilyName, Callable[[float, int], Arena]]] = {"barn": training_world, "people": training_scene}
"""Arenas of the kind and the size that a benchmark has, whatever the robot: by difficulty and seed."""

SIZE = 10.0
"""Edge of a generated arena, metres."""

CLEARANCE = 0.25
"""What a robot needs around its centre if nothing else is said, metres: the Burger's collision distance and a little."""

# What one may ask for, metres: below, some families have no room for a single passage.
_SIZES = (5.0, 40.0)
_CLEARANCES = (0.05, 0.6)
# Attempts at a plan; every family is open by construction, so the first one passes.
_ATTEMPTS = 8
# An arena in two parts is drawn again unless the smaller ones are crumbs: this share of the free cells.
_CRUMBS = 0.02

SUITE_SEEDS = range(2**48, 2**49)
"""Seeds kept for suites: `pool_seeds`, from which trainings draw, ends far below."""


def pool_seeds(seed: int, maps: int) -> range:
    """The seeds of a training's maps: disjoint for different `seed`, and never among `SUITE_SEEDS`."""
    return range(seed * MAX_MAPS, seed * MAX_MAPS + maps)


def generate_arena(
    family: FamilyName | ArenaFamily, difficulty: float, seed: int, *, size: float = SIZE, clearance: float = CLEARANCE
) -> Arena:
    """A square arena of a family, or one of a benchmark's kind.

    Args:
        family: one of `FAMILIES` or `BENCHMARKS`, or the configuration of one that an extension has added.
        difficulty: 0 (few obstacles, wide passages) to 1 (many, and passages 0.4 m wider than the robot's own space).
        seed: 0 to 2^63 - 1; the difficulty does not change the random numbers, so one seed is one layout, easy or hard.
        size: edge, 5 to 40 m; one of a benchmark's kind has its own.
        clearance: what the robot needs around its centre, 0.05 to 0.6 m. The free space at this clearance hangs
            together but for crumbs of 2 %: there is a path between any two points of its largest part. One of a
            benchmark's kind takes no notice of it.

    Raises:
        ArenaError: an argument is out of its range, or what an extension draws is in two parts time and again.
    """
    if not isinstance(family, ArenaFamily) and family not in FAMILIES and family not in BENCHMARKS:
        raise ArenaError(f"there is no family of arenas {family!r}: choose one of {', '.join(get_args(FamilyName))}")
    if not 0.0 <= difficulty <= 1.0:
        raise ArenaError(f"a difficulty lies between 0 and 1, and {difficulty} does not")
    if not _SIZES[0] <= size <= _SIZES[1]:
        raise ArenaError(f"a generated arena is {_SIZES[0]:g} to {_SIZES[1]:g} m wide, not {size} m")
    if not _CLEARANCES[0] <= clearance <= _CLEARANCES[1]:
        raise ArenaError(f"arenas are generated for clearances of {_CLEARANCES[0]} to {_CLEARANCES[1]} m, not {clearance} m")
    if not 0 <= seed < 2**63:
        raise ArenaError(f"a seed lies between 0 and 2^63 - 1, and {seed} does not")
    if not isinstance(family, ArenaFamily) and family in BENCHMARKS:
        return BENCHMARKS[family](difficulty, seed)
    label, number, fill = _family(family)
    name = f"{label}-{difficulty:g}-{seed}"
    for attempt in range(_ATTEMPTS):
        entropy = np.random.SeedSequence([number, attempt, seed])
        plan = Plan(size, difficulty, clearance, np.random.Generator(np.random.PCG64(entropy)))
        fill(plan)
        circles, boxes = plan.turned()
        arena = Arena(name, plan.half, plan.half, circles, boxes)
        _, sizes = components(free_mask(arena, clearance, CELL))
        if len(sizes) and sizes[0] >= (1.0 - _CRUMBS) * sizes.sum():
            return arena
    raise ArenaError(f"no open arena came out of {name} at a clearance of {clearance} m: choose a larger size")


def _family(family: FamilyName | ArenaFamily) -> tuple[str, int, Callable[[Plan], object]]:
    """A family's name, the number that tells its random numbers from those of others, and what fills a plan."""
    if isinstance(family, ArenaFamily):
        number = int.from_bytes(hashlib.sha256(family.name.encode()).digest()[:8])
        return family.name, number, partial(_filled, implementation(family), family)
    return family, list(FAMILIES).index(family), FAMILIES[family]


def _filled(fill: Callable[[Plan, ArenaFamily], object], family: ArenaFamily, plan: Plan) -> None:
    fill(plan, family)

"""The places of a suite: how its file names them, their geometry, and the hash over what a policy meets there."""

import hashlib
import json
from collections.abc import Iterable

import numpy as np
from pydantic import Field, TypeAdapter

from sim.arenas import Arena, build_arenas
from sim.arenas.build import with_movers
from sim.arenas.document import to_arena
from sim.arenas.families import CLEARANCE, SUITE_SEEDS, generate_arena
from sim.arenas.mover import Mover
from sim.config import ArenaConfig, ArenaFile, FamilyName, Frozen, MoversConfig

_DECIMALS = 6  # of the geometry that is hashed: micrometres, coarser than any rounding of a platform


class GeneratedPlace(Frozen):
    """One generated arena of a suite; its seed is one of `SUITE_SEEDS`, and so of no training."""

    family: FamilyName
    difficulty: float
    seed: int
    movers: MoversConfig = Field(default_factory=MoversConfig)


Place = ArenaConfig | GeneratedPlace | ArenaFile
PLACES: TypeAdapter[tuple[Place, ...]] = TypeAdapter(tuple[Place, ...])


def suite_places(
    family: FamilyName, difficulty: float, maps: int, movers: MoversConfig | None = None, *, first: int = 0
) -> tuple[GeneratedPlace, ...]:
    """The maps of a family at a difficulty on which suites are driven; from `first` on, to have others than they have."""
    movers = movers or MoversConfig()
    seeds = SUITE_SEEDS[first : first + maps]
    return tuple(GeneratedPlace(family=family, difficulty=difficulty, seed=seed, movers=movers) for seed in seeds)


def build_places(places: Iterable[Place], *, clearance: float = CLEARANCE) -> tuple[Arena, ...]:
    """The arenas of a suite; `clearance` is what the robot needs around its centre in generated ones, metres."""
    arenas: list[Arena] = []
    for place in places:
        if isinstance(place, GeneratedPlace):
            arena = generate_arena(place.family, place.difficulty, place.seed, clearance=clearance)
            arenas.append(with_movers(arena, place.movers))
        elif isinstance(place, ArenaFile):
            arenas.append(to_arena(place))
        else:
            arenas += build_arenas(place)
    return tuple(arenas)


def _content(mover: Mover) -> list[object]:
    """What is hashed of a mover; of those that keep no times as before any did."""
    timed: list[object] = [mover.times, mover.loops] if mover.times else []
    return [mover.kind, mover.radius, mover.speed, mover.waypoints, *timed]


def content_hash(arenas: tuple[Arena, ...], scenarios: list[list[float]]) -> str:
    """SHA-256 of what a policy meets."""
    geometry = [
        [
            [round(arena.half_width, _DECIMALS), round(arena.half_height, _DECIMALS)],
            np.round(arena.circles, _DECIMALS).tolist(),
            np.round(arena.boxes, _DECIMALS).tolist(),
            # Arenas in which nothing moves keep the hash that they had before anything could.
            *([_content(mover) for mover in arena.movers]),
        ]
        for arena in arenas
    ]
    return hashlib.sha256(json.dumps([geometry, scenarios]).encode()).hexdigest()

"""The places of a suite: how its file names them, their geometry, and the hash over what a policy meets there."""

import hashlib
import json
from collections.abc import Iterable

import numpy as np
from pydantic import Field, TypeAdapter

from sim.arenas import Arena, build_arenas
from sim.arenas.barn import BarnWorld, barn_world
from sim.arenas.build import with_movers
from sim.arenas.document import to_arena
from sim.arenas.families import CLEARANCE, SUITE_SEEDS, generate_arena
from sim.arenas.mover import Mover
from sim.arenas.scenes import Scene, SceneName, generate_scene
from sim.config import ArenaConfig, ArenaFile, FamilyName, Frozen, MoversConfig
from sim.suite_rules import SuiteRules

_DECIMALS = 6  # of the geometry that is hashed: micrometres, coarser than any rounding of a platform


class GeneratedPlace(Frozen):
    """One generated arena of a suite; its seed is one of `SUITE_SEEDS`, and so of no training."""

    family: FamilyName
    difficulty: float
    seed: int
    movers: MoversConfig = Field(default_factory=MoversConfig)


class ScenePlace(Frozen):
    """One scene among people."""

    scene: SceneName
    seed: int
    sees: bool

    def build(self) -> Scene:
        """The arena with its people, and the robot's start and target."""
        return generate_scene(self.scene, self.seed, sees=self.sees)


class BarnPlace(Frozen):
    """One world of the BARN benchmark's kind, and the random draw that it was found at."""

    world: int
    barn_seed: int
    attempt: int

    def build(self) -> BarnWorld:
        """The world with its start and goal."""
        return barn_world(self.world, self.barn_seed, self.attempt)


Place = ArenaConfig | GeneratedPlace | ScenePlace | BarnPlace | ArenaFile
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
        elif isinstance(place, ScenePlace | BarnPlace):
            arenas.append(place.build().arena)
        elif isinstance(place, ArenaFile):
            arenas.append(to_arena(place))
        else:
            arenas += build_arenas(place)
    return tuple(arenas)


def _content(mover: Mover) -> list[object]:
    """What is hashed of a mover; of those that keep no times as before any did."""
    timed: list[object] = [mover.times, mover.loops] if mover.times else []
    route: list[object] = [mover.loops] if mover.kind == "pedestrian" and mover.waypoints else []
    sees: list[object] = ["sees robots"] if mover.sees_robots else []
    return [mover.kind, mover.radius, mover.speed, mover.waypoints, *timed, *route, *sees]


def content_hash(arenas: tuple[Arena, ...], scenarios: list[list[float]], rules: SuiteRules | None = None) -> str:
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
    # Suites that ask for nothing keep the hash that they had before any did.
    asked = [rules.content()] if rules and rules.content() else []
    content = [geometry, scenarios, *asked]
    return hashlib.sha256(json.dumps(content).encode()).hexdigest()

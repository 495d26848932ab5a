"""Frozen scenarios on which policies are compared, and driving all of them side by side.

A suite's file in `sim/suite_data` holds where every scenario starts, its target and the length of the shortest path;
`sim.suite_builder` is the procedure that made it. The hash covers scenarios and the geometry of their arenas: a suite that
differs in anything is another suite, and a file that does not match its hash is refused.
"""

import hashlib
import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray
from pydantic import TypeAdapter

from sim.arenas import Arena, build_arenas
from sim.arenas.families import SUITE_SEEDS, generate_arena
from sim.config import AnyArenaConfig, ArenaConfig, FamilyName, Frozen, GeneratedArenaConfig, TaskConfig
from sim.errors import SuiteError
from sim.scenarios import draw_scenarios
from sim.world import World

Floats = NDArray[np.float32]
PolicyFunction = Callable[[Floats], Floats]
"""Observations (n, numbers) to actions (n, 2)."""

# Maps and scenarios of a suite that is drawn for a task.
_DRAWN_MAPS = 20
_DRAWN_SCENARIOS = 200
# Characters of an imported arena's name in the name of its suite.
_NAME = 40

_DECIMALS = 6  # of the geometry that is hashed: micrometres, coarser than any rounding of a platform


@dataclass(frozen=True, eq=False)
class Suite:
    """A frozen list of S scenarios.

    Attributes:
        name: such as `complex-200`.
        hash: SHA-256 of the scenarios and the arenas' geometry.
        arenas: the places.
        arena_indices: (S,) the arena of each scenario.
        starts: (S, 3) x, y, heading.
        targets: (S, 2).
        shortest_paths: (S,) metres, for the default robot's body around the obstacles.
    """

    name: str
    hash: str
    arenas: tuple[Arena, ...]
    arena_indices: NDArray[np.int32]
    starts: NDArray[np.float64]
    targets: NDArray[np.float64]
    shortest_paths: NDArray[np.float64]

    def __len__(self) -> int:
        return len(self.starts)


@dataclass(frozen=True, eq=False)
class EpisodeTable:
    """What a policy did in each of S scenarios, in the suite's order.

    Attributes:
        outcomes: (S,) 1 arrival, 2 collision, 3 time-out.
        steps: (S,) control steps driven.
        rewards: (S,) summed.
        path_lengths: (S,) metres driven.
        shortest_paths: (S,) metres, the suite's.
        min_clearances: (S,) smallest distance of the body from anything else, metres.
    """

    outcomes: NDArray[np.uint8]
    steps: NDArray[np.int32]
    rewards: NDArray[np.float64]
    path_lengths: NDArray[np.float64]
    shortest_paths: NDArray[np.float64]
    min_clearances: Floats


@dataclass(frozen=True, eq=False)
class Situation:
    """The robots that are still under way, for controllers that know more than an observation says.

    Attributes:
        observations: (n, numbers).
        ranges: (n, rays) metres.
        poses: (n, 3) x, y, heading.
        targets: (n, 2).
    """

    observations: Floats
    ranges: Floats
    poses: Floats
    targets: Floats


class GeneratedPlace(Frozen):
    """One generated arena of a suite; its seed is one of `SUITE_SEEDS`, and so of no training."""

    family: FamilyName
    difficulty: float
    seed: int


Place = ArenaConfig | GeneratedPlace
_PLACES: TypeAdapter[tuple[Place, ...]] = TypeAdapter(tuple[Place, ...])


def suite_places(family: FamilyName, difficulty: float, maps: int) -> tuple[GeneratedPlace, ...]:
    """The maps of a family at a difficulty on which suites are driven."""
    return tuple(GeneratedPlace(family=family, difficulty=difficulty, seed=seed) for seed in SUITE_SEEDS[:maps])


def build_places(places: Iterable[Place]) -> tuple[Arena, ...]:
    """The arenas of a suite."""
    arenas: list[Arena] = []
    for place in places:
        if isinstance(place, GeneratedPlace):
            arenas.append(generate_arena(place.family, place.difficulty, place.seed))
        else:
            arenas += build_arenas(place)
    return tuple(arenas)


def content_hash(arenas: tuple[Arena, ...], scenarios: list[list[float]]) -> str:
    """SHA-256 of what a policy meets."""
    geometry = [
        [
            [round(arena.half_width, _DECIMALS), round(arena.half_height, _DECIMALS)],
            np.round(arena.circles, _DECIMALS).tolist(),
            np.round(arena.boxes, _DECIMALS).tolist(),
        ]
        for arena in arenas
    ]
    return hashlib.sha256(json.dumps([geometry, scenarios]).encode()).hexdigest()


def suite_names() -> tuple[str, ...]:
    """All suites, by name."""
    files = (resources.files("sim") / "suite_data").iterdir()
    return tuple(sorted(file.name.removesuffix(".json") for file in files if file.name.endswith(".json")))


@cache
def load_suite(name: str) -> Suite:
    """A suite by name.

    Raises:
        SuiteError: there is none of this name, or its content is not what its hash says.
    """
    if name not in suite_names():
        raise SuiteError(f"there is no suite {name!r}; there are {', '.join(suite_names())}")
    content = json.loads((resources.files("sim") / "suite_data" / f"{name}.json").read_text("utf-8"))
    arenas = build_places(_PLACES.validate_python(content["arenas"]))
    if content_hash(arenas, content["scenarios"]) != content["hash"]:
        raise SuiteError(
            f"suite {name!r} is not what its hash says: its file or its arenas have changed. Restore them, or give the new "
            "scenarios a new name (python -m sim.suite_builder NAME)"
        )
    return _suite(name, content["hash"], arenas, content["scenarios"])


def _suite(name: str, content: str, arenas: tuple[Arena, ...], scenarios: list[list[float]]) -> Suite:
    table = np.array(scenarios, dtype=np.float64)
    return Suite(
        name=name,
        hash=content,
        arenas=arenas,
        arena_indices=table[:, 0].astype(np.int32),
        starts=table[:, 1:4],
        targets=table[:, 4:6],
        shortest_paths=table[:, 6],
    )


def suite_for(task: TaskConfig) -> Suite:
    """The suite on which policies trained for a task are measured: a frozen one, or one drawn for its arena.

    A drawn suite depends on the arena alone, so all policies that were trained for it meet the same scenarios: 20 generated
    maps of the same family and difficulty, none of which is in any training, or the imported arena itself.

    Raises:
        ArenaError: the default robot has no room in the arena.
    """
    if isinstance(task.arena, ArenaConfig):
        return load_suite(f"{task.arena.name}-{_DRAWN_SCENARIOS}")
    return _draw_suite(task.arena)


@lru_cache(maxsize=8)
def _draw_suite(arena: AnyArenaConfig) -> Suite:
    if isinstance(arena, GeneratedArenaConfig):
        name = f"{arena.name}-{arena.difficulty:g}-{_DRAWN_SCENARIOS}"
        arenas = build_places(suite_places(arena.name, arena.difficulty, _DRAWN_MAPS))
    else:
        arenas = build_arenas(arena)
        name = f"{arenas[0].name[:_NAME]}-{_DRAWN_SCENARIOS}"
    scenarios = draw_scenarios(name, arenas, _DRAWN_SCENARIOS)
    return _suite(name, content_hash(arenas, scenarios), arenas, scenarios)


def run_suite(policy: PolicyFunction, task: TaskConfig, suite: Suite) -> EpisodeTable:
    """Drive every scenario once with a policy that sees observations; see `run_controller`."""
    return run_controller(lambda situation: policy(situation.observations), task, suite)


def run_controller(controller: Callable[[Situation], Floats], task: TaskConfig, suite: Suite) -> EpisodeTable:
    """Drive every scenario once, all side by side.

    Args:
        controller: situations of the robots under way to their actions (n, 2); called with fewer robots as they finish.
        task: robot, LiDAR, observation, reward and limits; the arenas are the suite's.
        suite: the scenarios.

    Raises:
        PlacementError: the task's robot does not fit at a start of the suite.
    """
    world = World(task, suite.arenas, len(suite), seed=0, respawn=False)
    world.reset(poses=suite.starts, targets=suite.targets, arenas=suite.arena_indices)
    robots = world.robots
    outcomes = np.zeros(len(suite), dtype=np.uint8)
    actions = np.zeros((len(suite), 2), dtype=np.float32)
    ended = {name: robots.records[name].copy() for name in ("steps", "attempt_reward", "path_length", "min_clearance")}
    active = np.arange(len(suite))
    while len(active):
        situation = Situation(
            robots.observations[active], robots.ranges[active], robots.poses[active], robots.targets[active]
        )
        actions[active] = controller(situation)
        world.step(actions)
        done = active[robots.outcomes[active] > 0]
        if len(done):
            outcomes[done] = robots.outcomes[done]
            for name, column in ended.items():
                column[done] = robots.records[name][done]
            world.park(done)
            active = active[robots.outcomes[active] == 0]
    return EpisodeTable(
        outcomes=outcomes,
        steps=ended["steps"],
        rewards=ended["attempt_reward"],
        path_lengths=ended["path_length"],
        shortest_paths=suite.shortest_paths,
        min_clearances=ended["min_clearance"],
    )

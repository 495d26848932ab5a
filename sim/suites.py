"""Frozen scenarios on which policies are compared, and driving all of them side by side.

A suite's file in `sim/suite_data` holds where every scenario starts, its target and the length of the shortest path;
`sim.suite_builder` is the procedure that made it. The hash covers scenarios and the geometry of their arenas: a suite that
differs in anything is another suite, and a file that does not match its hash is refused.
"""

import hashlib
import json
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cache, lru_cache
from importlib import resources

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, TypeAdapter

from sim.arena_file import ArenaFile
from sim.arenas import Arena, arena_clearance, build_arenas
from sim.arenas.build import with_movers
from sim.arenas.document import to_arena
from sim.arenas.families import CLEARANCE, SUITE_SEEDS, generate_arena
from sim.config import AnyArenaConfig, ArenaConfig, FamilyName, Frozen, GeneratedArenaConfig, ImportedArenaConfig, TaskConfig
from sim.errors import PlacementError, SuiteError
from sim.mover_config import MoversConfig
from sim.scenarios import draw_scenarios, own_scenarios, scenario_world
from sim.world import World

Floats = NDArray[np.float32]
PolicyFunction = Callable[[Floats], Floats]
"""Observations (n, numbers) to actions (n, 2)."""
Observer = Callable[[NDArray[np.int64], World], None]
"""Told before the first step, and after each one, the scenarios that were under way, and the world as it is now."""

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
    movers: MoversConfig = Field(default_factory=MoversConfig)


Place = ArenaConfig | GeneratedPlace | ArenaFile
_PLACES: TypeAdapter[tuple[Place, ...]] = TypeAdapter(tuple[Place, ...])


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


def content_hash(arenas: tuple[Arena, ...], scenarios: list[list[float]]) -> str:
    """SHA-256 of what a policy meets."""
    geometry = [
        [
            [round(arena.half_width, _DECIMALS), round(arena.half_height, _DECIMALS)],
            np.round(arena.circles, _DECIMALS).tolist(),
            np.round(arena.boxes, _DECIMALS).tolist(),
            # Arenas in which nothing moves keep the hash that they had before anything could.
            *([[mover.kind, mover.radius, mover.speed, mover.waypoints] for mover in arena.movers]),
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


def suite_of(name: str, documents: Sequence[ArenaFile], task: TaskConfig | None = None) -> Suite:
    """A suite of one scenario for each arena file: its own start and target.

    Args:
        name: of the suite.
        documents: arenas with a start and a target, see `sim.arenas.files.load_arena`.
        task: whose robot must fit there; the default one's if not given.

    Raises:
        PlacementError: an arena has no start or target, the robot does not fit there, or there is no way between them.
    """
    arenas, scenarios = build_places(documents), own_scenarios(documents, task)
    return _suite(name, content_hash(arenas, scenarios), arenas, scenarios)


def suite_in(name: str, places: Sequence[GeneratedPlace], count: int) -> Suite:
    """A suite of scenarios spread evenly over places, drawn as those of a frozen suite of this name would be."""
    arenas = build_places(places)
    scenarios = draw_scenarios(name, arenas, count)
    return _suite(name, content_hash(arenas, scenarios), arenas, scenarios)


def suite_for(task: TaskConfig) -> Suite:
    """The suite on which policies trained for a task are measured: a frozen one, or one drawn for its arena.

    A drawn suite depends on the arena alone, so all policies that were trained for it meet the same scenarios: 20 generated
    maps of the same family and difficulty, none of which is in any training, or the imported arena itself, whose own
    start and target are the first scenario if it has them; with the movers of the training's arena. A robot that needs more
    room than the default one gets a suite with that room, and its clearance in the suite's name.

    Raises:
        ArenaError: the robot has no room in the arena.
    """
    usual = TaskConfig()
    fits = task.passable_clearance <= usual.passable_clearance
    if fits and isinstance(task.arena, ArenaConfig) and not task.arena.movers.count:
        return load_suite(f"{task.arena.name}-{_DRAWN_SCENARIOS}")
    large = TaskConfig(robot=task.robot, collision_distance=task.collision_distance)
    return _draw_suite(task.arena, usual if fits else large)


def suite_named(name: str, task: TaskConfig) -> Suite:
    """The task's own suite where it goes by that name, else the frozen one.

    Raises:
        SuiteError: there is none.
    """
    own = suite_for(task)
    return own if own.name == name else load_suite(name)


@lru_cache(maxsize=8)
def _draw_suite(arena: AnyArenaConfig, task: TaskConfig) -> Suite:
    """Scenarios for the robot and collision distance of `task`."""
    usual = task.passable_clearance <= TaskConfig().passable_clearance
    ending = f"{_DRAWN_SCENARIOS}" if usual else f"{task.passable_clearance:.2f}m-{_DRAWN_SCENARIOS}"
    if isinstance(arena, GeneratedArenaConfig):
        name = f"{arena.name}-{arena.difficulty:g}"
        places = suite_places(arena.name, arena.difficulty, _DRAWN_MAPS, arena.movers)
        arenas = build_places(places, clearance=arena_clearance(task))
    else:
        arenas = build_arenas(arena)
        name = arenas[0].name[:_NAME]
    if arena.movers.count:
        name += f"-{arena.movers.count}-{arena.movers.kind}"
    name += f"-{ending}"
    scenarios = draw_scenarios(name, arenas, _DRAWN_SCENARIOS, task)
    if isinstance(arena, ImportedArenaConfig) and arena.arena and arena.arena.start and arena.arena.target:
        with suppress(PlacementError):  # a start or target that this robot does not fit at
            scenarios[:1] = own_scenarios([arena.arena], task)
    return _suite(name, content_hash(arenas, scenarios), arenas, scenarios)


def run_suite(policy: PolicyFunction, task: TaskConfig, suite: Suite, observer: Observer | None = None) -> EpisodeTable:
    """Drive every scenario once with a policy that sees observations; see `run_controller`."""
    return run_controller(lambda situation: policy(situation.observations), task, suite, observer)


def run_controller(
    controller: Callable[[Situation], Floats], task: TaskConfig, suite: Suite, observer: Observer | None = None
) -> EpisodeTable:
    """Drive every scenario once, all side by side.

    Args:
        controller: situations of the robots under way to their actions (n, 2); called with fewer robots as they finish.
        task: robot, LiDAR, observation, reward and limits; the arenas are the suite's.
        suite: the scenarios.
        observer: looks on.

    Raises:
        SuiteError: the task's robot does not fit at a start of the suite.
    """
    world = scenario_world(task, suite.arenas, len(suite))
    try:
        world.reset(poses=suite.starts, targets=suite.targets, arenas=suite.arena_indices)
    except PlacementError as error:
        raise SuiteError(
            f"suite {suite.name!r} has no room for this robot ({error}): use a smaller one, or the suite that "
            "sim.suites.suite_for draws for it"
        ) from error
    robots = world.robots
    outcomes = np.zeros(len(suite), dtype=np.uint8)
    actions = np.zeros((len(suite), 2), dtype=np.float32)
    ended = {name: robots.records[name].copy() for name in ("steps", "attempt_reward", "path_length", "min_clearance")}
    active = np.arange(len(suite))
    if observer is not None:
        observer(active, world)
    while len(active):
        situation = Situation(
            robots.observations[active], robots.ranges[active], robots.poses[active], robots.targets[active]
        )
        actions[active] = controller(situation)
        world.step(actions)
        if observer is not None:
            observer(active, world)
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

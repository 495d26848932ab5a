"""Frozen scenarios on which policies are compared.

A suite's file in `sim/suites/data` holds where every scenario starts, its target and the length of the shortest path;
`sim.suites.builder` is the procedure that made it. The hash covers scenarios and the geometry of their arenas: a suite that
differs in anything is another suite, and a file that does not match its hash is refused.
"""

import hashlib
import json
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from sim.arenas import Arena, arena_clearance, build_arenas
from sim.arenas.build import pooled_arena
from sim.arenas.families import SUITE_SEEDS
from sim.config import AnyArenaConfig, ArenaConfig, ArenaFile, ArenaPool, ImportedArenaConfig, TaskConfig
from sim.errors import PlacementError, SuiteError
from sim.frozen import suite_names, suite_text
from sim.suite_rules import SuiteRules
from sim.suites.places import PLACES, GeneratedPlace, ScenePlace, build_places, content_hash
from sim.suites.scenarios import draw_scenarios, own_scenarios, scene_scenarios

# Maps and scenarios of a suite that is drawn for a task.
_DRAWN_MAPS = 20
_DRAWN_SCENARIOS = 200
# Characters of an imported arena's name in the name of its suite.
_NAME = 40


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
        shortest_paths: (S,) metres, for the default robot's body around the obstacles, or that of the suite's rules.
        rules: what it asks of a robot; by default nothing.
        together: so many scenarios, one after another, are driven in one arena by robots that see one another; who has ended
            its attempt is gone. 1 where each robot is alone, whatever it was trained among.
    """

    name: str
    hash: str
    arenas: tuple[Arena, ...]
    arena_indices: NDArray[np.int32]
    starts: NDArray[np.float64]
    targets: NDArray[np.float64]
    shortest_paths: NDArray[np.float64]
    rules: SuiteRules = field(default_factory=SuiteRules)
    together: int = 1

    def __len__(self) -> int:
        return len(self.starts)


@cache
def load_suite(name: str) -> Suite:
    """A suite by name.

    Raises:
        SuiteError: there is none of this name, or its content is not what its hash says.
    """
    if name not in suite_names():
        raise SuiteError(f"there is no suite {name!r}; there are {', '.join(suite_names())}")
    content = json.loads(suite_text(name))
    arenas = build_places(PLACES.validate_python(content["arenas"]))
    rules = SuiteRules.model_validate(content.get("rules", {}))
    if content_hash(arenas, content["scenarios"], rules) != content["hash"]:
        raise SuiteError(
            f"suite {name!r} is not what its hash says: its file or its arenas have changed. Restore them, or give the new "
            "scenarios a new name (python -m sim.suites.builder NAME)"
        )
    return _suite(name, content["hash"], arenas, content["scenarios"], rules)


def _suite(
    name: str, content: str, arenas: tuple[Arena, ...], scenarios: list[list[float]], rules: SuiteRules | None = None
) -> Suite:
    table = np.array(scenarios, dtype=np.float64)
    return Suite(
        name=name,
        hash=content,
        arenas=arenas,
        arena_indices=table[:, 0].astype(np.int32),
        starts=table[:, 1:4],
        targets=table[:, 4:6],
        shortest_paths=table[:, 6],
        rules=rules or SuiteRules(),
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


def suite_in(name: str, places: Sequence[GeneratedPlace], count: int, rules: SuiteRules | None = None) -> Suite:
    """A suite of scenarios spread evenly over places, drawn as those of a frozen suite of this name would be."""
    arenas = build_places(places)
    scenarios = draw_scenarios(name, arenas, count)
    return _suite(name, content_hash(arenas, scenarios, rules), arenas, scenarios, rules)


def suite_of_scenes(name: str, places: Sequence[ScenePlace], rules: SuiteRules) -> Suite:
    """A suite of scenes among people, one scenario each: their own start and target."""
    arenas, scenarios = build_places(places), scene_scenarios(places, rules.task())
    return _suite(name, content_hash(arenas, scenarios, rules), arenas, scenarios, rules)


def suite_for(task: TaskConfig) -> Suite:
    """The suite on which policies trained for a task are measured: a frozen one, or one drawn for its arena.

    A drawn suite depends on the arena alone, so all policies that were trained for it meet the same scenarios: 20 generated
    maps of the same family and difficulty, none of which is in any training, or the imported arena itself, whose own
    start and target are the first scenario if it has them; with the movers of the training's arena. A robot that needs more
    room than the default one gets a suite with that room, and its clearance in the suite's name; robots that are together
    get one in which they are, some more scenarios if groups need them.

    Raises:
        ArenaError: the robot has no room in the arena.
    """
    usual = TaskConfig(together=task.together)
    fits = task.passable_clearance <= usual.passable_clearance
    if fits and isinstance(task.arena, ArenaConfig) and not task.arena.movers.count and task.together == 1:
        return load_suite(f"{task.arena.name}-{_DRAWN_SCENARIOS}")
    body = ("robot", "collision_distance", "way_clearance", "together")
    large = TaskConfig.model_validate({name: getattr(task, name) for name in body})
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
    """Scenarios for the robot and collision distance of `task`, and for as many together."""
    usual = task.passable_clearance <= TaskConfig().passable_clearance
    if isinstance(arena, ArenaPool):
        name = f"{arena.name}-{arena.difficulty:g}{_variant(arena)}"
        seeds = SUITE_SEEDS[:_DRAWN_MAPS]
        arenas = tuple(pooled_arena(arena, seed, clearance=arena_clearance(task)) for seed in seeds)
    else:
        arenas = build_arenas(arena)
        name = arenas[0].name[:_NAME]
    if arena.movers.count:
        name += f"-{arena.movers.count}-{arena.movers.kind}" + ("-seeing" if arena.movers.sees_robots else "")
    if task.together > 1:
        name += f"-{task.together}-together"
    each = -(-_DRAWN_SCENARIOS // len(arenas) // task.together) * task.together
    name += "" if usual else f"-{task.passable_clearance:.2f}m"
    name += f"-{each * len(arenas)}"
    scenarios = draw_scenarios(name, arenas, each * len(arenas), task)
    brought = arena.arena if isinstance(arena, ImportedArenaConfig) else None
    if brought and brought.start and brought.target and task.together == 1:
        with suppress(PlacementError):  # a start or target that this robot does not fit at
            scenarios[:1] = own_scenarios([brought], task)
    return replace(_suite(name, content_hash(arenas, scenarios), arenas, scenarios), together=task.together)


def _variant(arena: ArenaPool) -> str:
    """What tells the parameters that a family of an extension has of its own from others, in the name of a suite."""
    own = arena.model_dump(mode="json", exclude=set(ArenaPool.model_fields))
    if own == type(arena).model_validate({}).model_dump(mode="json", include=set(own)):
        return ""
    return f"-{hashlib.sha256(json.dumps(own, sort_keys=True).encode()).hexdigest()[:6]}"

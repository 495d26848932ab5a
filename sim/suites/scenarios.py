"""Drawing scenarios for a suite: where robots start, where they should go, and how long the shortest path is."""

import hashlib
import math
from collections.abc import Sequence
from functools import partial

import numpy as np
from numpy.typing import NDArray

from sim.arenas import Arena, free_distance
from sim.arenas.document import to_arena
from sim.arenas.planner import Planner
from sim.config import ArenaFile, TaskConfig
from sim.engine.movers import Movers
from sim.engine.world import World, spawn_space
from sim.errors import PlacementError
from sim.kernels.records import CELL
from sim.kernels.step import MIN_TARGET_DISTANCE, MOVER_ROOM, SPAWN_TRIES
from sim.streams import EVALUATION
from sim.suites.places import BarnPlace, ScenePlace

COLUMNS = ("arena", "x", "y", "heading", "target_x", "target_y", "shortest_path")
"""Of a scenario: the arena's index, metres and radians."""

SEED = 0
"""Of the stream `EVALUATION`: every policy meets the same movers and the same noise."""

_DECIMALS = 4  # a tenth of a millimetre


def scenario_world(task: TaskConfig, arenas: Sequence[Arena], robots: int) -> World:
    """A world to drive a suite's scenarios in; wherever a scenario stands among the others, its movers go the same way."""
    return World(task, arenas, robots, seed=SEED, stream=EVALUATION, respawn=False)


def draw_scenarios(name: str, arenas: Sequence[Arena], count: int, task: TaskConfig | None = None) -> list[list[float]]:
    """Scenarios spread evenly over arenas, drawn as in training: uniform over the free space, at least 0.5 m apart.

    Args:
        name: of the suite; it seeds the generator, which is used for nothing else.
        arenas: the places.
        count: how many in all, rounded up to fill every arena evenly, and with whole groups.
        task: whose robot must fit at the starts and targets; the default one's if not given. Where robots are together,
            so many scenarios one after another are of one arena, and their starts as clear of one another as of movers.

    Returns:
        A list of `COLUMNS` for each scenario; the shortest path is that of the robot's body, which may touch obstacles and
        takes no notice of movers. Starts are clear of where the movers start, as far as there is room.

    Raises:
        ArenaError: an arena has no room for the robot.
    """
    task = task or TaskConfig()
    rng = np.random.default_rng(np.frombuffer(hashlib.sha256(name.encode()).digest(), dtype=np.uint32))
    scenarios: list[list[float]] = []
    movers = scenario_world(task, arenas, 1).movers
    movers.place()
    for index, arena in enumerate(arenas):
        planner = Planner(arena, task.robot.circumscribed_radius)
        space = spawn_space(task, arena)
        group: list[NDArray[np.float64]] = []  # where those start that start together
        room = partial(_room, movers, index, group, task.robot.circumscribed_radius)
        for turn in range(-(-count // len(arenas) // task.together) * task.together):
            if turn % task.together == 0:
                group.clear()
            start = _draw(rng, arena, space.starts, space.clearance)
            for _ in range(SPAWN_TRIES):
                if room(start) >= MOVER_ROOM:
                    break
                start = max(start, _draw(rng, arena, space.starts, space.clearance), key=room)
            group.append(start)
            target = _draw(rng, arena, space.targets, space.clearance)
            while np.hypot(*(target - start)) < MIN_TARGET_DISTANCE:
                target = _draw(rng, arena, space.targets, space.clearance)
            heading = round(float(rng.uniform(-np.pi, np.pi)), _DECIMALS)
            shortest = round(planner.shortest_path(start, target).length, _DECIMALS)
            scenarios.append([index, *start.tolist(), heading, *target.tolist(), shortest])
    return scenarios


def own_scenarios(documents: Sequence[ArenaFile], task: TaskConfig | None = None) -> list[list[float]]:
    """The scenarios that arena files bring themselves, a list of `COLUMNS` for each.

    Args:
        documents: arenas with a start and a target.
        task: whose robot must fit there; the default one's if not given.

    Raises:
        PlacementError: an arena has no start or target, the robot does not fit there, or there is no way between them.
    """
    task = task or TaskConfig()
    scenarios: list[list[float]] = []
    for index, document in enumerate(documents):
        start, target, arena = document.start, document.target, to_arena(document)
        if start is None or target is None:
            raise PlacementError(
                f"arena {document.name!r} comes without a start and a target of its own: write them into it"
            )
        places = [(start.x, start.y), (target.x, target.y)]
        for place, room in zip(places, free_distance(arena, places).tolist(), strict=True):
            if room < task.passable_clearance:
                raise PlacementError(
                    f"({place[0]:g}, {place[1]:g}) in arena {document.name!r} is {room:.2f} m from an obstacle, and the "
                    f"robot needs {task.passable_clearance:.2f} m"
                )
        shortest = Planner(arena, task.robot.circumscribed_radius).shortest_path(*places).length
        row = [start.x, start.y, math.radians(start.heading), target.x, target.y, shortest]
        scenarios.append([index, *(round(value, _DECIMALS) for value in row)])
    return scenarios


def scene_scenarios(places: Sequence[ScenePlace], task: TaskConfig) -> list[list[float]]:
    """The scenarios of scenes among people, a list of `COLUMNS` for each; shortest paths are those around what stands.

    Args:
        places: the scenes.
        task: whose robot drives there.
    """
    scenarios: list[list[float]] = []
    for index, place in enumerate(places):
        scene = place.build()
        shortest = Planner(scene.arena, task.robot.circumscribed_radius).shortest_path(scene.start[:2], scene.target).length
        row = [*scene.start, *scene.target, shortest]
        scenarios.append([index, *(round(value, _DECIMALS) for value in row)])
    return scenarios


def barn_scenarios(places: Sequence[BarnPlace]) -> list[list[float]]:
    """The scenarios of BARN's worlds, a list of `COLUMNS` for each; for the shortest path stands the challenge's."""
    scenarios: list[list[float]] = []
    for index, place in enumerate(places):
        world = place.build()
        row = [*world.start, *world.target, world.path_length()]
        scenarios.append([index, *(round(value, _DECIMALS) for value in row)])
    return scenarios


def _room(
    movers: Movers, index: int, group: Sequence[NDArray[np.float64]], radius: float, place: NDArray[np.float64]
) -> float:
    """Metres from a place (2,) in an arena to the nearest surface of a mover, or of a robot that stands in a group."""
    return min([movers.distance(index, place), *(float(np.hypot(*(place - other))) - radius for other in group)])


def _draw(rng: np.random.Generator, arena: Arena, cells: NDArray[np.float32], clearance: float) -> NDArray[np.float64]:
    """A point in one of the cells, clear of everything, (2,) metres."""
    while True:
        corner = cells[rng.integers(len(cells))].astype(np.float64)
        point: NDArray[np.float64] = np.round(corner + CELL * rng.random(2), _DECIMALS)
        if free_distance(arena, point) >= clearance:
            return point

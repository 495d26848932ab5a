"""Drawing scenarios for a suite: where robots start, where they should go, and how long the shortest path is."""

import hashlib
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sim.arenas import Arena, free_distance
from sim.arenas.freespace import CELL
from sim.config import TaskConfig
from sim.kernels.step import MIN_TARGET_DISTANCE
from sim.planner import Planner
from sim.world import spawn_space

COLUMNS = ("arena", "x", "y", "heading", "target_x", "target_y", "shortest_path")
"""Of a scenario: the arena's index, metres and radians."""

_DECIMALS = 4  # a tenth of a millimetre


def draw_scenarios(name: str, arenas: Sequence[Arena], count: int, task: TaskConfig | None = None) -> list[list[float]]:
    """Scenarios spread evenly over arenas, drawn as in training: uniform over the free space, at least 0.5 m apart.

    Args:
        name: of the suite; it seeds the generator, which is used for nothing else.
        arenas: the places.
        count: how many in all, rounded up to fill every arena evenly.
        task: whose robot must fit at the starts and targets; the default one's if not given.

    Returns:
        A list of `COLUMNS` for each scenario; the shortest path is that of the robot's body, which may touch obstacles.

    Raises:
        ArenaError: an arena has no room for the robot.
    """
    task = task or TaskConfig()
    rng = np.random.default_rng(np.frombuffer(hashlib.sha256(name.encode()).digest(), dtype=np.uint32))
    scenarios: list[list[float]] = []
    for index, arena in enumerate(arenas):
        planner = Planner(arena, task.robot.radius)
        space = spawn_space(task, arena)
        for _ in range(-(-count // len(arenas))):
            start = _draw(rng, arena, space.starts, space.clearance)
            target = _draw(rng, arena, space.targets, space.clearance)
            while np.hypot(*(target - start)) < MIN_TARGET_DISTANCE:
                target = _draw(rng, arena, space.targets, space.clearance)
            heading = round(float(rng.uniform(-np.pi, np.pi)), _DECIMALS)
            shortest = round(planner.shortest_path(start, target).length, _DECIMALS)
            scenarios.append([index, *start.tolist(), heading, *target.tolist(), shortest])
    return scenarios


def _draw(rng: np.random.Generator, arena: Arena, cells: NDArray[np.float32], clearance: float) -> NDArray[np.float64]:
    """A point in one of the cells, clear of everything, (2,) metres."""
    while True:
        corner = cells[rng.integers(len(cells))].astype(np.float64)
        point: NDArray[np.float64] = np.round(corner + CELL * rng.random(2), _DECIMALS)
        if free_distance(arena, point) >= clearance:
            return point

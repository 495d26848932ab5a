"""How the suites were made: `python -m sim.suite_builder NAME` writes the file again, byte for byte.

The scenarios come from a generator that is seeded by the suite's name and used for nothing else, so they are no part of any
training. Starts and targets are drawn as in training: uniform over the free space, at least 0.5 m apart.
"""

import hashlib
import json
import sys
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sim.arenas import Arena, build_arenas, free_distance
from sim.arenas.freespace import CELL
from sim.arenas.paths import PathPlanner
from sim.config import ArenaConfig, TaskConfig
from sim.errors import SuiteError
from sim.kernels.step import MIN_TARGET_DISTANCE
from sim.suites import content_hash
from sim.world import spawn_space

_DECIMALS = 4  # a tenth of a millimetre
_SUITES: dict[str, tuple[tuple[ArenaConfig, ...], int]] = {
    "simple-200": ((ArenaConfig(name="simple"),), 200),
    "complex-200": ((ArenaConfig(name="complex"),), 200),
}


def build_suite(name: str) -> str:
    """The text of a suite's file.

    Raises:
        SuiteError: there is no suite of this name.
    """
    if name not in _SUITES:
        raise SuiteError(f"there is no suite {name!r}; there are {', '.join(_SUITES)}")
    configs, count = _SUITES[name]
    task = TaskConfig()
    arenas = tuple(arena for config in configs for arena in build_arenas(config))
    rng = np.random.default_rng(np.frombuffer(hashlib.sha256(name.encode()).digest(), dtype=np.uint32))
    scenarios: list[list[float]] = []
    for index, arena in enumerate(arenas):
        planner = PathPlanner(arena, task.robot.radius)
        space = spawn_space(task, arena)
        for _ in range(count // len(arenas)):
            start = _draw(rng, arena, space.starts, space.clearance)
            target = _draw(rng, arena, space.targets, space.clearance)
            while np.hypot(*(target - start)) < MIN_TARGET_DISTANCE:
                target = _draw(rng, arena, space.targets, space.clearance)
            heading = round(float(rng.uniform(-np.pi, np.pi)), _DECIMALS)
            shortest = round(planner.length(start, target), _DECIMALS)
            scenarios.append([index, *start.tolist(), heading, *target.tolist(), shortest])
    content = {
        "name": name,
        "hash": content_hash(arenas, scenarios),
        "arenas": [config.model_dump(mode="json") for config in configs],
        "columns": ["arena", "x", "y", "heading", "target_x", "target_y", "shortest_path"],
    }
    head = json.dumps(content, indent=1)[:-2]
    rows = ",\n".join(f"  {json.dumps(row)}" for row in scenarios)
    return f'{head},\n "scenarios": [\n{rows}\n ]\n}}\n'


def _draw(rng: np.random.Generator, arena: Arena, cells: NDArray[np.float32], clearance: float) -> NDArray[np.float64]:
    """A point in one of the cells, clear of everything, (2,) metres."""
    while True:
        corner = cells[rng.integers(len(cells))].astype(np.float64)
        point: NDArray[np.float64] = np.round(corner + CELL * rng.random(2), _DECIMALS)
        if free_distance(arena, point) >= clearance:
            return point


def main() -> None:
    """Write the files of the suites named on the command line, of all when none is."""
    for name in sys.argv[1:] or list(_SUITES):
        path = Path(__file__).parent / "suite_data" / f"{name}.json"
        path.parent.mkdir(exist_ok=True)
        path.write_text(build_suite(name), "utf-8")


if __name__ == "__main__":
    main()

"""Our planners beside the BARN challenge's own example, on the same published worlds, at its speed and at the challenge's.

python -m benchmarks.barn_validation --check

The challenge's repository (Daffan/the-barn-challenge, res/dwa_out.txt at commit 3f77441) has the log of its example,
move_base with DWA, over 50 worlds ten times each: success 85.0 %, collisions 5.6 %, score 0.159. Its configuration there
(jackal_helper/configs/params/base_local_planner_params.yaml) drives at 0.5 m/s at most and turns at 1.57 rad/s, and its
fastest drives say the same: 19.2 s for the 9.6 m from 0.1 m behind the start to 0.3 m before the goal. Ten of the worlds
are in `barn-20`. Optimal times are those of the log: the time taken over its last column.
"""

import dataclasses
import time
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from benchmarks.report import finish, parser
from sim.baselines.named import TABLED, controller_of
from sim.config import JackalConfig, TaskConfig
from sim.suites import EpisodeTable, Suite, SuiteRules, load_suite, run_controller, run_suite
from workers.checkpoints import read_policy
from workers.policy import torch_policy
from workers.shipped.library import shipped_policy


class Published(NamedTuple):
    """What the log says of a world: of ten attempts, the mean time of the arrivals, optimal time, mean score; seconds."""

    arrivals: int
    collisions: int
    seconds: float
    optimal: float
    score: float


LOG = {
    0: Published(8, 1, 35.3, 6.72, 0.161),
    30: Published(10, 0, 32.3, 5.92, 0.195),
    60: Published(10, 0, 33.1, 5.57, 0.171),
    90: Published(10, 0, 23.1, 5.64, 0.245),
    120: Published(9, 1, 34.7, 5.84, 0.154),
    150: Published(10, 0, 27.2, 5.41, 0.201),
    180: Published(10, 0, 33.5, 5.73, 0.176),
    210: Published(9, 1, 36.8, 5.24, 0.139),
    240: Published(9, 0, 38.3, 6.41, 0.157),
    270: Published(6, 1, 37.7, 5.91, 0.098),
}
"""The worlds that are both in the log and in `barn-20`."""

EXAMPLE = JackalConfig(
    max_linear_speed=0.5, max_angular_speed=1.57, max_linear_acceleration=10.0, max_angular_acceleration=20.0
)
"""The Jackal within the limits that the example sets itself."""

EXAMPLE_ARRIVAL = 0.3
"""Metres from the goal at which the log's attempts end."""

MOVE_BASE = "mapping, A* and dynamic window"
"""The one that is made as the example is: a global planner on what was seen, a dynamic window that follows."""

PLANNERS = ("dynamic window", MOVE_BASE, "MPPI", "VFH+")

POLICY = "jackal"
"""The shipped policy that drives beside them, where the limits are those that it was trained for."""

# Validated would be a simulator in which the same kind of planner scores about as much as in the log.
AT_MOST = {f"{MOVE_BASE} at 0.5 m/s, times the log's score": 1.2}


def suite(robot: JackalConfig, arrival: float) -> Suite:
    """The worlds of `LOG` by the challenge's rules, with these limits."""
    published = load_suite("barn-20")
    names = [f"world_{world}" for world in LOG]
    which = [index for index, arena in enumerate(published.arenas) if arena.name in names]
    rules = load_suite("barn-jackal-300").rules
    return dataclasses.replace(
        published,
        arena_indices=published.arena_indices[which],
        starts=published.starts[which],
        targets=published.targets[which],
        shortest_paths=published.shortest_paths[which],
        rules=SuiteRules.model_validate({**dict(rules), "robot": robot, "arrival_distance": arrival}),
    )


def scores(table: EpisodeTable, period: float) -> NDArray[np.float64]:
    """The challenge's score with the log's optimal times."""
    optimal = np.array([world.optimal for world in LOG.values()])
    return np.asarray((table.outcomes == 1) * optimal / np.clip(table.steps * period, 2.0 * optimal, 8.0 * optimal))


def _driven(name: str, task: TaskConfig, worlds: Suite) -> EpisodeTable:
    if name != POLICY:
        return run_controller(controller_of(TABLED[name], task), task, worlds)
    manifest, policy = read_policy(shipped_policy(name).archive)
    return run_suite(torch_policy(policy), manifest.training.task, worlds)


def main() -> None:
    """Print the table in Markdown."""
    options = parser(__doc__).parse_args()
    begun = time.time()
    figures: dict[str, object] = {}
    log = LOG.values()
    arrivals = sum(world.arrivals for world in log)
    print("| driver | top speed, m/s | success, % | collisions, % | time, s | score |\n|---|---|---|---|---|---|")
    seconds = sum(world.arrivals * world.seconds for world in log) / arrivals
    hit, published = sum(world.collisions for world in log), float(np.mean([world.score for world in log]))
    print(f"| the challenge's example, its log | 0.5 | {arrivals:.0f} | {hit:.0f} | {seconds:.1f} | {published:.3f} |")
    full = load_suite("barn-jackal-300").rules
    assert isinstance(full.robot, JackalConfig)
    assert full.arrival_distance is not None
    for robot, arrival in ((EXAMPLE, EXAMPLE_ARRIVAL), (full.robot, full.arrival_distance)):
        worlds = suite(robot, arrival)
        task = worlds.rules.task()
        for name in PLANNERS if robot is EXAMPLE else (*PLANNERS, POLICY):
            table = _driven(name, task, worlds)
            arrived = table.outcomes == 1
            score = float(scores(table, task.control_period).mean())
            figures[f"{name} at {robot.max_linear_speed:g} m/s, score"] = round(score, 4)
            if robot is EXAMPLE:
                figures[f"{name} at 0.5 m/s, times the log's score"] = round(score / published, 2)
            taken = f"{task.control_period * table.steps[arrived].mean():.1f}" if arrived.any() else "-"
            print(
                f"| {name} | {robot.max_linear_speed:g} | {100 * arrived.mean():.0f} | "
                f"{100 * (table.outcomes == 2).mean():.0f} | {taken} | {score:.3f} |",
                flush=True,
            )
    figures["seconds"] = round(time.time() - begun)
    finish("barn_validation", figures, at_most=AT_MOST, check=options.check)


if __name__ == "__main__":
    main()

"""The published log beside our planners: the same worlds, its limits, its score."""

import numpy as np

from benchmarks.barn_validation import EXAMPLE, EXAMPLE_ARRIVAL, LOG, scores, suite
from sim.suites import EpisodeTable


def test_the_worlds_are_the_logs_in_its_order_with_its_robots_limits() -> None:
    worlds = suite(EXAMPLE, EXAMPLE_ARRIVAL)
    assert [worlds.arenas[index].name for index in worlds.arena_indices] == [f"world_{world}" for world in LOG]
    task = worlds.rules.task()
    assert (task.robot.max_linear_speed, task.arrival_distance) == (0.5, 0.3)
    assert (worlds.rules.step_limits(task, worlds.shortest_paths) == 1000).all()


def test_the_score_has_the_logs_optimal_times() -> None:
    none = np.zeros(len(LOG))
    outcomes = np.ones(len(LOG), dtype=np.uint8)
    outcomes[1] = 2
    steps = np.full(len(LOG), 300, dtype=np.int32)
    steps[2] = 1
    found = scores(EpisodeTable(outcomes, steps, none, none, none, none.astype(np.float32)), 0.1)
    # By hand: 6.72 s over 30 s; a collision; faster than twice the optimal time.
    assert found[:3].tolist() == [6.72 / 30.0, 0.0, 0.5]

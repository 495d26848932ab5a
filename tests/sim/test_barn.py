"""Worlds drawn as the BARN benchmark draws them, and the challenge's rules."""

import dataclasses

import numpy as np
import pytest

from sim.arenas.barn import CELL, SIDE, barn_world, shortest_way
from sim.baselines.simple import go_to_goal
from sim.config import JackalConfig, LidarConfig, TaskConfig
from sim.errors import SuiteError
from sim.suites import load_suite, run_suite
from sim.suites.scores import barn_score

SUITE = "barn-jackal-120"


def test_worlds_are_the_automatons_and_have_a_way() -> None:
    for number in range(24):
        world = barn_world(number, 7)
        assert (world.filled == barn_world(number, 7).filled).all()
        assert world.filled[[0, -1]].all()  # the sides
        assert len(world.arena.circles) == world.filled.sum()
        assert world.free[world.first]
        assert world.free[world.last]
        assert (world.first[1], world.last[1]) == (0, SIDE - 1)
        # A free cell's middle is 0.3 m or more from every pillar's, where the Jackal's half width and a pillar take 0.29 m.
        r, c = np.nonzero(world.filled)
        row, column = np.nonzero(world.free)
        assert np.hypot(row[:, None] - r, column[:, None] - c).min() * CELL >= 0.3 - 1e-9
        assert 10.0 <= world.path_length() < 20.0
        assert world.arena.name == f"barn-7-{number}"
    assert (barn_world(0, 7).filled != barn_world(0, 8).filled).any()
    # Fuller and fuller: chances of 0.15, 0.20, 0.25 and 0.30.
    shares = [np.mean([barn_world(number, 7).filled.mean() for number in range(fill, 48, 4)]) for fill in range(4)]
    assert shares == sorted(shares)


def test_the_way_avoids_pillars_and_is_the_shortest_by_hand() -> None:
    free = np.ones((SIDE, SIDE), dtype=bool)
    filled = ~free
    assert len(shortest_way(free, filled, (4, 0), (4, 29))) == 30
    free[:28, 10] = False
    filled = ~free
    way = shortest_way(free, filled, (4, 0), (4, 29))
    assert {cell for cell in way if cell[1] == 10} <= {(28, 10), (29, 10)}
    free[:, 10] = False
    assert shortest_way(free, filled, (4, 0), (4, 29)) == []


def test_the_suite_is_the_challenges() -> None:
    suite = load_suite(SUITE)
    task = suite.rules.task()
    assert (task.robot.max_linear_speed, task.robot.max_angular_speed) == (2.0, 4.0)
    assert (task.robot.max_linear_acceleration, task.robot.max_angular_acceleration) == (20.0, 25.0)
    assert task.robot.half_extents == (0.254, 0.215)
    assert (task.lidar.field_of_view, task.arrival_distance) == (270.0, 1.0)
    assert (suite.rules.step_limits(task, suite.shortest_paths) == 1000).all()  # 100 s of 0.1 s
    # Published: 11.4 m on average over the twenty worlds at hand.
    assert 10.5 < suite.shortest_paths.mean() < 12.5
    assert (suite.starts == [0.0, -4.0, 1.5708]).all()
    assert (suite.targets == [0.0, 6.0]).all()
    for other in (TaskConfig(), task.model_copy(update={"robot": JackalConfig()})):
        with pytest.raises(SuiteError, match="is for robot"):
            run_suite(go_to_goal(other), other, suite)
    around = task.model_copy(update={"lidar": LidarConfig(field_of_view=360.0)})
    with pytest.raises(SuiteError, match="see 270 degrees, not 360"):
        run_suite(go_to_goal(around), around, suite)


def test_the_score_of_a_straight_drive() -> None:
    # 9 m to the circle of 1 m around the goal, in an empty field at 2 m/s: 4.5 s and a step or two. That is less than twice
    # the optimal time, so an arrival counts a half.
    suite = load_suite(SUITE)
    empty = dataclasses.replace(suite.arenas[0], circles=np.empty((0, 3)))
    names = ("arena_indices", "starts", "targets", "shortest_paths")
    one = dataclasses.replace(suite, arenas=(empty,), **{name: getattr(suite, name)[:1] for name in names})
    task = one.rules.task()
    table = run_suite(go_to_goal(task), task, one)
    assert table.outcomes.tolist() == [1]
    assert table.steps[0] * task.control_period == pytest.approx(4.7, abs=0.2)
    assert barn_score(table, task).tolist() == [0.5]

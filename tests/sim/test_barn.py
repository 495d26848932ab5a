"""Worlds drawn as the BARN benchmark draws them, and the challenge's rules."""

import dataclasses

import numpy as np
import pytest

from sim.arenas.barn import SIDE, barn_world, challenge_path, training_world
from sim.arenas.cells import components, free_mask
from sim.baselines.simple import go_to_goal
from sim.config import JackalConfig, LidarConfig, TaskConfig
from sim.errors import SuiteError
from sim.suites import load_suite, run_suite
from sim.suites.scores import barn_score

SUITE = "barn-jackal-300"


def test_worlds_are_the_automatons_and_have_a_way_for_five_by_five_cells() -> None:
    for number in range(12):
        world = barn_world(number, 7)
        assert world.filled[[0, -1]].all()  # the sides
        assert len(world.arena.circles) == world.filled.sum()
        assert world.free[world.first]
        assert world.free[world.last]
        assert (world.first[1], world.last[1]) == (0, SIDE - 1)
        r, c = np.nonzero(world.filled)
        row, column = np.nonzero(world.free)
        assert np.maximum(np.abs(row[:, None] - r), np.abs(column[:, None] - c)).min() == 3
        assert 10.0 <= world.path_length() < 20.0
        assert world.arena.name == f"barn-7-{number}"
        again = barn_world(number, 7, world.attempt)
        assert (again.filled == world.filled).all()
        assert (again.first, again.last, again.attempt) == (world.first, world.last, world.attempt)
    assert (barn_world(0, 7).filled != barn_world(0, 8).filled).any()


def test_worlds_are_as_full_as_the_published_ones() -> None:
    # Of each quarter, by the chance of a pillar, the cells that the twenty published worlds at hand fill: 93 to 155, and
    # 149 to 259 (without those amid eight others, which are not written).
    cells = [[len(barn_world(number, 7).arena.circles) for number in range(fill, 36, 4)] for fill in range(4)]
    assert [np.median(some) for some in cells] == sorted(np.median(some) for some in cells)
    assert 80 <= np.median(cells[0]) <= 130
    assert 120 <= np.median(cells[1]) <= 170
    assert 150 <= np.median(cells[2]) <= 220
    assert 200 <= np.median(cells[3]) <= 320


def test_the_challenges_path_turns_little_and_keeps_off_what_has_no_room() -> None:
    free = np.ones((SIDE, SIDE), dtype=bool)
    assert challenge_path(free, (4, 0), (4, 29)) == [(4, column) for column in range(30)]
    free[:28, 10] = False
    way = challenge_path(free, (4, 0), (4, 29))
    assert {cell for cell in way if cell[1] == 10} <= {(28, 10), (29, 10)}
    steps = np.diff(way, axis=0)
    assert (np.abs(steps).max(axis=1) == 1).all()
    turns = np.abs((np.diff(np.arctan2(*steps.T)) + np.pi) % (2 * np.pi) - np.pi)
    assert turns.max() <= np.pi / 4 + 1e-9
    free[:, 10] = False
    assert challenge_path(free, (4, 0), (4, 29)) == []


def test_the_path_of_a_published_world_is_as_long_as_published() -> None:
    # World 60 of the benchmark: its path over the cells is published as 4.91 m long, the shortest one is 4.54.
    published = load_suite("barn-20")
    (index,) = (index for index, arena in enumerate(published.arenas) if arena.name == "world_60")
    across, along = np.round((published.arenas[index].circles[:, :2] - [-2.175, -1.925]) / 0.15).astype(int).T
    filled = np.zeros((SIDE, SIDE), dtype=bool)
    inside = (along >= 0) & (along < SIDE) & (across >= 0) & (across < SIDE)
    filled[across[inside], along[inside]] = True
    reach = np.arange(-2, 3)
    rows, columns = np.nonzero(filled)
    free = np.ones_like(filled)
    for i in reach:
        for j in reach:
            near = (rows + i >= 0) & (rows + i < SIDE) & (columns + j >= 0) & (columns + j < SIDE)
            free[rows[near] + i, columns[near] + j] = False
    way = np.array(challenge_path(free, (10, 0), (7, 29)))
    assert 0.15 * np.hypot(*np.diff(way, axis=0).T).sum() == pytest.approx(4.91, abs=0.01)


@pytest.mark.parametrize("difficulty", [0.0, 1.0])
def test_every_world_to_train_in_has_a_way(difficulty: float) -> None:
    sizes = []
    for seed in range(40):
        arena = training_world(difficulty, seed)
        assert np.array_equal(arena.circles, training_world(difficulty, seed).circles)
        labels, _ = components(free_mask(arena, 0.3))
        assert np.intersect1d(labels[10][labels[10] >= 0], labels[-10][labels[-10] >= 0]).size
        sizes.append(len(arena.circles))
    assert not np.array_equal(training_world(difficulty, 0).circles, training_world(difficulty, 1).circles)
    assert (max(sizes) > 200) == (difficulty == 1.0)


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
        with pytest.raises(SuiteError, match="is for the robot"):
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

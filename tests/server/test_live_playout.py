"""Frames come unevenly and are shown evenly; what is late is dropped."""

import dataclasses

import numpy as np
import pytest
from numpy.typing import NDArray

from server.live.playout import PlayoutBuffer
from server.live.scoreboard import Scoreboard
from workers.frames import Frame, ViewMode
from workers.scene.trails import Trails, trail_colours


def frame(number: int, robots: int = 1, mode: ViewMode = "policy") -> Frame:
    return Frame(
        mode=mode,
        step=number,
        sim_time=number / 30,
        speed=1.0,
        poses=np.zeros((robots, 3), np.float32),
        targets=np.zeros((robots, 2), np.float32),
        ranges=np.ones((robots, 4), np.float32),
        fields_of_view=np.full(robots, 180.0, np.float32),
        rewards=np.zeros(robots, np.float32),
        outcomes=np.zeros(robots, np.uint8),
    )


def shown(buffer: PlayoutBuffer) -> int | None:
    taken = buffer.take()
    return None if taken is None else taken.step


def test_playing_starts_with_a_small_reserve() -> None:
    buffer = PlayoutBuffer()
    ticks = []
    for number in range(5):
        buffer.put(frame(number))
        ticks.append(shown(buffer))
    assert ticks == [None, None, 0, 1, 2]


def test_a_gap_shorter_than_the_reserve_does_not_show() -> None:
    buffer = PlayoutBuffer()
    for number in range(3):
        buffer.put(frame(number))
    assert [shown(buffer) for _ in range(3)] == [0, 1, 2]


def test_after_a_longer_gap_the_reserve_is_filled_again() -> None:
    buffer = PlayoutBuffer()
    for number in range(3):
        buffer.put(frame(number))
    assert [shown(buffer) for _ in range(4)] == [0, 1, 2, None]
    buffer.put(frame(3))
    assert shown(buffer) is None
    buffer.put(frame(4))
    buffer.put(frame(5))
    assert shown(buffer) == 3


def test_a_flood_leaves_only_the_newest() -> None:
    buffer = PlayoutBuffer()
    for number in range(100):
        buffer.put(frame(number))
    assert len(buffer) <= 9
    assert (shown(buffer) or 0) >= 90


def test_frames_of_another_mode_or_number_of_robots_displace_those_before() -> None:
    buffer = PlayoutBuffer()
    for number in range(3):
        buffer.put(frame(number))
    for number in range(10, 13):
        buffer.put(frame(number, robots=2))
    assert shown(buffer) == 10
    for number in range(20, 23):
        buffer.put(frame(number, robots=2, mode="training"))
    assert shown(buffer) == 20


def test_attempts_are_counted_when_the_target_changes() -> None:
    board = Scoreboard()
    first = dataclasses.replace(frame(0, robots=3), targets=np.array([[1, 1], [2, 2], [3, 3]], np.float32))
    board.update(first)
    # Robot 0 arrives and robot 2 collides; robot 1 still drives, its outcome is of an attempt before.
    second = dataclasses.replace(
        first,
        targets=np.array([[4, 4], [2, 2], [5, 5]], np.float32),
        outcomes=np.array([1, 3, 2], np.uint8),
        rewards=np.array([0.25, -3.0, 0.0], np.float32),
    )
    board.update(second)
    board.update(second)
    score = board.score("live", follow=None)
    assert (score.arrivals, score.collisions, score.timeouts) == (1, 1, 0)
    assert [(robot.reward, robot.outcome) for robot in score.robots] == [(0.2, 1), (-3.0, 3), (0.0, 2)]
    assert [robot.index for robot in board.score("live", follow=1).robots] == [1]


def test_nothing_has_ended_between_two_clips() -> None:
    board = Scoreboard()
    board.update(frame(0))
    # Other targets, and outcomes of attempts that nobody saw: the clip begins a minute later, or in another arena.
    later = dataclasses.replace(frame(1), targets=np.ones((1, 2), np.float32), outcomes=np.ones(1, np.uint8), sim_time=60.0)
    board.update(later)
    board.update(dataclasses.replace(frame(2), sim_time=60.1, outcomes=np.ones(1, np.uint8), arena=1))
    assert board.score("live", None).arrivals == 0


def test_counts_start_anew_with_another_mode() -> None:
    board = Scoreboard()
    board.update(frame(0))
    board.update(dataclasses.replace(frame(1), targets=np.ones((1, 2), np.float32), outcomes=np.ones(1, np.uint8)))
    assert board.score("live", None).arrivals == 1
    board.update(frame(2, mode="training"))
    assert board.score("live", None).arrivals == 0


def test_a_crowd_is_not_listed_one_by_one() -> None:
    board = Scoreboard()
    board.update(frame(0, robots=9))
    assert board.score("live", None).robots == []
    assert [robot.index for robot in board.score("live", 8).robots] == [8]
    assert board.score("live", 40).robots == []


def all_segments(trails: Trails) -> NDArray[np.float32]:
    """Of a single robot, the newest first."""
    return np.concatenate([trails.newest(), trails.older()])


def test_a_trail_grows_at_its_robots_end_until_a_point_is_kept() -> None:
    trails = Trails(np.zeros((1, 3), np.float32), points=4, max_speed=0.25)
    # A point is kept four times in a simulated second.
    changes = [trails.update(np.array([[0.01 * tick, 0.0, 0.0]], np.float32), 0.1 * tick) for tick in range(7)]
    assert changes == [True, False, False, True, False, False, True]


def test_a_trail_follows_its_robot_and_ends_where_it_is_put_elsewhere() -> None:
    trails = Trails(np.zeros((1, 3), np.float32), points=4, max_speed=0.25)
    for tick in range(10):
        trails.update(np.array([[0.05 * tick, 0.0, 0.0]], np.float32), tick * 0.2)
    segments = all_segments(trails)
    assert segments.shape == (4, 2, 3)
    # The newest end is the robot, and each segment goes on where the one before ended.
    assert segments[0, 0, 0] == pytest.approx(0.45)
    np.testing.assert_array_equal(segments[:-1, 1], segments[1:, 0])
    assert (np.diff(segments[:, 0, 0]) < 0).all()

    trails.update(np.array([[3.0, 3.0, 0.0]], np.float32), 2.0)
    np.testing.assert_allclose(all_segments(trails)[..., :2], 3.0)


def test_a_trail_starts_anew_with_another_clip() -> None:
    trails = Trails(np.zeros((1, 3), np.float32), points=4, max_speed=0.25)
    for tick in range(5):
        trails.update(np.array([[0.05 * tick, 0.0, 0.0]], np.float32), tick * 0.2)
    trails.update(np.array([[0.3, 0.0, 0.0]], np.float32), 60.0, anew=True)
    np.testing.assert_allclose(all_segments(trails)[..., 0], 0.3, rtol=1e-6)


def test_trails_fade_into_the_floor() -> None:
    colours = trail_colours(np.array([[200.0, 0.0, 0.0]]), np.array([10.0, 20.0, 30.0]), points=3)
    assert colours.shape == (3, 2, 3)
    np.testing.assert_allclose(colours[-1, 1], [10.0, 20.0, 30.0])
    assert (np.diff(colours[:, 0, 0]) < 0).all()

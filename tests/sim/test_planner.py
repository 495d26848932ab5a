"""Shortest paths against closed forms, and what every path promises."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.arenas import Arena, free_distance
from sim.arenas.builtin import complex_arena, simple_arena
from sim.arenas.planner import Path, Planner, shortest_path
from sim.errors import PlacementError

# The documented accuracy, and what a path may come closer than its clearance, metres.
ACCURACY = 1.01
TOLERANCE = 1e-6


def samples(path: Path) -> np.ndarray:
    """Points every centimetre or closer along a path."""
    pieces = [
        np.linspace(a, b, 2 + int(np.hypot(*(b - a)) / 0.01)) for a, b in zip(path.points, path.points[1:], strict=False)
    ]
    return np.concatenate(pieces)


def test_in_an_empty_arena_the_path_is_the_straight_line() -> None:
    path = shortest_path(simple_arena(), (-3.0, -4.0), (3.0, 4.0), 0.25)
    assert path.points.tolist() == [[-3.0, -4.0], [3.0, 4.0]]
    assert path.length == 10.0


@pytest.mark.parametrize(("radius", "clearance", "distance"), [(0.5, 0.25, 3.0), (1.0, 0.2, 2.0), (2.0, 0.2, 4.0)])
def test_round_a_pillar_it_is_two_tangents_and_an_arc(radius: float, clearance: float, distance: float) -> None:
    arena = Arena("pillar", circles=np.array([[0.0, 0.0, radius]]))
    reach = radius + clearance
    exact = 2.0 * math.sqrt(distance**2 - reach**2) + reach * (math.pi - 2.0 * math.acos(reach / distance))
    length = shortest_path(arena, (-distance, 0.0), (distance, 0.0), clearance).length
    assert exact - TOLERANCE <= length <= exact * ACCURACY


def test_round_a_corner_it_is_two_tangents_and_an_arc() -> None:
    # A box that fills the lower left, its corner at (0.5, 0.5), turned by nothing; and the same world turned by 30 degrees.
    clearance, corner, start, target = 0.25, np.array([0.5, 0.5]), np.array([-2.0, 1.0]), np.array([1.0, -2.0])
    legs = [np.hypot(*(point - corner)) for point in (start, target)]
    turn = 2.0 * math.pi - math.acos((start - corner) @ (target - corner) / (legs[0] * legs[1]))
    arc = turn - sum(math.acos(clearance / leg) for leg in legs)
    exact = sum(math.sqrt(leg**2 - clearance**2) for leg in legs) + clearance * arc
    for angle in (0.0, math.pi / 6.0):
        rotation = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
        arena = Arena("corner", 8.0, 8.0, boxes=np.array([[*(rotation @ (-1.0, -1.0)), 1.5, 1.5, angle]]))
        length = shortest_path(arena, rotation @ start, rotation @ target, clearance).length
        assert exact - TOLERANCE <= length <= exact * ACCURACY


def test_it_takes_a_gap_that_is_wide_enough_and_else_the_long_way() -> None:
    def through(gap: float) -> float:
        halves = [[0.0, side * (0.5 * gap + 1.5), 0.05, 1.5, 0.0] for side in (-1.0, 1.0)]
        return shortest_path(Arena("gate", boxes=np.array(halves)), (-2.0, 0.0), (2.0, 0.0), 0.25).length

    assert through(0.65) == pytest.approx(4.0)
    assert through(0.45) > 6.0


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32))
def test_every_path_is_clear_joins_its_ends_and_is_no_shorter_than_the_straight_line(seed: int) -> None:
    random = np.random.default_rng(seed)
    planner = Planner(complex_arena(), 0.25)
    points = random.uniform(-4.7, 4.7, (50, 2))
    start, target = points[free_distance(planner.arena, points) > 0.3][:2]
    path = planner.shortest_path(start, target)
    assert (path.points[0] == start).all()
    assert (path.points[-1] == target).all()
    assert free_distance(planner.arena, samples(path)).min() >= 0.25 - TOLERANCE
    assert path.length >= np.hypot(*(target - start)) - TOLERANCE
    assert path.length == pytest.approx(planner.shortest_path(target, start).length, rel=0.02)


def test_a_start_that_is_closer_than_the_clearance_is_joined_to_the_free_space() -> None:
    arena = Arena("pillar", circles=np.array([[0.0, 0.0, 0.5]]))
    path = shortest_path(arena, (-0.65, 0.0), (2.0, 0.0), 0.25)
    assert path.points[0].tolist() == [-0.65, 0.0]
    assert free_distance(arena, samples(path)).min() >= 0.15 - TOLERANCE


@pytest.mark.parametrize(
    ("start", "target", "reason"),
    [
        ((0.0, 0.0), (3.0, 0.0), "free space"),  # inside the pillar
        ((3.0, 0.0), (7.0, 0.0), "free space"),  # beyond the wall
        ((-4.0, 0.0), (4.0, 4.0), "no path"),  # behind a wall without a gap
    ],
)
def test_what_cannot_be_reached_is_said(start: tuple[float, float], target: tuple[float, float], reason: str) -> None:
    arena = Arena("split", circles=np.array([[0.0, 0.0, 1.0]]), boxes=np.array([[-2.0, 0.0, 0.1, 5.0, 0.0]]))
    with pytest.raises(PlacementError, match=reason):
        shortest_path(arena, start, target, 0.25)

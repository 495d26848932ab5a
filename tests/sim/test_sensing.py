"""The compiled LiDAR and clearance against Chipmunk's own queries, over random scenes of every shape."""

import math

import numpy as np
import pymunk
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray

from sim.arenas import Arena, free_distance
from sim.config import LidarConfig
from sim.engine.physics import add_arena
from sim.lidar import drawn_ray_angles, ray_angles
from sim.scan import clearances, scan
from tests.sim.scenes import arenas

TOLERANCE = 1e-4
GRAZE = 5e-6  # a float32's rounding at 6 m is 5e-7, in the heading 2e-7


def chipmunk_scan(
    arena: Arena, poses: NDArray[np.float64], lidar: LidarConfig, fields_of_view: ArrayLike = ()
) -> NDArray[np.float64]:
    fields = np.broadcast_to(np.asarray(fields_of_view) if np.size(fields_of_view) else lidar.field_of_view, len(poses))
    space = pymunk.Space()
    add_arena(space, arena, 0.0, 0.0)
    ranges = np.full((len(poses), lidar.rays), lidar.range)
    for i, ((x, y, heading), angles) in enumerate(zip(poses, drawn_ray_angles(lidar, fields), strict=True)):
        for k, angle in enumerate(heading + angles):
            end = (x + lidar.range * math.cos(angle), y + lidar.range * math.sin(angle))
            hit = space.segment_query_first((x, y), end, 0.0, pymunk.ShapeFilter())
            if hit is not None:
                ranges[i, k] = hit.alpha * lidar.range
    return ranges


def random_poses(arena: Arena, seed: int, count: int) -> NDArray[np.float64]:
    """Anywhere within the walls: in the open, in corners, touching obstacles, along the axes."""
    rng = np.random.default_rng(seed)
    half = np.array([arena.half_width, arena.half_height]) - 1e-3
    position = rng.uniform(-1.0, 1.0, (count, 2)) * half
    hugging = rng.random((count, 2)) < 0.2
    position = np.where(hugging, np.sign(position) * half * rng.uniform(0.95, 1.0, (count, 2)), position)
    heading = np.where(rng.random(count) < 0.3, rng.integers(-2, 3, count) * np.pi / 2, rng.uniform(-np.pi, np.pi, count))
    return np.column_stack([position, heading])


def grazing(
    arena: Arena, poses: NDArray[np.float64], lidar: LidarConfig, fields_of_view: ArrayLike = ()
) -> NDArray[np.bool_]:
    """Rays whose true length jumps when the pose moves by rounding: no answer is right for them."""
    shifts = np.vstack([np.eye(3), -np.eye(3)]) * GRAZE
    lengths = [chipmunk_scan(arena, poses + shift, lidar, fields_of_view) for shift in shifts]
    jumps: NDArray[np.bool_] = np.ptp(lengths, axis=0) > TOLERANCE / 2
    return jumps


@settings(max_examples=60, deadline=None)
@given(arenas, st.integers(0, 2**32 - 1), st.sampled_from([(30, 180.0), (30, 360.0), (7, 90.0), (64, 270.0)]))
def test_rays_are_those_of_chipmunk(arena: Arena, seed: int, scanner: tuple[int, float]) -> None:
    lidar = LidarConfig(rays=scanner[0], field_of_view=scanner[1], range=3.5)
    poses = random_poses(arena, seed, 12)
    outside = free_distance(arena, poses[:, :2]) > TOLERANCE
    poses = poses[outside].astype(np.float32).astype(np.float64)
    difference = np.abs(scan(arena, poses, lidar) - chipmunk_scan(arena, poses, lidar))
    suspects = difference > TOLERANCE
    if suspects.any():
        assert not (suspects & ~grazing(arena, poses, lidar)).any()


@settings(max_examples=60, deadline=None)
@given(arenas, st.integers(0, 2**32 - 1))
def test_clearance_is_that_of_chipmunk_and_of_the_geometry(arena: Arena, seed: int) -> None:
    space = pymunk.Space()
    add_arena(space, arena, 0.0, 0.0)
    points = random_poses(arena, seed, 50)[:, :2]
    expected = []
    for point in points.tolist():
        nearest = space.point_query_nearest(point, 100.0, pymunk.ShapeFilter())
        assert nearest is not None
        expected.append(nearest.distance)
    outside = np.array(expected) > 0.0
    ours = clearances(arena, points)
    assert ours[outside] == pytest.approx(np.array(expected)[outside], abs=TOLERANCE)
    assert (ours[~outside] <= TOLERANCE).all()
    assert ours == pytest.approx(free_distance(arena, points), abs=TOLERANCE)


def test_a_scan_worked_by_hand() -> None:
    arena = Arena("hand", circles=np.array([[2.0, 0.0, 0.5]]), boxes=np.array([[0.0, 2.0, 1.0, 0.25, 0.0]]))
    lidar = LidarConfig(rays=3, field_of_view=180.0, range=3.5)
    # At the origin, looking along x: nothing within 3.5 m on the right, the circle ahead, the box on the left.
    assert scan(arena, np.array([[0.0, 0.0, 0.0]]), lidar)[0] == pytest.approx([3.5, 1.5, 1.75])
    # In the corner, looking at the wall x = 5: the wall y = -5 on the right.
    assert scan(arena, np.array([[4.5, -4.0, 0.0]]), lidar)[0] == pytest.approx([1.0, 0.5, 3.5])


def test_a_ray_that_starts_in_an_obstacle_reads_zero() -> None:
    arena = Arena("inside", circles=np.array([[2.0, 0.0, 0.5]]))
    lidar = LidarConfig(rays=3)
    assert scan(arena, np.array([[2.1, 0.0, 0.3]]), lidar)[0] == pytest.approx([0.0, 0.0, 0.0])


def test_a_full_circle_has_no_ray_twice() -> None:
    angles = ray_angles(LidarConfig(rays=4, field_of_view=360.0))
    assert angles == pytest.approx([-np.pi, -np.pi / 2, 0.0, np.pi / 2])
    assert ray_angles(LidarConfig(rays=3))[[0, -1]] == pytest.approx([-np.pi / 2, np.pi / 2])


def test_a_drawn_field_of_view_spreads_the_same_rays() -> None:
    angles = drawn_ray_angles(LidarConfig(rays=5), [90.0, 180.0, 200.0])
    assert np.degrees(angles) == pytest.approx(np.array([45.0, 90.0, 100.0])[:, None] * [-1.0, -0.5, 0.0, 0.5, 1.0])
    # A full circle that is a little short begins and ends short.
    assert np.degrees(drawn_ray_angles(LidarConfig(rays=4, field_of_view=360.0), [342.0]))[0] == pytest.approx(
        [-171.0, -85.5, 0.0, 85.5]
    )

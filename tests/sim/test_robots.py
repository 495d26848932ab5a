"""Robots of every shape: rectangular bodies against Chipmunk, defaults, old files, arenas and suites with room for them."""

import math

import numpy as np
import pymunk
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.arenas import Arena, build_arenas, build_task_arenas
from sim.arenas.cells import components, free_mask
from sim.baselines.simple import go_to_goal
from sim.config import (
    BurgerConfig,
    GeneratedArenaConfig,
    JackalConfig,
    RectangularConfig,
    RoundConfig,
    TaskConfig,
    WaffleConfig,
)
from sim.engine.footprint import rectangle_clearance
from sim.engine.physics import add_arena, robot_body
from sim.engine.plain import PlainWorld
from sim.engine.world import World
from sim.envs.render import render_robot
from sim.errors import PlacementError, SuiteError
from sim.scan import body_clearances, clearances
from sim.suites import load_suite, run_suite, suite_for
from tests.sim.scenes import arenas
from tests.sim.test_sensing import random_poses

TOLERANCE = 1e-4

bodies = st.builds(
    lambda length, width: RectangularConfig(length=length, width=width), st.floats(0.05, 1.5), st.floats(0.05, 1.5)
)


@settings(max_examples=60, deadline=None)
@given(arenas, bodies, st.integers(0, 2**32 - 1))
def test_a_rectangle_touches_what_it_touches_for_chipmunk(arena: Arena, robot: RectangularConfig, seed: int) -> None:
    space = pymunk.Space()
    add_arena(space, arena, 0.0, 0.0)
    body, shape = robot_body(robot)
    poses = random_poses(arena, seed, 40).astype(np.float32)
    ours = body_clearances(arena, poses, robot)
    for pose, clearance in zip(poses.astype(np.float64), ours.tolist(), strict=True):
        assert clearance == pytest.approx(rectangle_clearance(arena, pose, *robot.half_extents), abs=TOLERANCE)
        body.position, body.angle = (pose[0], pose[1]), pose[2]
        if abs(clearance) > TOLERANCE:
            assert bool(space.shape_query(shape)) == (clearance < 0.0)


def test_clearances_of_a_rectangle_worked_by_hand() -> None:
    arena = Arena("hand", circles=np.array([[2.0, 0.0, 0.5]]), boxes=np.array([[0.0, 2.0, 1.0, 0.25, 0.0]]))
    robot = RectangularConfig(length=1.0, width=0.4)
    poses = [
        (0.0, 0.0, 0.0),  # the circle ends 1.5 m ahead, the body 0.5
        (0.0, 0.0, math.pi / 2),  # the box begins 1.75 m to the left, the body's end is 0.5
        (0.0, 1.0, 0.0),  # 0.75 m from the box, less 0.2
        (4.0, -4.0, math.pi / 4),  # a corner at 45 degrees: (0.5 + 0.2) / sqrt(2) nearer to the wall
        (4.6, 0.0, 0.0),  # 0.1 m in the wall
        (1.2, 0.0, 0.0),  # 0.2 m in the circle
    ]
    expected = [1.0, 1.25, 0.55, 1.0 - 0.7 / math.sqrt(2.0), -0.1, -0.2]
    assert body_clearances(arena, poses, robot) == pytest.approx(np.array(expected), abs=1e-5)


@settings(max_examples=20, deadline=None)
@given(arenas, st.integers(0, 2**32 - 1))
def test_a_round_body_is_a_point_with_a_radius(arena: Arena, seed: int) -> None:
    poses = random_poses(arena, seed, 30)
    assert np.array_equal(
        body_clearances(arena, poses, RoundConfig(radius=0.3)), clearances(arena, poses[:, :2]) - np.float32(0.3)
    )


@settings(max_examples=30, deadline=None)
@given(arenas, st.integers(0, 2**32 - 1))
def test_collisions_of_a_driving_rectangle_are_those_of_chipmunk(arena: Arena, seed: int) -> None:
    robot = RectangularConfig(length=0.6, width=0.3, max_linear_speed=0.3, max_angular_speed=0.3)
    task = TaskConfig(robot=robot, collision_distance=0.0, step_limit=10)
    poses = random_poses(arena, seed, 60)
    poses = poses[body_clearances(arena, poses, robot) > TOLERANCE]
    if not len(poses):
        return
    world = World(task, (arena,), len(poses), seed=seed, respawn=False)
    assert world._parameters["path_samples"] == 1
    world.reset(poses=poses)
    world.step(np.tile(np.array([[1.0, 0.5]], dtype=np.float32), (len(poses), 1)))
    for i, pose in enumerate(poses.astype(np.float32).astype(float).tolist()):
        plain = PlainWorld(task, arena, (pose[0], pose[1], pose[2]), (0.0, 0.0))
        plain.step(1.0, 0.5)
        if abs(plain.clearance()) > TOLERANCE and world.robots.outcomes[i] != 1:
            touching = bool(plain.space.shape_query(plain.shape))
            assert (world.robots.outcomes[i] == 2) == touching == (plain.clearance() < 0.0)


def test_a_corner_does_not_sweep_over_a_pole() -> None:
    # The corner at (0.254, 0.215) turns left by 0.8 rad on a circle of 0.333 m; the pole stands on that circle, half-way.
    angle = math.atan2(0.215, 0.254) + 0.4
    pole = 0.33 * np.array([math.cos(angle), math.sin(angle)])
    arena = Arena("pole", circles=np.array([[*pole, 0.01]]))
    task = TaskConfig(robot=JackalConfig(), collision_distance=0.0)
    world = World(task, (arena,), 1, seed=0)
    world.reset(poses=(0.0, 0.0, 0.0), targets=(3.0, 0.0))
    world.step(np.array([[0.0, 1.0]], dtype=np.float32))
    assert world.robots.outcomes[0] == 2


def test_a_pose_is_refused_by_the_body_that_does_not_fit() -> None:
    arena, task = Arena("hall"), TaskConfig(robot=JackalConfig())
    world = World(task, (arena,), 1, seed=0)
    world.reset(poses=(0.0, 4.75, 0.0))  # 0.25 m from the wall, half as wide as 0.43
    with pytest.raises(PlacementError, match="touches"):
        world.reset(poses=(0.0, 4.75, math.pi / 2))


def test_a_picture_shows_the_body_as_it_is() -> None:
    world = World(TaskConfig(robot=RectangularConfig(length=1.0, width=0.4)), (Arena("hall"),), 1, seed=0)
    world.reset(poses=(0.0, 0.0, math.pi / 2), targets=(3.0, 3.0))
    picture = render_robot(world, 0).astype(int)
    rows, columns = np.nonzero((picture[..., 2] > 180) & (picture[..., 0] < 90))
    metre = 480 / 10.5
    assert [np.ptp(rows), np.ptp(columns)] == pytest.approx([metre, 0.4 * metre], abs=2.0)


def test_robots_drive_with_the_limits_of_their_data_sheets() -> None:
    limits = {
        robot.name: (robot.circumscribed_radius, robot.max_linear_speed, robot.max_angular_speed)
        for robot in (BurgerConfig(), WaffleConfig(), JackalConfig())
    }
    assert limits == {
        "burger": (0.105, 0.25, 1.0),
        "waffle": (pytest.approx(0.2077, abs=1e-4), 0.26, 1.82),
        "jackal": (pytest.approx(0.3328, abs=1e-4), 2.0, 4.0),
    }
    assert TaskConfig().robot == BurgerConfig()


def test_a_file_from_before_there_were_other_robots_is_a_burger() -> None:
    old = {"radius": 0.12, "max_linear_speed": 0.25, "max_angular_speed": 1.0, "max_linear_acceleration": 0.0}
    assert TaskConfig.model_validate({"robot": old}).robot == BurgerConfig(radius=0.12)
    assert TaskConfig.model_validate({"robot": {}}) == TaskConfig()
    with pytest.raises(ValueError, match="length"):
        TaskConfig.model_validate({"robot": {"name": "burger", "length": 1.0}})


def test_generated_arenas_have_room_for_the_robot_and_the_usual_ones_stay_as_they_were() -> None:
    config = GeneratedArenaConfig(name="maze", difficulty=0.8, maps=3)
    usual = build_task_arenas(TaskConfig(arena=config))
    assert all(np.array_equal(a.boxes, b.boxes) for a, b in zip(usual, build_arenas(config), strict=True))
    jackal = TaskConfig(arena=config, robot=JackalConfig())
    for arena in build_task_arenas(jackal):
        _, sizes = components(free_mask(arena, jackal.passable_clearance))
        assert sizes[0] >= 0.98 * sizes.sum()
    World(jackal, build_task_arenas(jackal), 4, seed=0).reset()


def test_a_large_robot_is_measured_on_scenarios_with_room_for_it() -> None:
    jackal = TaskConfig(robot=JackalConfig())
    suite = suite_for(jackal)
    assert suite.name == "simple-0.33m-200"
    table = run_suite(go_to_goal(jackal), jackal, suite)
    assert (table.outcomes == 1).mean() > 0.9
    # One that fits into the default robot's room is measured where that one is.
    assert suite_for(TaskConfig(robot=RoundConfig(radius=0.19))) is load_suite("simple-200")
    generated = TaskConfig(arena=GeneratedArenaConfig(name="rooms", difficulty=0.3), robot=JackalConfig())
    assert suite_for(generated).name == "rooms-0.3-0.33m-200"
    bus = TaskConfig(robot=RectangularConfig(length=1.5, width=0.9))
    with pytest.raises(SuiteError, match="no room for this robot"):
        run_suite(go_to_goal(bus), bus, load_suite("complex-200"))

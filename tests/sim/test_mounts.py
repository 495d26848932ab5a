"""LiDARs anywhere on the body, turned, or two of them: scans worked by hand, against Chipmunk, and what is a collision."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from sim.arenas import Arena
from sim.baselines.simple import bearing_reader
from sim.config import (
    LidarConfig,
    ObservationConfig,
    RandomisationConfig,
    RectangularConfig,
    RewardConfig,
    TaskConfig,
)
from sim.engine.plain import PlainWorld
from sim.engine.world import World
from sim.envs.render import render_robot
from sim.errors import ArenaError
from sim.lidar import ray_origins
from sim.observations import observation_layout
from sim.scan import scan
from tests.sim.scenes import arenas
from tests.sim.test_agreement import OUTCOMES, assert_observations_equal

FRONT = {"name": "single", "x": 0.2}
TURNED = {"name": "single", "x": -0.1, "y": 0.15, "yaw": 50.0}
TWO = {"name": "double", "x": 0.2, "y": -0.1, "yaw": -45.0, "second_x": -0.2, "second_y": 0.1, "second_yaw": 135.0}
MOUNTS = (FRONT, TURNED, TWO)


def task_with(mount: dict[str, Any], **changes: Any) -> TaskConfig:
    lidar = LidarConfig.model_validate({"rays": 12, "mount": mount})
    observation = ObservationConfig.preset("improved", batches=4)
    return TaskConfig(lidar=lidar, observation=observation, robot=RectangularConfig(length=0.5, width=0.4), **changes)


def test_files_from_before_there_were_mounts_have_one_in_the_middle() -> None:
    assert LidarConfig.model_validate({"rays": 30}).mount.places == ((0.0, 0.0, 0.0),)


def test_a_scan_worked_by_hand() -> None:
    # A wall 5 m off each way. At (1, 0) heading along y, a LiDAR 0.2 m ahead and 0.1 m to the left, turned to the left by 90
    # degrees, stands at (0.9, 0.2) and looks along -x, its first ray along y and its last along -y.
    lidar = LidarConfig.model_validate(
        {"rays": 3, "range": 10.0, "mount": {"name": "single", "x": 0.2, "y": 0.1, "yaw": 90.0}}
    )
    pose = [(1.0, 0.0, math.pi / 2)]
    assert ray_origins(lidar, pose)[0, 0] == pytest.approx([0.9, 0.2])
    assert scan(Arena("hall"), pose, lidar)[0] == pytest.approx([4.8, 5.9, 5.2], abs=1e-4)


def test_two_lidars_give_their_scans_one_after_the_other() -> None:
    task = task_with(TWO)
    poses = np.array([[0.5, -1.0, 0.3], [2.0, 2.0, -2.0]])
    both = scan(Arena("hall", circles=np.array([[1.5, 0.0, 0.4]])), poses, task.lidar)
    for first, prefix in ((0, ""), (12, "second_")):
        place = {name: TWO[prefix + name] for name in ("x", "y", "yaw")}
        alone = LidarConfig.model_validate({"rays": 12, "mount": {"name": "single", **place}})
        own = scan(Arena("hall", circles=np.array([[1.5, 0.0, 0.4]])), poses, alone)
        np.testing.assert_array_equal(both[:, first : first + 12], own)
    assert observation_layout(task).size == 8 + 6


@settings(max_examples=25, deadline=None)
@given(arenas, st.sampled_from(MOUNTS), st.integers(0, 2**32 - 1), st.sampled_from([(), (150.0, 240.0)]))
def test_the_compiled_world_agrees_with_the_plain_one(
    arena: Arena, mount: dict[str, Any], seed: int, fields_of_view: tuple[float, ...]
) -> None:
    rng = np.random.default_rng(seed)
    task = task_with(
        mount,
        reward=RewardConfig.preset("clearance"),
        randomisation=RandomisationConfig(field_of_view=fields_of_view),
        collision_distance=float(rng.choice([0.0, 0.4])),
    )
    try:
        world = World(task, (arena,), 1, seed=seed)
    except ArenaError:
        assume(False)
    world.reset()
    pose, target = world.robots.poses[0].astype(float), world.robots.targets[0].astype(float)
    plain = PlainWorld(task, arena, (pose[0], pose[1], pose[2]), (target[0], target[1]), world.fields_of_view[0])
    for linear, angular in np.repeat(rng.uniform([0.3, -1.0], 1.0, (6, 2)), 3, axis=0).astype(np.float32).tolist():
        expected = plain.step(linear, angular)
        world.step(np.array([[linear, angular]], dtype=np.float32))
        robots = world.robots
        ranges = plain.scan()
        margins = (
            plain.distance - task.arrival_distance,
            plain.clearance(),
            plain.nearest_to_middle(ranges) - task.collision_distance,
        )
        if min(map(abs, margins)) < 1e-3:
            return  # within rounding of an arrival or a contact, either answer is right
        assert OUTCOMES[robots.outcomes[0]] == expected.outcome
        if expected.outcome != "none":
            return
        assert np.count_nonzero(np.abs(robots.ranges[0] - ranges) > 1e-3) <= 1
        if abs(abs(plain.bearing()) - math.pi) > 1e-4:
            assert_observations_equal(robots.observations[0], expected.observation, task)


@pytest.mark.parametrize(("collision_distance", "outcome"), [(0.35, 0), (0.45, 2)])
def test_a_collision_is_what_a_ray_meets_near_the_middle_of_the_body(collision_distance: float, outcome: int) -> None:
    # A LiDAR on the front edge reads 0.15 m to a wall that is 0.4 m from the middle of the body.
    arena = Arena("hall", half_width=5.0, half_height=5.0)
    task = TaskConfig(
        observation=ObservationConfig.preset("improved", batches=31),
        lidar=LidarConfig.model_validate({"rays": 31, "mount": {"name": "single", "x": 0.25}}),
        robot=RectangularConfig(length=0.5, width=0.4),
        collision_distance=collision_distance,
    )
    world = World(task, (arena,), 1, seed=0, restart="reset")
    world.reset(poses=(4.6, 0.0, 0.0), targets=(0.0, 0.0))
    world.step(np.zeros((1, 2), dtype=np.float32))
    assert world.robots.ranges[0].min() == pytest.approx(0.15, abs=1e-4)
    assert world.robots.outcomes[0] == outcome


def test_go_to_goal_reads_the_bearing_behind_both_scans() -> None:
    task = task_with(TWO)
    world = World(task, (Arena("hall"),), 1, seed=0)
    world.reset(poses=(0.0, 0.0, 0.3), targets=(2.0, 2.0))
    assert bearing_reader(task)(world.robots.observations)[0] == pytest.approx(math.pi / 4 - 0.3, abs=1e-5)


def test_a_lidar_stands_on_the_body() -> None:
    with pytest.raises(ValidationError, match="not on the robot's body"):
        TaskConfig(lidar=LidarConfig.model_validate({"mount": {"name": "single", "x": 0.2}}))
    with pytest.raises(ValidationError, match="not on the robot's body"):
        task_with({"name": "single", "x": 0.2, "y": 0.21})


def test_a_world_with_two_lidars_goes_on_from_its_state() -> None:
    changes = {"randomisation": RandomisationConfig(field_of_view=(150.0, 200.0), rate=(1.0, 3.0))}
    first, second = (World(task_with(TWO, **changes), (Arena("hall"),), 3, seed=seed) for seed in (1, 2))
    for world in (first, second):
        world.reset()
    action = np.full((3, 2), 0.5, dtype=np.float32)
    first.step(action)
    second.set_state(first.get_state())
    for world in (first, second):
        world.step(action)
    np.testing.assert_array_equal(first.robots.ranges, second.robots.ranges)
    np.testing.assert_array_equal(first.robots.observations, second.robots.observations)
    assert render_robot(first, 0).shape[2] == 3

"""The navigator drives as the policy says while all is well, and stands still in every other case."""

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from sim.config import (
    AckermannDrive,
    AnyDrive,
    ArenaConfig,
    BearingPart,
    BurgerConfig,
    DifferentialDrive,
    DoubleMount,
    DwellPart,
    JackalConfig,
    KnownPart,
    LidarConfig,
    ObservationConfig,
    OmnidirectionalDrive,
    OpeningsPart,
    RangesPart,
    SingleMount,
    TaskConfig,
    TrailPart,
)
from sim.envs.vector import NavigationVectorEnv
from workers.export.bundle import export_checkpoint
from workers.export.ros2.mapless_navigator.navigator import Navigator, Safety, State
from workers.export.ros2.mapless_navigator.observation import Scan, ray_angles
from workers.export.ros2.mapless_navigator.policy import Policy, read_safetensors

TRAIL = ObservationConfig(parts=(RangesPart(), BearingPart(), TrailPart(), KnownPart(), OpeningsPart(), DwellPart()))


@pytest.fixture
def policy(make_checkpoint: Callable[..., Path]) -> Policy:
    exported = export_checkpoint(make_checkpoint())
    return Policy(exported.specification, read_safetensors(exported.weights))


@pytest.fixture
def navigator(policy: Policy) -> Navigator:
    """At the origin, heading along x, nothing near, a goal 2 m away; all of it measured at time 10."""
    navigator = Navigator(policy, Safety.of(policy.specification))
    navigator.set_scan(10.0, scan(3.0))
    navigator.set_odometry(10.0, 0.0, 0.0, 0.0)
    navigator.set_goal(2.0, 0.5)
    return navigator


def scan(everywhere: float, **beams: float) -> Scan:
    """A full circle of 360 beams, beam k at k degrees to the left; `beams` are those that differ, as 'at_<degrees>'."""
    ranges = np.full(360, everywhere)
    for name, value in beams.items():
        ranges[int(name.removeprefix("at_"))] = value
    return Scan(0.0, math.radians(1.0), 0.05, 3.5, ranges)


def test_it_drives_when_all_is_well(navigator: Navigator) -> None:
    command = navigator.command(10.1)
    assert command.state is State.DRIVING
    assert 0.0 < command.linear <= 0.25
    assert abs(command.angular) <= 1.0


def test_two_lidars_make_the_scan_that_the_simulator_makes(make_checkpoint: Callable[..., Path]) -> None:
    mount = DoubleMount(x=0.2, y=-0.15, yaw=-45.0, second_x=-0.2, second_y=0.15, second_yaw=135.0)
    task = TaskConfig(
        arena=ArenaConfig(name="complex"),
        robot=JackalConfig(),
        lidar=LidarConfig(rays=45, field_of_view=270.0, mount=mount),
        observation=ObservationConfig.preset("improved", batches=9),
    )
    exported = export_checkpoint(make_checkpoint(task=task))
    policy = Policy(exported.specification, read_safetensors(exported.weights))
    env = NavigationVectorEnv(task, 1, seed=3)
    observations, _ = env.reset(seed=3)
    safety = replace(Safety.of(policy.specification), stop_distance=0.0, body_distance=0.0, goal_tolerance=0.0)
    assert (safety.sensor_yaw, safety.second_sensor_yaw) == pytest.approx((-math.pi / 4, 0.75 * math.pi))
    navigator = Navigator(policy, safety)
    angles = ray_angles(policy.specification)
    navigator.set_odometry(0.0, *env.poses[0].astype(np.float64))
    navigator.set_goal(*env.targets[0].astype(np.float64))
    for lidar, ranges in enumerate(env.ranges[0].astype(np.float64).reshape(2, -1)):
        assert navigator.command(0.0).state is State.NO_SCAN
        navigator.set_scan(0.0, Scan(angles[0], angles[1] - angles[0], 0.0, 3.5, ranges), lidar)
    command = navigator.command(0.0)
    np.testing.assert_allclose((command.linear, command.angular), policy.velocities(observations)[0], rtol=0, atol=1e-5)


@pytest.mark.parametrize(("distance", "state"), [(0.25, State.TOO_NEAR), (0.35, State.DRIVING)])
def test_what_is_too_near_is_measured_from_the_middle_of_the_body(
    make_checkpoint: Callable[..., Path], distance: float, state: State
) -> None:
    # A LiDAR 0.08 m behind the middle of a Burger: what it sees at 0.33 m straight ahead is 0.25 m from the middle.
    lidar = LidarConfig(mount=SingleMount(x=-0.08))
    exported = export_checkpoint(make_checkpoint(task=TaskConfig(lidar=lidar, collision_distance=0.3)))
    policy = Policy(exported.specification, read_safetensors(exported.weights))
    navigator = Navigator(policy, Safety.of(policy.specification))
    navigator.set_scan(10.0, scan(3.0, at_0=distance + 0.08))
    navigator.set_odometry(10.0, 0.0, 0.0, 0.0)
    navigator.set_goal(2.0, 0.5)
    assert navigator.command(10.0).state is state


@pytest.mark.parametrize(
    ("frames", "drive"),
    [
        (0, DifferentialDrive()),  # remembers its way
        (1, DifferentialDrive()),
        (3, DifferentialDrive()),
        (1, DifferentialDrive(reverse=0.5)),
        (1, OmnidirectionalDrive()),
        (1, AckermannDrive()),
    ],
)
def test_it_commands_what_the_policy_does_in_the_simulator(
    make_checkpoint: Callable[..., Path], frames: int, drive: AnyDrive
) -> None:
    task = TaskConfig(
        arena=ArenaConfig(name="complex"),
        observation=ObservationConfig.preset("improved", frames=frames) if frames else TRAIL,
        robot=BurgerConfig(drive=drive),
    )
    exported = export_checkpoint(make_checkpoint(task=task))
    policy = Policy(exported.specification, read_safetensors(exported.weights))
    env = NavigationVectorEnv(task, 1, seed=3)
    observations, _ = env.reset(seed=3)
    safety = replace(Safety.of(policy.specification), stop_distance=0.0, body_distance=0.0, goal_tolerance=0.0)
    navigator = Navigator(policy, safety)
    angles = ray_angles(policy.specification)
    for step in range(60):
        now = 0.2 * step
        ranges = env.ranges[0].astype(np.float64)
        navigator.set_scan(now, Scan(angles[0], angles[1] - angles[0], 0.0, 3.5, ranges))
        navigator.set_odometry(now, *env.poses[0].astype(np.float64))
        navigator.set_goal(*env.targets[0].astype(np.float64))
        command = navigator.command(now)
        commanded = policy.velocities(observations)[0]
        if isinstance(drive, AckermannDrive) and abs(command.angular) < 1.0 - 1e-6:
            assert command.steering == pytest.approx(commanded[1], abs=1e-5)
        observations, _, terminations, truncations, _ = env.step(policy.actions(observations))
        if terminations[0] or truncations[0]:
            break
        # What the robot is sent moves it as the simulator's has just been moved, but for where its middle is.
        forwards, aside, turn = env.twists()[0]
        sideways = 0.0 if isinstance(drive, AckermannDrive) else aside
        np.testing.assert_allclose(
            (command.linear, command.lateral, command.angular), (forwards, sideways, turn), rtol=0, atol=1e-5
        )
    assert step > 5


def test_it_waits_for_everything_it_needs(policy: Policy) -> None:
    navigator = Navigator(policy, Safety.of(policy.specification))
    assert navigator.command(0.0).state is State.NO_GOAL
    navigator.set_goal(1.0, 1.0)
    assert navigator.command(0.0).state is State.NO_ODOMETRY
    navigator.set_odometry(0.0, 0.0, 0.0, 0.0)
    assert navigator.command(0.0).state is State.NO_SCAN
    navigator.set_scan(0.0, scan(2.0))
    assert navigator.command(0.0).state is State.DRIVING
    navigator.cancel()
    assert navigator.command(0.0).state is State.NO_GOAL


def test_stale_scan_stops_until_a_fresh_one_comes(navigator: Navigator) -> None:
    navigator.set_odometry(10.6, 0.0, 0.0, 0.0)
    stopped = navigator.command(10.6)
    assert (stopped.linear, stopped.angular, stopped.state) == (0.0, 0.0, State.STALE_SCAN)
    navigator.set_scan(10.6, scan(3.0))
    assert navigator.command(10.6).state is State.DRIVING


def test_stale_odometry_stops(navigator: Navigator) -> None:
    navigator.set_scan(10.6, scan(3.0))
    stopped = navigator.command(10.6)
    assert (stopped.linear, stopped.angular, stopped.state) == (0.0, 0.0, State.STALE_ODOMETRY)


@pytest.mark.parametrize(
    ("degrees", "distance", "state"),
    [
        (0, 0.19, State.TOO_NEAR),
        (0, 0.21, State.DRIVING),
        (90, 0.19, State.TOO_NEAR),
        (270, -math.inf, State.TOO_NEAR),
        (180, 0.19, State.DRIVING),  # behind, in training only contact counted
        (180, 0.12, State.TOO_NEAR),
    ],
)
def test_a_single_near_beam_stops(navigator: Navigator, degrees: int, distance: float, state: State) -> None:
    navigator.set_scan(10.0, scan(3.0, **{f"at_{degrees}": distance}))
    command = navigator.command(10.1)
    assert command.state is state
    if state is State.TOO_NEAR:
        assert (command.linear, command.angular) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("degrees", "distance", "state"),
    [
        (0, 0.52, State.TOO_NEAR),  # 0.5 m from the middle to the front, and a tenth of it on top
        (0, 0.56, State.DRIVING),
        (90, 0.21, State.TOO_NEAR),
        (90, 0.23, State.DRIVING),  # half a width of 0.2 m
        (180, 0.52, State.TOO_NEAR),
        (45, 0.30, State.TOO_NEAR),  # the side, met at 45 degrees: 0.2 sqrt(2) = 0.283 m
        (45, 0.32, State.DRIVING),
    ],
)
def test_a_rectangular_body_keeps_its_outline_clear(policy: Policy, degrees: int, distance: float, state: State) -> None:
    policy.specification = replace(policy.specification, robot_radius=0.2, robot_length=1.0, robot_width=0.4)
    navigator = Navigator(policy, Safety.of(policy.specification))
    navigator.set_scan(10.0, scan(3.0, **{f"at_{degrees}": distance}))
    navigator.set_odometry(10.0, 0.0, 0.0, 0.0)
    navigator.set_goal(2.0, 0.5)
    assert navigator.command(10.1).state is state


def test_after_a_near_obstacle_it_drives_again_only_with_a_margin(navigator: Navigator) -> None:
    states = []
    for distance in (0.19, 0.22, 0.24, 0.26, 0.22):
        navigator.set_scan(10.0, scan(3.0, at_5=distance))
        states.append(navigator.command(10.0).state)
    assert states == [State.TOO_NEAR, State.TOO_NEAR, State.TOO_NEAR, State.DRIVING, State.DRIVING]


def test_a_blind_sector_stops(navigator: Navigator) -> None:
    navigator.set_scan(10.0, scan(3.0, **{f"at_{degrees}": math.nan for degrees in range(20, 50)}))
    assert navigator.command(10.0).state is State.BLIND
    # Behind, where the policy does not look, the same is no reason to stop.
    navigator.set_scan(10.0, scan(3.0, **{f"at_{degrees}": math.nan for degrees in range(150, 180)}))
    assert navigator.command(10.0).state is State.DRIVING


def test_arrival_ends_the_goal(navigator: Navigator) -> None:
    navigator.set_odometry(10.0, 1.9, 0.4, 0.3)
    assert navigator.command(10.0).state is State.ARRIVED
    navigator.set_odometry(10.0, 0.0, 0.0, 0.0)
    stopped = navigator.command(10.0)
    assert (stopped.linear, stopped.angular, stopped.state) == (0.0, 0.0, State.ARRIVED)
    navigator.set_goal(3.0, 0.0)
    assert navigator.command(10.0).state is State.DRIVING


@pytest.mark.parametrize("pose", [(math.nan, 0.0, 0.0), (0.0, 0.0, math.inf)])
def test_odometry_that_is_no_number_stops(navigator: Navigator, pose: tuple[float, float, float]) -> None:
    navigator.set_odometry(10.0, *pose)
    stopped = navigator.command(10.0)
    assert (stopped.linear, stopped.angular, stopped.state) == (0.0, 0.0, State.NOT_FINITE)


def test_lower_limits_drive_the_same_arc_slower(policy: Policy) -> None:
    fast = Safety.of(policy.specification)
    commands = []
    for safety in (fast, replace(fast, max_linear_speed=0.01), replace(fast, max_angular_speed=0.001)):
        navigator = Navigator(policy, safety)
        navigator.set_scan(0.0, scan(3.0))
        navigator.set_odometry(0.0, 0.0, 0.0, 0.0)
        navigator.set_goal(-1.0, 2.0)
        commands.append(navigator.command(0.0))
    full, slow, straight = commands
    assert slow.linear == pytest.approx(0.01)
    assert abs(straight.angular) == pytest.approx(0.001)
    for command in (slow, straight):
        assert command.angular / command.linear == pytest.approx(full.angular / full.linear, rel=1e-6)

"""Every drive: what an action is, where it leads to the last bit, and the compiled world against the plain one."""

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from gymnasium.spaces import Box
from hypothesis import assume, given, settings
from hypothesis import strategies as st

import sim.config.robot as robot_module
from sim.actions import action_layout, fastest_way, twists
from sim.arenas import Arena
from sim.baselines.dwa import dynamic_window
from sim.baselines.simple import go_to_goal, random_policy
from sim.config import (
    AckermannDrive,
    AnyDrive,
    DifferentialDrive,
    FormulaTerm,
    OdometryConfig,
    OmnidirectionalDrive,
    RacecarConfig,
    RectangularConfig,
    RewardConfig,
    RidgebackConfig,
    RoundConfig,
    SmoothnessTerm,
    SpeedTerm,
    TaskConfig,
    preset_terms,
)
from sim.engine.plain import PlainWorld, exact_arc
from sim.engine.world import World
from sim.envs.point_goal import PointGoalEnv
from sim.envs.vector import NavigationVectorEnv
from sim.errors import ArenaError
from sim.suites import load_suite, run_controller, run_suite
from tests.sim.scenes import arenas
from tests.sim.test_agreement import OUTCOMES, assert_observations_equal

DRIVES: tuple[AnyDrive, ...] = (
    DifferentialDrive(),
    DifferentialDrive(reverse=0.5),
    DifferentialDrive(reverse=1.0),
    OmnidirectionalDrive(sideways=0.6),
    OmnidirectionalDrive(reverse=0.0),
    AckermannDrive(wheel_base=0.3, steering_limit=35.0),
    AckermannDrive(reverse=0.3),
)
drives = st.sampled_from(DRIVES)


def robot_with(drive: AnyDrive, **limits: float) -> RectangularConfig:
    return RectangularConfig.model_validate({"length": 0.3, "width": 0.2, "drive": drive.model_dump(), **limits})


def hall(task: TaskConfig, robots: int = 1) -> World:
    return World(task, (Arena("hall", half_width=20.0, half_height=20.0),), robots, seed=0)


@pytest.mark.parametrize(
    ("drive", "names", "lows"),
    [
        (DifferentialDrive(), ("linear", "angular"), (0.0, -1.0)),
        (DifferentialDrive(reverse=0.25), ("linear", "angular"), (-0.25, -1.0)),
        (OmnidirectionalDrive(), ("linear", "lateral", "angular"), (-1.0, -1.0, -1.0)),
        (AckermannDrive(reverse=0.0), ("linear", "steering"), (0.0, -1.0)),
    ],
)
def test_an_action_has_a_number_for_what_the_drive_can_do(
    drive: AnyDrive, names: tuple[str, ...], lows: tuple[float, ...]
) -> None:
    task = TaskConfig(robot=robot_with(drive))
    assert action_layout(task.robot).names == names
    space = NavigationVectorEnv(task, 2).single_action_space
    assert isinstance(space, Box)
    assert space.low.tolist() == pytest.approx(lows)
    assert space.high.tolist() == [1.0] * len(names)
    env = PointGoalEnv(task, symmetric_actions=True)
    assert env.action_space.shape == (len(names),)


def test_files_from_before_there_were_drives_are_forward_only() -> None:
    task = TaskConfig.model_validate({"robot": {"name": "jackal", "max_linear_speed": 1.5}})
    assert task.robot.drive == DifferentialDrive(reverse=0.0)


def test_robots_come_with_the_drive_that_they_have() -> None:
    car, platform = RacecarConfig(), RidgebackConfig()
    assert isinstance(car.drive, AckermannDrive)
    assert math.radians(car.drive.steering_limit) == pytest.approx(0.4189, abs=1e-4)
    assert isinstance(platform.drive, OmnidirectionalDrive)


def test_motions_worked_by_hand() -> None:
    omni = robot_with(OmnidirectionalDrive(sideways=0.5), max_linear_speed=2.0, max_angular_speed=1.0)
    assert twists(omni, [[0.5, 1.0, -0.5]])[0] == pytest.approx([1.0, 1.0, -0.5])
    # tan 45 degrees = 1: at 1 m/s and 0.5 m between the axles 2 rad/s, the middle 0.25 m ahead of the rear axle.
    car = robot_with(AckermannDrive(wheel_base=0.5, steering_limit=45.0), max_linear_speed=1.0, max_angular_speed=3.0)
    expected = np.array([[1.0, 0.5, 2.0], [-1.0, -0.5, -2.0]])
    assert twists(car, [[1.0, 1.0], [-1.0, 1.0]]) == pytest.approx(expected)
    # It may turn at 1 rad/s only: it steers less, on a circle of 1 m.
    slow = car.model_copy(update={"max_angular_speed": 1.0})
    assert twists(slow, [[1.0, 1.0]])[0] == pytest.approx([1.0, 0.25, 1.0])


@pytest.mark.parametrize("steering", [0.2, 0.7, 1.0])
def test_a_rear_axle_turns_on_a_circle_of_wheel_base_over_tan_steering(steering: float) -> None:
    drive = AckermannDrive(wheel_base=0.4, steering_limit=30.0)
    world = hall(TaskConfig(robot=robot_with(drive, max_linear_speed=0.5, max_angular_speed=6.0)))
    world.reset(poses=(0.0, 0.0, 0.0), targets=(15.0, 15.0))
    radius = 0.4 / math.tan(math.radians(30.0) * float(np.float32(steering)))
    # The rear axle starts 0.2 m behind the middle, and the circle's centre abeam of it.
    centre = np.array([-0.2, radius])
    for _ in range(60):
        world.step(np.array([[1.0, steering]], dtype=np.float32))
        x, y, heading = world.get_state()["bodies"][0]
        rear = np.array([x - 0.2 * math.cos(heading), y - 0.2 * math.sin(heading)])
        assert np.hypot(*(rear - centre)) == pytest.approx(radius, abs=1e-9)
        assert np.hypot(*(np.array([x, y]) - centre)) == pytest.approx(math.hypot(radius, 0.2), abs=1e-9)
    assert heading == pytest.approx(60 * 0.2 * 0.5 / radius, abs=1e-9)


def test_an_omnidirectional_robot_drives_a_straight_diagonal_whichever_way_it_faces() -> None:
    task = TaskConfig(robot=RoundConfig(max_linear_speed=1.0, drive=OmnidirectionalDrive()))
    world = hall(task)
    world.reset(poses=(1.0, 2.0, 0.5), targets=(15.0, 15.0))
    for _ in range(25):
        world.step(np.array([[0.5, -0.5, 0.0]], dtype=np.float32))
    x, y, heading = world.get_state()["bodies"][0]
    # 5 s at sqrt(0.5) m/s, 45 degrees to the right of the heading, which stays.
    way = 5.0 * math.sqrt(0.5)
    assert (x, y, heading) == pytest.approx(
        (1.0 + way * math.cos(0.5 - math.pi / 4), 2.0 + way * math.sin(0.5 - math.pi / 4), 0.5), abs=1e-12
    )
    assert world.robots.records["path_length"][0] == pytest.approx(way)


@settings(max_examples=40, deadline=None)
@given(drives, st.integers(0, 2**32 - 1))
def test_every_drive_stays_on_the_exact_arc(drive: AnyDrive, seed: int) -> None:
    rng = np.random.default_rng(seed)
    task = TaskConfig(robot=robot_with(drive, max_linear_speed=0.4, max_angular_speed=1.5))
    world = hall(task)
    heading = float(np.float32(rng.uniform(-3.0, 3.0)))
    world.reset(poses=(0.0, 0.0, heading), targets=(15.0, 15.0))
    action = rng.uniform(action_layout(task.robot).lows, 1.0).astype(np.float32)
    for _ in range(30):
        world.step(action[None])
    forwards, aside, turn = twists(task.robot, action[None])[0].tolist()
    x, y, angle = exact_arc((0.0, 0.0, heading), forwards, turn, 30 * task.control_period, aside)
    state = world.get_state()["bodies"][0]
    assert state[:2] == pytest.approx((x, y), abs=1e-9)
    assert math.cos(state[2] - angle) == pytest.approx(1.0, abs=1e-12)
    assert world.robots.records["path_length"][0] == pytest.approx(30 * 0.2 * math.hypot(forwards, aside), rel=1e-6)
    assert math.hypot(forwards, aside) <= fastest_way(task.robot, 0.4, 1.5) + 1e-9


@settings(max_examples=30, deadline=None)
@given(arenas, drives, st.integers(0, 2**32 - 1))
def test_the_compiled_world_agrees_with_the_plain_one(arena: Arena, drive: AnyDrive, seed: int) -> None:
    rng = np.random.default_rng(seed)
    formula = FormulaTerm(formula="speed - 2 * turning_rate + last_speed * last_turning_rate")
    task = TaskConfig(
        robot=robot_with(drive),
        reward=RewardConfig(terms=(*preset_terms("basic"), SmoothnessTerm(), SpeedTerm(), formula)),
        collision_distance=0.0,
    )
    try:
        world = World(task, (arena,), 1, seed=seed)
    except ArenaError:
        assume(False)
    world.reset()
    pose, target = world.robots.poses[0].astype(float), world.robots.targets[0].astype(float)
    plain = PlainWorld(task, arena, (pose[0], pose[1], pose[2]), (target[0], target[1]))
    lows = action_layout(task.robot).lows
    for action in np.repeat(rng.uniform(lows, 1.0, (8, len(lows))), 4, axis=0).astype(np.float32):
        expected = plain.step(*action.tolist())
        world.step(action[None])
        robots = world.robots
        if min(abs(plain.distance - task.arrival_distance), abs(plain.clearance())) < 1e-4:
            return  # within rounding of an arrival or a contact, either answer is right
        assert OUTCOMES[robots.outcomes[0]] == expected.outcome
        if expected.outcome == "none":
            assert robots.poses[0, :2] == pytest.approx(tuple(plain.body.position), abs=1e-5)
            assert robots.terms[0] == pytest.approx(expected.terms, abs=1e-2)
            if abs(abs(plain.bearing()) - math.pi) > 1e-4:
                assert_observations_equal(robots.observations[0], expected.observation, task)
        if expected.outcome != "none":
            return


@pytest.mark.parametrize("drive", DRIVES)
def test_commands_are_late_and_limited_as_a_differential_drives_are(drive: AnyDrive) -> None:
    robot = robot_with(drive, max_linear_speed=1.0, max_linear_acceleration=0.5, max_angular_acceleration=0.5)
    layout = action_layout(robot)
    world = hall(TaskConfig(robot=robot, command_delay=2))
    world.reset(poses=(0.0, 0.0, 0.0), targets=(15.0, 15.0))
    followed = []
    for _ in range(4):
        world.step(np.ones((1, layout.size), dtype=np.float32))
        followed.append(world.followed()[0].tolist())
    assert followed[:2] == [[0.0] * layout.size] * 2
    # 0.5 m/s² for 0.2 s are a tenth of 1 m/s; 0.5 rad/s² a fifteenth of 1.5 rad/s; a steering angle is taken at once.
    shares = {"linear": 0.1, "angular": 0.1 / 1.5, "steering": 1.0}
    shares["lateral"] = 0.1 / drive.sideways if isinstance(drive, OmnidirectionalDrive) else 0.0
    for steps in (1, 2):
        assert followed[1 + steps] == pytest.approx([min(1.0, steps * shares[name]) for name in layout.names])


def test_wheels_steer_no_faster_than_they_can() -> None:
    robot = robot_with(AckermannDrive(steering_limit=30.0, steering_rate=30.0))
    world = hall(TaskConfig(robot=robot))
    world.reset(poses=(0.0, 0.0, 0.0), targets=(15.0, 15.0))
    angles = []
    for _ in range(6):
        world.step(np.array([[0.5, -1.0]], dtype=np.float32))
        angles.append(30.0 * world.followed()[0, 1])
    assert angles == pytest.approx([-6.0, -12.0, -18.0, -24.0, -30.0, -30.0])


@pytest.mark.parametrize("drive", [DifferentialDrive(reverse=1.0), OmnidirectionalDrive(), AckermannDrive()])
def test_a_robot_that_reverses_into_a_wall_collides(drive: AnyDrive) -> None:
    world = World(TaskConfig(robot=robot_with(drive), collision_distance=0.0), (Arena("hall"),), 1, seed=0)
    world.reset(poses=(-4.8, 0.0, 0.0), targets=(3.0, 0.0))
    action = np.zeros((1, action_layout(world.task.robot).size), dtype=np.float32)
    action[0, 0] = -1.0
    world.step(action)
    assert world.robots.outcomes[0] == 2


def test_odometry_drifts_by_how_the_middle_of_the_body_turned() -> None:
    # A car that turns by 0.1 rad in a step: the heading's random walk has the variance of the way turned.
    robot = robot_with(AckermannDrive(wheel_base=0.5, steering_limit=45.0), max_linear_speed=0.25)
    task = TaskConfig(robot=robot, odometry=OdometryConfig(heading_noise=0.5))
    world = hall(task, 400)
    world.reset(poses=(0.0, 0.0, 0.0), targets=(15.0, 15.0))
    for _ in range(20):
        world.step(np.tile(np.array([1.0, 1.0], dtype=np.float32), (400, 1)))
    assert world.robots.drift[:, 2].std() == pytest.approx(0.5 * math.sqrt(20 * 0.1), rel=0.15)


def test_a_world_goes_on_from_its_state_whatever_drives_it() -> None:
    for drive in DRIVES:
        task = TaskConfig(robot=robot_with(drive, max_linear_acceleration=0.3))
        first, second = (NavigationVectorEnv(task, 4, seed=1) for _ in range(2))
        first.reset(seed=1)
        second.reset(seed=2)
        act = random_policy(3, action_layout(task.robot))
        for _ in range(5):
            first.step(act(np.zeros((4, 1), np.float32)))
        second.set_state(first.get_state())
        action = act(np.zeros((4, 1), np.float32))
        for mine, theirs in zip(first.step(action)[:4], second.step(action)[:4], strict=True):
            np.testing.assert_array_equal(mine, theirs)


@pytest.mark.parametrize("drive", DRIVES[2:])
def test_go_to_goal_drives_every_robot_to_targets_in_the_open(drive: AnyDrive) -> None:
    robot = RoundConfig.model_validate({"radius": 0.1, "drive": drive.model_dump()})
    task = TaskConfig(robot=robot)
    table = run_suite(go_to_goal(task), task, load_suite("simple-200"))
    assert (table.outcomes == 1).mean() > 0.5


@pytest.mark.parametrize("drive", DRIVES)
def test_the_dynamic_window_plans_in_the_commands_of_the_drive(drive: AnyDrive) -> None:
    robot = RoundConfig.model_validate({"radius": 0.1, "drive": drive.model_dump()})
    task = TaskConfig(robot=robot)
    table = run_controller(dynamic_window(task), task, load_suite("simple-200"))
    assert (table.outcomes == 1).mean() > 0.9


def test_the_page_on_adding_a_robot_works_as_written() -> None:
    page = (Path(__file__).parents[2] / "docs" / "extending" / "add-a-robot.md").read_text(encoding="utf-8")
    free, named = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    namespace: dict[str, Any] = {}
    exec(free, namespace)
    here = {**vars(robot_module)}
    exec(named, here)
    for task in (namespace["task"], TaskConfig().model_copy(update={"robot": here["HopperConfig"]()})):
        env = NavigationVectorEnv(task, 2, seed=0)
        env.reset(seed=0)
        env.step(np.ones((2, action_layout(task.robot).size), dtype=np.float32))
        assert np.hypot(*env.twists()[0, :2]) == pytest.approx(task.robot.max_linear_speed, rel=0.5)

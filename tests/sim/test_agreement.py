"""The compiled world against the same task written plainly over pymunk, step by step."""

import math
from typing import get_args

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from sim.arenas import Arena, free_distance
from sim.config import (
    AlignmentTerm,
    FormulaTerm,
    ObservationConfig,
    ObservationName,
    PathProgressTerm,
    PeopleTerm,
    ProximityTerm,
    RandomisationConfig,
    RewardConfig,
    RewardPreset,
    SmoothnessTerm,
    SpeedTerm,
    TaskConfig,
    TimeoutTerm,
    TimeTerm,
    preset_terms,
)
from sim.engine.plain import PlainWorld, exact_arc
from sim.engine.world import World
from sim.errors import ArenaError
from sim.kernels.records import ARRIVAL, COLLISION, NONE, TIMEOUT
from tests.sim.scenes import arenas

REWARDS = {
    **{name: RewardConfig.preset(name) for name in get_args(RewardPreset)},
    "all": RewardConfig(
        terms=(
            *preset_terms("clearance"),
            TimeoutTerm(),
            TimeTerm(),
            PathProgressTerm(weight=20.0),
            ProximityTerm(margin=0.5),
            AlignmentTerm(),
            SmoothnessTerm(),
            SpeedTerm(),
            PeopleTerm(),
            FormulaTerm(label="slow_near", formula="min(0, clearance - 0.3) * speed / max_speed - 0.1 * abs(turning_rate)"),
            FormulaTerm(
                label="ends", formula="3 * arrived - 4 * collided + (previous_distance - distance if steps > 5 else 0)"
            ),
            FormulaTerm(label="jerk", formula="-(speed - last_speed) ** 2 - cos(bearing) * exp(-nearest)"),
        )
    ),
}
OUTCOMES = {NONE: "none", ARRIVAL: "arrival", COLLISION: "collision", TIMEOUT: "timeout"}


@settings(max_examples=40, deadline=None)
@given(
    arenas,
    st.integers(0, 2**32 - 1),
    st.sampled_from(["paper", "improved"]),
    st.sampled_from(sorted(REWARDS)),
    st.sampled_from([(), (120.0, 240.0)]),
)
def test_observations_rewards_and_outcomes_agree(
    arena: Arena, seed: int, observation: ObservationName, reward: str, fields_of_view: tuple[float, ...]
) -> None:
    rng = np.random.default_rng(seed)
    task = TaskConfig(
        observation=ObservationConfig.preset(observation),
        reward=REWARDS[reward],
        step_limit=int(rng.integers(10, 60)),
        collision_distance=float(rng.choice([0.0, 0.2])),
        randomisation=RandomisationConfig(field_of_view=fields_of_view),
    )
    try:
        world = World(task, (arena,), 1, seed=seed)
    except ArenaError:
        assume(False)
    world.reset()
    pose, target = world.robots.poses[0].astype(float), world.robots.targets[0].astype(float)
    plain = PlainWorld(task, arena, (pose[0], pose[1], pose[2]), (target[0], target[1]), world.fields_of_view[0])
    actions = np.repeat(rng.uniform([0.3, -1.0], 1.0, (10, 2)), 6, axis=0).astype(np.float32)
    for linear, angular in actions.tolist():
        expected = plain.step(linear, angular)
        margins = (
            plain.distance - task.arrival_distance,
            plain.clearance(),
            plain.scan().min() - task.collision_distance,
        )
        world.step(np.array([[linear, angular]], dtype=np.float32))
        robots = world.robots
        if min(map(abs, margins)) < 1e-4:
            return  # within rounding of an arrival or a contact, either answer is right
        assert OUTCOMES[robots.outcomes[0]] == expected.outcome
        # A bearing of half a turn may round to either side, and so may everything made of it.
        if abs(abs(plain.bearing()) - math.pi) > 1e-4 and abs(abs(pose[2]) - math.pi) > 1e-4:
            tolerance = 2e-3 * abs(task.reward.weight("progress")) * 1e-3 + 1e-2
            assert robots.terms[0] == pytest.approx(expected.terms, abs=tolerance)
            assert robots.rewards[0] == pytest.approx(expected.reward, abs=tolerance)
        assert robots.terms[0].sum() == pytest.approx(robots.rewards[0], rel=1e-6, abs=1e-5)  # they may cancel
        if expected.outcome in ("collision", "timeout"):
            assert_observations_equal(robots.final_observations[0], expected.observation, task)
            return
        if expected.outcome == "arrival":
            return
        assert_observations_equal(robots.observations[0], expected.observation, task)
        assert robots.poses[0, :2] == pytest.approx(tuple(plain.body.position), abs=1e-5)


def assert_observations_equal(ours: np.ndarray, expected: np.ndarray, task: TaskConfig) -> None:
    """Equal within rounding; a ray that grazes an edge may fall on either side of it, once in a while."""
    batches = task.observation.batches * len(task.lidar.mount.places)
    assert np.count_nonzero(np.abs(ours[:batches] - expected[:batches]) > 1e-3) <= 1
    difference = np.abs(ours[batches:] - expected[batches:])
    period = np.where(
        np.isin(np.arange(len(difference)), [3, 4]), 1.0 if task.observation.in_short == "paper" else 2.0, np.inf
    )
    assert np.minimum(difference, np.abs(period - difference)).max() < 1e-4


@settings(max_examples=30, deadline=None)
@given(st.floats(0.0, 1.0), st.floats(-1.0, 1.0), st.floats(-math.pi, math.pi))
def test_free_motion_stays_on_the_exact_arc(linear: float, angular: float, heading: float) -> None:
    task = TaskConfig()
    world = World(task, (Arena("hall", half_width=20.0, half_height=20.0),), 1, seed=0)
    world.reset(poses=(0.0, 0.0, heading), targets=(15.0, 15.0))
    action = np.array([[linear, angular]], dtype=np.float32)
    for _ in range(50):
        world.step(action)
    start = (0.0, 0.0, float(np.float32(heading)))
    v, w = (float(action[0, k]) * limit for k, limit in ((0, 0.25), (1, 1.0)))
    x, y, angle = exact_arc(start, v, w, 50 * task.control_period)
    state = world.get_state()["bodies"][0]
    assert state[:2] == pytest.approx((x, y), abs=1e-12)
    assert math.cos(state[2] - angle) == pytest.approx(1.0, abs=1e-12)


def test_a_heading_stays_true_however_often_a_robot_turns() -> None:
    task = TaskConfig(step_limit=10_000)
    world = World(task, (Arena("hall"),), 30, seed=0)
    world.reset(poses=(0.0, 0.0, 1.0), targets=(3.0, 3.0))
    action = np.tile(np.array([0.0, -1.0], dtype=np.float32), (30, 1))
    for _ in range(1_200):  # 240 rad
        world.step(action)
    assert np.abs(world.robots.poses[:, 2]).max() <= math.pi
    assert np.cos(world.robots.poses[:, 2] - (1.0 - 240.0)) == pytest.approx(1.0, abs=1e-6)
    assert np.abs(world.get_state()["bodies"][:, 2]).max() < 110.0


@settings(max_examples=30, deadline=None)
@given(arenas, st.integers(0, 2**32 - 1))
def test_collision_flags_are_those_of_chipmunk(arena: Arena, seed: int) -> None:
    """Body contact alone, judged by Chipmunk's shape query, for robots put anywhere that fits."""
    task = TaskConfig(collision_distance=0.0, step_limit=10)
    rng = np.random.default_rng(seed)
    half = np.array([arena.half_width, arena.half_height])
    positions = rng.uniform(-half, half, (100, 2))
    positions = positions[free_distance(arena, positions) > task.robot.inscribed_radius + 1e-4]
    assume(len(positions) > 0)
    poses = np.column_stack([positions, rng.uniform(-np.pi, np.pi, len(positions))])
    try:
        world = World(task, (arena,), len(poses), seed=seed)
    except ArenaError:
        assume(False)
    world.reset(poses=poses)
    world.step(np.tile(np.array([[1.0, 0.0]], dtype=np.float32), (len(poses), 1)))
    for i, pose in enumerate(poses.astype(np.float32).astype(float).tolist()):
        plain = PlainWorld(task, arena, (pose[0], pose[1], pose[2]), (0.0, 0.0))
        plain.step(1.0, 0.0)
        touching = bool(plain.space.shape_query(plain.shape))
        if abs(plain.clearance()) > 1e-4 and world.robots.outcomes[i] != ARRIVAL:
            assert (world.robots.outcomes[i] == COLLISION) == touching == (plain.clearance() < 0.0)

"""The vector environment's contract: attempts, resets, seeds, states."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim.config import ArenaConfig, TaskConfig
from sim.envs.single import NavigationEnv
from sim.envs.vector import NavigationVectorEnv
from sim.errors import PlacementError

SIMPLE = TaskConfig()
COMPLEX = TaskConfig(arena=ArenaConfig(name="complex"))
FORWARD = np.array([1.0, 0.0], dtype=np.float32)


def random_actions(seed: int, steps: int, robots: int) -> np.ndarray:
    return np.random.default_rng(seed).uniform([0.0, -1.0], 1.0, (steps, robots, 2)).astype(np.float32)


def drive(envs: NavigationVectorEnv, actions: np.ndarray) -> list[Any]:
    return [envs.step(action)[:4] for action in actions]


def test_an_arrival_pays_and_brings_a_new_target_while_the_episode_goes_on() -> None:
    envs = NavigationVectorEnv(SIMPLE, 1, seed=0)
    envs.reset(options={"poses": [[0.0, 0.0, 0.0]], "targets": [[0.32, 0.0]]})
    # 0.05 m a step: 0.27, 0.22, then 0.17 m, within the arrival distance of 0.2 m.
    rewards = []
    for _ in range(3):
        _, reward, terminated, truncated, infos = envs.step(FORWARD[None])
        rewards.append(float(reward[0]))
        assert not terminated[0]
        assert not truncated[0]
    assert rewards == pytest.approx([25.0, 25.0, 120.0], rel=1e-5)
    assert envs.outcomes[0] == 1
    assert (envs.attempt_steps[0], envs.attempt_path_lengths[0]) == (3, pytest.approx(0.15))
    assert envs.attempt_rewards[0] == pytest.approx(170.0, rel=1e-5)
    assert envs.attempt_min_clearances[0] == pytest.approx(5.0 - 0.15 - 0.105, abs=1e-5)
    assert infos["attempt"]["steps"][0] == 3
    assert envs.poses[0] == pytest.approx([0.15, 0.0, 0.0], abs=1e-6)
    assert np.hypot(*(envs.targets[0] - envs.poses[0, :2])) >= 0.5
    envs.step(FORWARD[None])
    assert (envs.outcomes[0], envs.attempt_steps[0]) == (0, 1)


def test_a_collision_terminates_and_the_next_episode_begins_in_the_same_step() -> None:
    envs = NavigationVectorEnv(SIMPLE, 2, seed=0)
    poses = [[4.72, 0.0, 0.0], [0.0, 0.0, 0.0]]
    envs.reset(options={"poses": poses, "targets": [[-3.0, 0.0], [3.0, 0.0]]})
    envs.step(np.tile(FORWARD, (2, 1)))  # x = 4.77: 0.23 m from the wall
    assert envs.outcomes.tolist() == [0, 0]
    observations, rewards, terminated, truncated, infos = envs.step(np.tile(FORWARD, (2, 1)))  # 0.18 m
    assert rewards[0] == -100.0
    assert terminated.tolist() == [True, False]
    assert truncated.tolist() == [False, False]
    assert envs.outcomes.tolist() == [2, 0]
    # The last observation of the old episode, and the first of the new one: at rest, and elsewhere.
    assert envs.final_observations[0, 4] == 1.0
    assert envs.final_observations[0, 10] == 1.0
    assert observations[0, 10:12].tolist() == [0.0, 0.0]
    assert infos["_final_obs"].tolist() == [True, False]
    assert infos["final_obs"][0] == pytest.approx(envs.final_observations[0])


def test_touching_a_wall_with_the_side_of_the_body_is_a_collision() -> None:
    task = SIMPLE.model_copy(update={"collision_distance": 0.0})
    envs = NavigationVectorEnv(task, 1, seed=0)
    envs.reset(options={"poses": [[0.0, 4.891, 0.1]], "targets": [[3.0, 0.0]]})
    _, _, terminated, _, _ = envs.step(FORWARD[None])  # up by 0.05 sin(0.1) = 0.005 to y = 4.896: 1 mm into the wall
    assert terminated[0]


def test_the_step_limit_truncates_and_counts_from_the_last_arrival() -> None:
    task = SIMPLE.model_copy(update={"step_limit": 10})
    envs = NavigationVectorEnv(task, 1, seed=0)
    envs.reset(options={"poses": [[0.0, 0.0, 0.0]], "targets": [[0.32, 0.0]]})
    drive(envs, np.tile(FORWARD, (3, 1, 1)))
    assert envs.outcomes[0] == 1
    stand = np.zeros((9, 1, 2), dtype=np.float32)
    assert not any(truncated[0] for _, _, _, truncated in drive(envs, stand))
    _, _, terminated, truncated, _ = envs.step(stand[0])
    assert (terminated[0], truncated[0], envs.outcomes[0], envs.attempt_steps[0]) == (False, True, 3, 10)


@settings(max_examples=10, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_a_robot_drives_the_same_way_whoever_drives_beside_it(seed: int) -> None:
    actions = random_actions(seed, 150, 100)
    many = NavigationVectorEnv(COMPLEX, 100, seed=seed)
    few = NavigationVectorEnv(COMPLEX, 3, seed=seed)
    assert np.array_equal(many.reset()[0][:3], few.reset()[0])
    for action in actions:
        for ours, theirs in zip(many.step(action)[:4], few.step(action[:3])[:4], strict=True):
            assert np.array_equal(ours[:3], theirs)
    assert np.array_equal(many.poses[:3], few.poses)


def test_the_single_environment_is_the_first_robot_of_the_vector_environment() -> None:
    envs, env = NavigationVectorEnv(COMPLEX, 4), NavigationEnv(COMPLEX)
    first, _ = envs.reset(seed=5)
    alone, _ = env.reset(seed=5)
    assert np.array_equal(first[0], alone)
    for action in random_actions(1, 200, 4):
        observations, rewards, terminated, truncated, _ = envs.step(action)
        observation, reward, ended, cut, _ = env.step(action[0])
        assert (reward, ended, cut) == (rewards[0], terminated[0], truncated[0])
        if ended or cut:
            assert np.array_equal(observation, envs.final_observations[0])
            # The next episode is the same; its first observation is made by other compiled code, which may round otherwise.
            observation, _ = env.reset()
            assert observation == pytest.approx(observations[0], abs=1e-6)
            continue
        assert np.array_equal(observation, observations[0])


def test_a_state_taken_and_set_goes_on_bit_for_bit() -> None:
    envs = NavigationVectorEnv(COMPLEX, 50, seed=7)
    envs.reset()
    actions = random_actions(0, 400, 50)
    drive(envs, actions[:200])
    state = {name: array.copy() for name, array in envs.get_state().items()}
    expected = drive(envs, actions[200:])
    other = NavigationVectorEnv(COMPLEX, 50, seed=99)
    other.reset()
    other.set_state(state)
    for ours, theirs in zip(expected, drive(other, actions[200:]), strict=True):
        assert all(np.array_equal(a, b) for a, b in zip(ours, theirs, strict=True))


def test_a_state_of_another_number_of_robots_is_refused() -> None:
    with pytest.raises(ValueError, match="number of robots"):
        NavigationVectorEnv(SIMPLE, 3).set_state(NavigationVectorEnv(SIMPLE, 2).get_state())


def test_resets_with_a_seed_repeat_and_without_go_on() -> None:
    envs = NavigationVectorEnv(COMPLEX, 8)
    first, _ = envs.reset(seed=3)
    second, _ = envs.reset()
    again, _ = envs.reset(seed=3)
    assert np.array_equal(first, again)
    assert not np.array_equal(first, second)


def test_starts_and_targets_are_clear_and_apart() -> None:
    from sim.arenas import free_distance

    envs = NavigationVectorEnv(COMPLEX, 2000, seed=1)
    envs.reset()
    arena = envs.arenas[0]
    assert free_distance(arena, envs.poses[:, :2]).min() >= 0.4 - 1e-5
    assert free_distance(arena, envs.targets).min() >= 0.4 - 1e-5
    assert np.hypot(*(envs.poses[:, :2] - envs.targets).T).min() >= 0.5
    # Uniform where it is free: as many on the left as on the right, and headings all round.
    assert np.abs(envs.poses.mean(axis=0)).max() < 0.25
    assert np.abs(envs.targets).max() <= 3.6 + 0.06


def test_results_are_copies_unless_asked_otherwise() -> None:
    envs = NavigationVectorEnv(SIMPLE, 2, seed=0)
    first, _ = envs.reset()
    kept = first.copy()
    envs.step(random_actions(0, 1, 2)[0])
    assert np.array_equal(first, kept)
    shared = NavigationVectorEnv(SIMPLE, 2, seed=0, copy=False)
    first, _ = shared.reset()
    assert shared.step(random_actions(0, 1, 2)[0])[0] is first


@pytest.mark.parametrize(
    "options",
    [
        {"poses": [[-1.2, 0.9, 0.0]]},
        {"targets": [[-1.2, 0.9]]},
        {"poses": [[9.0, 0.0, 0.0]]},
        {"poses": [[np.nan, 0.0, 0.0]]},
        {"poses": [[0.0, 0.0]]},
        {"start": [[0.0, 0.0, 0.0]]},
        {"arenas": [1]},
    ],
)
def test_placements_that_do_not_fit_are_refused(options: dict[str, Any]) -> None:
    with pytest.raises(PlacementError):
        NavigationVectorEnv(COMPLEX, 1, seed=0).reset(options=options)


@pytest.mark.parametrize("bad", [np.full((2, 2), np.nan), np.full((2, 2), np.inf), np.zeros((3, 2)), np.zeros(2)])
def test_actions_that_mean_nothing_are_refused(bad: np.ndarray) -> None:
    envs = NavigationVectorEnv(SIMPLE, 2, seed=0)
    envs.reset()
    with pytest.raises(ValueError, match="action"):
        envs.step(bad.astype(np.float32))


def test_actions_beyond_the_limits_are_clipped() -> None:
    envs = NavigationVectorEnv(SIMPLE, 1, seed=0)
    envs.reset(options={"poses": [[0.0, 0.0, 0.0]], "targets": [[3.0, 0.0]]})
    envs.step(np.array([[7.0, 0.0]], dtype=np.float32))
    assert envs.poses[0] == pytest.approx([0.05, 0.0, 0.0])
    envs.step(np.array([[-7.0, 9.0]], dtype=np.float32))
    assert envs.poses[0] == pytest.approx([0.05, 0.0, 0.2])


def test_a_fast_robot_does_not_jump_through_a_thin_wall() -> None:
    from sim.arenas import Arena
    from sim.engine.world import World

    wall = Arena("wall", boxes=np.array([[0.0, 0.0, 0.02, 4.9, 0.0]]))
    task = TaskConfig.model_validate({"robot": {"max_linear_speed": 3.0}, "collision_distance": 0.0})
    world = World(task, (wall,), 1, seed=0)
    world.reset(poses=(-0.3, 1.0, 0.0), targets=(3.0, 1.0))
    world.step(FORWARD[None])  # 0.6 m: from one side of the wall to the other
    assert world.robots.outcomes[0] == 2


@pytest.mark.parametrize(("arrival_distance", "nearest"), [(0.2, 0.5), (0.4, 0.5), (0.7, 0.8), (1.0, 1.1)])
def test_no_target_is_drawn_where_the_robot_would_have_arrived_already(arrival_distance: float, nearest: float) -> None:
    envs = NavigationVectorEnv(TaskConfig(arrival_distance=arrival_distance), 4000, seed=0)
    envs.reset()
    apart = np.hypot(*(envs.poses[:, :2] - envs.targets).T)
    assert nearest - 1e-6 <= apart.min() < nearest + 0.1
    envs.step(np.zeros((4000, 2), dtype=np.float32))
    assert not envs.outcomes.any()

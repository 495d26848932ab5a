"""Episodes of one target each: how they end, and what tools read of it."""

import warnings
from collections.abc import Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest
import torch
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import RecordEpisodeStatistics
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import EvalCallback
from stable_baselines3.common.env_checker import check_env as check_env_of_sb3
from stable_baselines3.common.monitor import Monitor

from sim.envs.point_goal import PointGoalVectorEnv
from sim.envs.registration import POINT_GOAL

AHEAD = np.array([1.0, 0.0], dtype=np.float32)
STAND = np.zeros(2, dtype=np.float32)


def test_an_arrival_terminates_with_success_in_the_info() -> None:
    env = gymnasium.make(POINT_GOAL)
    env.reset(seed=0, options={"pose": (0.0, 0.0, 0.0), "target": (0.28, 0.0)})
    _, _, terminated, truncated, info = env.step(AHEAD)
    assert (terminated, truncated, info["is_success"]) == (False, False, False)
    observation, reward, terminated, truncated, info = env.step(AHEAD)
    assert (reward, terminated, truncated, info["is_success"]) == (120.0, True, False, True)
    assert info["attempt"]["outcome"] == "arrival"
    # All of it is still of this episode: 0.1 m driven, 0.18 m from the target.
    assert info["target"] == pytest.approx([0.28, 0.0])
    assert info["pose"] == pytest.approx([0.1, 0.0, 0.0], abs=1e-6)
    assert observation[12] == pytest.approx(0.18 / 1.18, abs=1e-5)


def test_a_collision_terminates_without_success() -> None:
    env = gymnasium.make(POINT_GOAL)
    env.reset(seed=0, options={"pose": (4.76, 0.0, 0.0), "target": (-3.0, 0.0)})
    _, reward, terminated, _, info = env.step(AHEAD)
    assert (reward, terminated, info["is_success"]) == (-100.0, True, False)


@pytest.mark.parametrize(
    ("arguments", "limit"), [({}, 500), ({"max_episode_steps": 30}, 30), ({"max_episode_steps": 700}, 700)]
)
def test_the_time_limit_is_gymnasiums(arguments: dict[str, Any], limit: int) -> None:
    env = gymnasium.make(POINT_GOAL, task={"step_limit": 10}, **arguments)
    env.reset(seed=0, options={"pose": (0.0, 0.0, 0.0), "target": (3.0, 0.0)})
    for _ in range(limit - 1):
        assert env.step(STAND)[2:4] == (False, False)
    _, _, terminated, truncated, info = env.step(STAND)
    assert (terminated, truncated, info["is_success"]) == (False, True, False)


def test_symmetric_actions_drive_the_same_way() -> None:
    plain, symmetric = gymnasium.make(POINT_GOAL), gymnasium.make(POINT_GOAL, symmetric_actions=True)
    assert isinstance(symmetric.action_space, gymnasium.spaces.Box)
    assert symmetric.action_space.low.tolist() == [-1.0, -1.0]
    assert symmetric.action_space.high.tolist() == [1.0, 1.0]
    plain.reset(seed=3)
    symmetric.reset(seed=3)
    for linear, angular in ((0.0, 0.0), (1.0, 0.5), (0.5, -1.0), (0.25, 1.0)):
        ours = plain.step(np.array([linear, angular], dtype=np.float32))
        theirs = symmetric.step(np.array([2.0 * linear - 1.0, angular], dtype=np.float32))
        assert np.array_equal(ours[0], theirs[0])
        assert ours[1] == theirs[1]


@pytest.mark.parametrize("symmetric", [False, True])
def test_the_checkers_have_nothing_to_say(symmetric: bool) -> None:
    env = gymnasium.make(POINT_GOAL, symmetric_actions=symmetric, render_mode="rgb_array")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)
        if symmetric:  # others it advises against
            check_env_of_sb3(env)


def episodes(envs: gymnasium.vector.VectorEnv[Any, Any, Any], steps: int) -> list[tuple[int, float]]:
    """Length and return of the episodes of all robots that drive ahead, in order, as Gymnasium's own wrapper counts them."""
    recorder, found = RecordEpisodeStatistics(envs), []
    recorder.reset(seed=4)
    for _ in range(steps):
        *_, infos = recorder.step(np.tile(AHEAD, (envs.num_envs, 1)))
        if "episode" in infos:
            ended = infos["_episode"]
            found += list(zip(infos["episode"]["l"][ended].tolist(), infos["episode"]["r"][ended].tolist(), strict=True))
    return found


def test_either_autoreset_mode_gives_the_same_episodes() -> None:
    assert gymnasium.make_vec(POINT_GOAL).metadata["autoreset_mode"] is AutoresetMode.NEXT_STEP
    runs = []
    for mode in (AutoresetMode.SAME_STEP, AutoresetMode.NEXT_STEP):
        envs = gymnasium.make_vec(POINT_GOAL, num_envs=1, autoreset_mode=mode, max_episode_steps=60)
        assert envs.metadata["autoreset_mode"] is mode
        runs.append(episodes(envs, 400))
    same, following = runs
    assert len(following) > 5
    for (length, total), (other_length, other_total) in zip(same, following, strict=False):
        assert length == other_length
        assert total == pytest.approx(other_total, abs=0.05)
    with pytest.raises(ValueError, match="SameStep"):
        PointGoalVectorEnv(autoreset_mode=AutoresetMode.DISABLED)


def test_the_next_step_begins_the_next_episode_whatever_the_action() -> None:
    envs = PointGoalVectorEnv(num_envs=2, seed=0)
    envs.reset(options={"poses": [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]], "targets": [[0.24, 0.0], [3.0, 0.0]]})
    observations, rewards, terminated, _, infos = envs.step(np.tile(AHEAD, (2, 1)))
    assert terminated.tolist() == [True, False]
    assert infos["is_success"].tolist() == [True, False]
    assert "final_obs" not in infos
    assert observations[0, 12] == pytest.approx(0.19 / 1.19, abs=1e-5)  # the last of its own episode
    observations, rewards, terminated, truncated, infos = envs.step(np.array([[np.nan, np.nan], AHEAD], dtype=np.float32))
    assert (rewards[0], terminated[0], truncated[0], infos["is_success"][0]) == (0.0, False, False, False)
    assert observations[0, 10:12].tolist() == [0.0, 0.0]  # at rest
    assert observations[0, 12] > 0.5 / 1.5 - 1e-6
    assert envs.poses[1, 0] == pytest.approx(0.1)
    envs.step(np.tile(AHEAD, (2, 1)))
    assert envs.attempt_steps.tolist() == [1, 3]


def test_the_same_step_tells_of_success_in_the_final_info() -> None:
    envs = PointGoalVectorEnv(num_envs=2, seed=0, autoreset_mode=AutoresetMode.SAME_STEP)
    envs.reset(options={"poses": [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0]], "targets": [[0.24, 0.0], [3.0, 0.0]]})
    *_, infos = envs.step(np.tile(AHEAD, (2, 1)))
    assert infos["_final_info"].tolist() == [True, False]
    assert infos["final_info"]["is_success"].tolist() == [True, False]
    assert infos["is_success"].tolist() == [False, False]


@pytest.fixture
def one_thread() -> Iterator[None]:
    """Several threads would only wait for each other on networks this small."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


def test_stable_baselines_evaluates_it_to_an_end_and_counts_successes(one_thread: None, tmp_path: Any) -> None:
    # Targets that count as reached from 1 m, so that a few thousand steps are enough.
    arguments: dict[str, Any] = {"task": {"arrival_distance": 1.0}, "max_episode_steps": 100, "symmetric_actions": True}
    env, other = (Monitor(gymnasium.make(POINT_GOAL, **arguments)) for _ in range(2))
    callback = EvalCallback(other, n_eval_episodes=10, eval_freq=1024, log_path=str(tmp_path), verbose=0)
    model = PPO(
        "MlpPolicy", env, n_steps=512, batch_size=64, n_epochs=5, gamma=0.9, learning_rate=1e-3, seed=1, device="cpu"
    )
    model.learn(4096, callback=callback)
    written = np.load(tmp_path / "evaluations.npz")
    assert written["successes"].shape == (4, 10)
    assert written["ep_lengths"].max() <= 100
    # What Stable-Baselines3 prints as `ep_rew_mean` and `success_rate` while it trains goes on as well.
    assert len(model.ep_info_buffer or []) > 20
    assert len(model.ep_success_buffer or []) > 20
    # Which of the drawn targets it reaches is luck after so few steps; that it reaches some is not.
    assert written["successes"].any()


def test_tools_that_look_at_direct_base_classes_know_a_gymnasium_environment() -> None:
    for env in (gymnasium.make(POINT_GOAL), gymnasium.make_vec(POINT_GOAL)):
        assert any(base.__module__.startswith("gymnasium.") for base in type(env).__bases__)

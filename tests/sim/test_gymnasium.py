"""A Gymnasium citizen: ids, checker, spaces, pictures."""

import warnings

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import RecordEpisodeStatistics

import sim.registration
from sim.config import TaskConfig
from sim.errors import PlacementError


@pytest.mark.parametrize("observation", ["paper", "improved"])
@pytest.mark.parametrize("arena", ["simple", "complex"])
def test_the_checker_has_nothing_to_say(arena: str, observation: str) -> None:
    task = {"arena": {"name": arena}, "observation": observation}
    env = gymnasium.make(sim.registration.NAVIGATION, task=task, render_mode="rgb_array")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)


def test_make_vec_gives_the_real_vector_environment() -> None:
    envs = gymnasium.make_vec(sim.registration.NAVIGATION, num_envs=16, task={"step_limit": 20})
    assert envs.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    observations, _ = envs.reset(seed=0)
    assert observations.shape == (16, 16)
    for _ in range(50):
        observations, *_ = envs.step(envs.action_space.sample())
        assert envs.observation_space.contains(observations)


def test_gymnasiums_own_episode_statistics_count_right() -> None:
    envs = RecordEpisodeStatistics(gymnasium.make_vec(sim.registration.NAVIGATION, num_envs=4, task={"step_limit": 20}))
    envs.reset(seed=0)
    lengths = []
    for _ in range(60):
        *_, infos = envs.step(np.zeros((4, 2), dtype=np.float32))
        if "episode" in infos:
            lengths += infos["episode"]["l"][infos["_episode"]].tolist()
    assert lengths == [20] * 12


def test_a_robot_is_placed_by_options_and_told_in_the_info() -> None:
    env = gymnasium.make(sim.registration.NAVIGATION)
    _, info = env.reset(options={"pose": (1.0, 2.0, 0.5), "target": (-3.0, 0.0)})
    assert info["pose"] == pytest.approx([1.0, 2.0, 0.5])
    assert info["target"] == pytest.approx([-3.0, 0.0])
    with pytest.raises(PlacementError, match="unknown"):
        env.reset(options={"position": (1.0, 2.0)})


def test_an_attempt_is_told_in_the_info_when_it_ends() -> None:
    env = gymnasium.make(sim.registration.NAVIGATION)
    env.reset(seed=0, options={"pose": (0.0, 0.0, 0.0), "target": (0.24, 0.0)})
    *_, info = env.step(np.array([1.0, 0.0], dtype=np.float32))
    assert info["attempt"]["outcome"] == "arrival"
    assert info["attempt"]["steps"] == 1


def test_a_wrong_task_is_refused_with_its_place() -> None:
    with pytest.raises(ValueError, match=r"robot\.radius"):
        gymnasium.make(sim.registration.NAVIGATION, task={"robot": {"radius": -1.0}})


def test_a_picture_shows_floor_wall_robot_and_target() -> None:
    env = gymnasium.make(sim.registration.NAVIGATION, task=TaskConfig(), render_mode="rgb_array")
    env.reset(seed=0, options={"pose": (0.0, 0.0, np.pi / 2), "target": (3.0, 3.0)})
    picture = env.render()
    assert isinstance(picture, np.ndarray)
    assert picture.shape == (480, 480, 3)
    red, green, blue = (picture[..., k].astype(int) for k in range(3))
    rows, columns = np.nonzero((blue > 180) & (red < 90))
    assert (rows.mean(), columns.mean()) == pytest.approx((240.0, 240.0), abs=5.0)
    rows, columns = np.nonzero((green > 140) & (red < 60))
    metres = 480 / 10.5
    assert (rows.mean(), columns.mean()) == pytest.approx((240.0 - 3 * metres, 240.0 + 3 * metres), abs=2.0)
    assert picture[1, 1].tolist() == [76, 84, 96]

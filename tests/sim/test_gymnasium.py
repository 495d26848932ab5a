"""A Gymnasium citizen: ids, checker, spaces, pictures."""

import subprocess
import sys
import time
import warnings
from collections.abc import Iterator

import gymnasium
import numpy as np
import pygame
import pytest
import torch
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode
from gymnasium.wrappers.vector import RecordEpisodeStatistics
from stable_baselines3 import PPO

import sim.envs.registration
from sim.config import TaskConfig
from sim.envs.single import NavigationEnv
from sim.errors import DisplayError, PlacementError


@pytest.fixture
def screen(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A display for this test: SDL's own that nobody sees."""
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    yield
    pygame.quit()


@pytest.mark.parametrize("render_mode", [None, "rgb_array", "human"])
@pytest.mark.parametrize("observation", ["paper", "improved"])
@pytest.mark.parametrize("arena", ["simple", "complex"])
def test_the_checker_has_nothing_to_say(screen: None, arena: str, observation: str, render_mode: str | None) -> None:
    task = {"arena": {"name": arena}, "observation": observation, "control_period": 0.02}
    env = gymnasium.make(sim.envs.registration.NAVIGATION, task=task, render_mode=render_mode)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)
    env.close()


@pytest.mark.parametrize(
    "task",
    [
        {"robot": {"name": "jackal"}, "frames": 4, "lidar": {"field_of_view": 360.0, "rays": 60, "batches": 20}},
        {
            "observation": "paper",
            "lidar": {"rate": 2.0, "noise": 0.02, "dropout": 0.1},
            "odometry": {"distance_noise": 0.3, "heading_noise": 0.3},
            "command_delay": 3,
            "randomisation": {"max_linear_speed": [0.1, 0.3], "range": [0.5, 3.0], "command_delay": [0, 5]},
        },
    ],
)
def test_the_checker_has_nothing_to_say_of_other_robots_and_disturbances(task: dict[str, object]) -> None:
    env = gymnasium.make(sim.envs.registration.NAVIGATION, task=task, render_mode="rgb_array")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped, skip_render_check=True)


def test_a_person_sees_every_step_at_the_robots_own_pace(screen: None) -> None:
    task, placed = TaskConfig(control_period=0.05), {"pose": (0.0, 0.0, 0.0), "target": (3.0, 3.0)}
    env, twin = NavigationEnv(task, render_mode="human"), NavigationEnv(task, render_mode="rgb_array")
    env.reset(seed=0, options=placed)
    twin.reset(seed=0, options=placed)
    started = time.perf_counter()
    for _ in range(10):
        env.step(np.ones(2, dtype=np.float32))
        twin.step(np.ones(2, dtype=np.float32))
    assert time.perf_counter() - started > 0.4
    assert env.render() is None
    picture = twin.render()
    assert picture is not None
    assert np.array_equal(shown(env), picture)


def test_a_window_that_was_closed_stays_closed_and_the_robot_drives_on(screen: None) -> None:
    env = NavigationEnv(TaskConfig(control_period=0.02), render_mode="human")
    env.reset(seed=0)
    window = env._window
    assert window is not None
    pygame.event.post(pygame.event.Event(pygame.WINDOWCLOSE, window=window._window))
    for _ in range(3):
        env.step(np.zeros(2, dtype=np.float32))
    assert window._window is None


def shown(env: NavigationEnv) -> np.ndarray:
    """The pixels of the environment's window, (height, width, 3)."""
    window = env._window
    assert window is not None
    assert window._window is not None
    return pygame.surfarray.array3d(window._window.get_surface()).swapaxes(0, 1)


def test_without_a_display_or_pygame_there_is_a_word_about_it(monkeypatch: pytest.MonkeyPatch) -> None:
    for variable in ("SDL_VIDEODRIVER", "DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(variable, raising=False)
    with pytest.raises(DisplayError, match="rgb_array"):
        gymnasium.make(sim.envs.registration.NAVIGATION, render_mode="human")
    pygame.quit()
    monkeypatch.setitem(sys.modules, "pygame", None)
    with pytest.raises(DisplayError, match="pygame-ce"):
        gymnasium.make(sim.envs.registration.NAVIGATION, render_mode="human")


@pytest.mark.filterwarnings("ignore:.*render_mode")  # Gymnasium warns before we refuse
def test_a_render_mode_that_nobody_knows_is_refused() -> None:
    for make in (gymnasium.make, gymnasium.make_vec):
        with pytest.raises(ValueError, match="render_mode"):
            make(sim.envs.registration.NAVIGATION, render_mode="ascii")


@pytest.fixture
def one_thread() -> Iterator[None]:
    """Several threads would only wait for each other on networks this small."""
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(threads)


def test_stable_baselines_learns_on_it_unchanged(one_thread: None) -> None:
    # Targets that count as reached from 1 m: a few thousand steps are enough to learn to drive there.
    env = gymnasium.make(sim.envs.registration.NAVIGATION, task={"arrival_distance": 1.0, "step_limit": 100})
    model = PPO(
        "MlpPolicy", env, n_steps=512, batch_size=64, n_epochs=5, gamma=0.9, learning_rate=1e-3, seed=1, device="cpu"
    )
    before = arrivals(model, env)
    model.learn(4096)
    assert arrivals(model, env) >= before + 3


def arrivals(model: PPO, env: gymnasium.Env[np.ndarray, np.ndarray]) -> int:
    """Targets that the deterministic policy reaches in 500 steps."""
    observation, _ = env.reset(seed=1)
    count = 0
    for _ in range(500):
        action, _ = model.predict(observation, deterministic=True)
        observation, _, terminated, truncated, info = env.step(action)
        count += "attempt" in info and info["attempt"]["outcome"] == "arrival"
        if terminated or truncated:
            observation, _ = env.reset()
    return count


def test_make_vec_gives_the_real_vector_environment() -> None:
    envs = gymnasium.make_vec(sim.envs.registration.NAVIGATION, num_envs=16, task={"step_limit": 20})
    assert envs.metadata["autoreset_mode"] is AutoresetMode.SAME_STEP
    observations, _ = envs.reset(seed=0)
    assert observations.shape == (16, 16)
    for _ in range(50):
        observations, *_ = envs.step(envs.action_space.sample())
        assert envs.observation_space.contains(observations)


def test_gymnasiums_own_episode_statistics_count_right() -> None:
    envs = RecordEpisodeStatistics(gymnasium.make_vec(sim.envs.registration.NAVIGATION, num_envs=4, task={"step_limit": 20}))
    envs.reset(seed=0)
    lengths = []
    for _ in range(60):
        *_, infos = envs.step(np.zeros((4, 2), dtype=np.float32))
        if "episode" in infos:
            lengths += infos["episode"]["l"][infos["_episode"]].tolist()
    assert lengths == [20] * 12


def test_a_robot_is_placed_by_options_and_told_in_the_info() -> None:
    env = gymnasium.make(sim.envs.registration.NAVIGATION)
    _, info = env.reset(options={"pose": (1.0, 2.0, 0.5), "target": (-3.0, 0.0)})
    assert info["pose"] == pytest.approx([1.0, 2.0, 0.5])
    assert info["target"] == pytest.approx([-3.0, 0.0])
    with pytest.raises(PlacementError, match="unknown"):
        env.reset(options={"position": (1.0, 2.0)})


def test_an_attempt_is_told_in_the_info_when_it_ends() -> None:
    env = gymnasium.make(sim.envs.registration.NAVIGATION)
    env.reset(seed=0, options={"pose": (0.0, 0.0, 0.0), "target": (0.24, 0.0)})
    *_, info = env.step(np.array([1.0, 0.0], dtype=np.float32))
    assert info["attempt"]["outcome"] == "arrival"
    assert info["attempt"]["steps"] == 1


def test_a_wrong_task_is_refused_with_its_place() -> None:
    with pytest.raises(ValueError, match=r"robot\.burger\.radius"):
        gymnasium.make(sim.envs.registration.NAVIGATION, task={"robot": {"radius": -1.0}})


def test_a_picture_shows_floor_wall_robot_and_target() -> None:
    env = gymnasium.make(sim.envs.registration.NAVIGATION, task=TaskConfig(), render_mode="rgb_array")
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


def crash(env: gymnasium.Env[np.ndarray, np.ndarray]) -> dict[str, object]:
    """Drive from 0.4 m before the wall at x = 5 m into it; the info of the step that ends the episode."""
    env.reset(seed=0, options={"pose": (4.6, 0.0, 0.0), "target": (-3.0, 3.0)})
    for _ in range(10):
        _, _, terminated, _, info = env.step(np.array([1.0, 0.0], dtype=np.float32))
        if terminated:
            return info
    raise AssertionError("the wall was not there")


def test_a_last_steps_pose_target_and_picture_are_those_of_its_own_episode(screen: None) -> None:
    env = gymnasium.make(sim.envs.registration.NAVIGATION, render_mode="rgb_array")
    info = crash(env)
    assert info["pose"] == pytest.approx([4.85, 0.0, 0.0], abs=1e-5)  # 5 steps of 5 cm: less than 0.2 m from the wall
    assert info["target"] == pytest.approx([-3.0, 3.0])
    picture = env.render()
    assert isinstance(picture, np.ndarray)
    red, green, blue = (picture[..., k].astype(int) for k in range(3))
    metres = 480 / 10.5
    rows, columns = np.nonzero((blue > 180) & (red < 90))
    assert (rows.mean(), columns.mean()) == pytest.approx((240.0, 240.0 + 4.85 * metres), abs=3.0)
    rows, columns = np.nonzero((green > 140) & (red < 60))
    assert (rows.mean(), columns.mean()) == pytest.approx((240.0 - 3 * metres, 240.0 - 3 * metres), abs=2.0)


def test_importing_the_simulator_registers_its_environments_and_loads_nothing_heavy() -> None:
    script = """
import sys
import gymnasium, sim
gymnasium.register_envs(sim)
heavy = sorted({"numba", "pymunk", "torch", "scipy", "pygame"} & sys.modules.keys())
print(heavy, *sorted(name for name in gymnasium.registry if name.startswith("Mapless/")))
print(*(gymnasium.make(name).observation_space.shape for name in ("Mapless/Navigation-v0", "Mapless/PointGoal-v0")))
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines() == ["[] Mapless/Navigation-v0 Mapless/PointGoal-v0", "(16,) (16,)"]

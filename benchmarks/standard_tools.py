"""Other people's tools on `Mapless/PointGoal-v0`: Stable-Baselines3, CleanRL, skrl and sbx, told nothing but the id.

    python -m benchmarks.standard_tools --check                       # what is installed
    python -m benchmarks.standard_tools --cleanrl ppo_continuous_action.py --check

Stable-Baselines3 is among the development packages. The others are optional: `pip install skrl sbx-rl`, and for CleanRL,
which is no package but scripts, `pip install tyro tensorboard` and the script itself, cleanrl/ppo_continuous_action.py of
github.com/vwxyzjn/cleanrl at commit 016ca33aa70f188ef385082524373ccb6dd14e03 (MIT). It is run as it is; only the argument
that Gymnasium has asked for since 1.0 is added to the wrapper `TransformObservation`, which that commit calls without it.

Each tool trains for the same steps in an easy setting (targets count as reached from 1 m) by its own defaults, but for the
rollouts and the policy's deviation of skrl, and says what it counts itself: episodes that ended, their success or return.
"""

import importlib
import importlib.util
import os
import re
import runpy
import subprocess
import sys
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import gymnasium
import numpy as np
import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import EvalCallback
from stable_baselines3.common.monitor import Monitor

import sim
from benchmarks.report import finish, parser

gymnasium.register_envs(sim)

ID = "Mapless/PointGoal-v0"
EASY = "Mapless/EasyPointGoal-v0"
STEPS = 30_000
EPISODES = 30
AT_LEAST = 0.5  # of the last evaluation's episodes: far above what an untrained policy reaches

Figures = Mapping[str, float]


def register_easy() -> None:
    """An id for the easy setting: scripts that take an id take no keyword arguments."""
    spec = gymnasium.spec(ID)
    gymnasium.register(
        id=EASY,
        entry_point=spec.entry_point,
        vector_entry_point=spec.vector_entry_point,
        max_episode_steps=100,
        disable_env_checker=True,
        kwargs={"task": {"arrival_distance": 1.0}, "symmetric_actions": True},
    )


def evaluations(folder: str) -> Figures:
    """What Stable-Baselines3's `EvalCallback` has written."""
    written = np.load(Path(folder) / "evaluations.npz")
    return {"evaluations": len(written["timesteps"]), "success": float(written["successes"][-1].mean())}


def stable_baselines(steps: int) -> Figures:
    """PPO with `EvalCallback`, which needs episodes that end and `is_success` in their last infos."""
    with tempfile.TemporaryDirectory() as folder:
        callback = EvalCallback(
            Monitor(gymnasium.make(EASY)), n_eval_episodes=EPISODES, eval_freq=steps // 3, log_path=folder
        )
        model = PPO("MlpPolicy", gymnasium.make(EASY), seed=0, device="cpu")
        model.learn(steps, callback=callback)
        return {**evaluations(folder), "episodes": len(model.ep_info_buffer or ())}


def sbx(steps: int) -> Figures:
    """The same in JAX."""
    module = importlib.import_module("sbx")
    with tempfile.TemporaryDirectory() as folder:
        callback = EvalCallback(
            Monitor(gymnasium.make(EASY)), n_eval_episodes=EPISODES, eval_freq=steps // 3, log_path=folder
        )
        model = module.PPO("MlpPolicy", gymnasium.make(EASY), seed=0)
        model.learn(steps, callback=callback)
        return {**evaluations(folder), "episodes": len(model.ep_info_buffer or ())}


def skrl(steps: int) -> Figures:
    """PPO on the vector environment, as skrl's examples put their models together."""
    ppo = importlib.import_module("skrl.agents.torch.ppo")
    models = importlib.import_module("skrl.models.torch")
    memories = importlib.import_module("skrl.memories.torch")
    trainers = importlib.import_module("skrl.trainers.torch")
    env = importlib.import_module("skrl.envs.wrappers.torch").wrap_env(gymnasium.make_vec(EASY, num_envs=16))

    class Policy(models.GaussianMixin, models.Model):  # type: ignore[name-defined,misc]
        def __init__(self) -> None:
            models.Model.__init__(
                self, observation_space=env.observation_space, action_space=env.action_space, device=env.device
            )
            models.GaussianMixin.__init__(self, clip_actions=True)
            self.net = mlp(self.num_observations, self.num_actions)
            self.log_std_parameter = torch.nn.Parameter(torch.full((self.num_actions,), -0.5))

        def compute(self, inputs: Mapping[str, Any], role: str) -> tuple[torch.Tensor, dict[str, Any]]:
            return torch.tanh(self.net(inputs["observations"])), {"log_std": self.log_std_parameter}

    class Value(models.DeterministicMixin, models.Model):  # type: ignore[name-defined,misc]
        def __init__(self) -> None:
            models.Model.__init__(
                self, observation_space=env.observation_space, action_space=env.action_space, device=env.device
            )
            models.DeterministicMixin.__init__(self)
            self.net = mlp(self.num_observations, 1)

        def compute(self, inputs: Mapping[str, Any], role: str) -> tuple[torch.Tensor, dict[str, Any]]:
            return self.net(inputs["observations"]), {}

    with tempfile.TemporaryDirectory() as folder:
        config = ppo.PPO_CFG(rollouts=128, mini_batches=32)
        config.experiment.directory = folder
        agent = ppo.PPO(
            models={"policy": Policy(), "value": Value()},
            memory=memories.RandomMemory(memory_size=128, num_envs=env.num_envs, device=env.device),
            cfg=config,
            observation_space=env.observation_space,
            action_space=env.action_space,
            device=env.device,
        )
        trainers.SequentialTrainer(cfg={"timesteps": steps // 16, "headless": True}, env=env, agents=agent).train()
    return {
        "success": success(lambda observations: agent.models["policy"].act({"observations": observations}, role="policy"))
    }


def mlp(inputs: int, outputs: int) -> torch.nn.Module:
    """Two hidden layers."""
    return torch.nn.Sequential(
        torch.nn.Linear(inputs, 64), torch.nn.Tanh(), torch.nn.Linear(64, 64), torch.nn.Tanh(), torch.nn.Linear(64, outputs)
    )


def success(act: Callable[[torch.Tensor], tuple[torch.Tensor, Mapping[str, Any]]]) -> float:
    """Share of episodes that arrive, by the mean action of a policy."""
    env, arrived = gymnasium.make(EASY), 0
    for episode in range(EPISODES):
        observation, _ = env.reset(seed=episode)
        ended = False
        while not ended:
            with torch.no_grad():
                action, more = act(torch.as_tensor(observation)[None])
            observation, _, terminated, truncated, info = env.step(more.get("mean_actions", action)[0].numpy())
            ended = terminated or truncated
        arrived += info["is_success"]
    return arrived / EPISODES


def cleanrl(script: Path, steps: int) -> Figures:
    """CleanRL's script as it is, in a process and a folder of its own."""
    with tempfile.TemporaryDirectory() as folder:
        arguments = [sys.executable, "-m", "benchmarks.standard_tools", "--run-cleanrl", str(script.resolve())]
        done = subprocess.run(
            [*arguments, folder, str(steps)], capture_output=True, text=True, check=False, cwd=Path(__file__).parents[1]
        )
    if done.returncode:
        raise RuntimeError(f"CleanRL's script ended with {done.returncode}: {done.stderr[-2000:]}")
    returns = [float(value) for value in re.findall(r"episodic_return=\[?([-+.\deE]+)", done.stdout)]
    tenth = max(1, len(returns) // 10)
    first, last = float(np.mean(returns[:tenth])), float(np.mean(returns[-tenth:]))
    return {"episodes": len(returns), "return_first_tenth": first, "return_last_tenth": last, "return_gained": last - first}


def run_cleanrl(script: str, folder: str, steps: str) -> None:
    """Run the script in this process, with the one argument that Gymnasium 1 asks for beside its own."""
    register_easy()
    os.chdir(folder)
    usual = gymnasium.wrappers.TransformObservation

    def transform(env: gymnasium.Env[Any, Any], func: Callable[[Any], Any], observation_space: Any = None) -> Any:
        return usual(env, func, observation_space)

    gymnasium.wrappers.TransformObservation = transform  # type: ignore[assignment,misc]
    sys.argv = [script, "--env-id", EASY, "--total-timesteps", steps, "--no-cuda", "--seed", "0"]
    runpy.run_path(script, run_name="__main__")


def main() -> None:
    """Run every tool that is there, and print what each counted."""
    if sys.argv[1:2] == ["--run-cleanrl"]:
        run_cleanrl(*sys.argv[2:5])
        return
    options = parser(__doc__)
    options.add_argument("--steps", type=int, default=STEPS)
    options.add_argument("--cleanrl", type=Path, help="the script of the commit above")
    arguments = options.parse_args()
    register_easy()
    torch.set_num_threads(1)
    tools: dict[str, Callable[[int], Figures]] = {"stable_baselines3": stable_baselines, "skrl": skrl, "sbx": sbx}
    figures: dict[str, float | str] = {"steps": arguments.steps}
    targets: dict[str, float] = {}
    for name, run in tools.items():
        if importlib.util.find_spec(name) is None:
            figures[name] = "not installed"
            continue
        figures |= {f"{name}_{key}": value for key, value in run(arguments.steps).items()}
        targets[f"{name}_success"] = AT_LEAST
    if arguments.cleanrl is None:
        figures["cleanrl"] = "no script given"
    else:
        figures |= {f"cleanrl_{key}": value for key, value in cleanrl(arguments.cleanrl, arguments.steps).items()}
        targets["cleanrl_return_gained"] = 0.0
    finish("standard_tools", figures, at_least=targets, check=arguments.check)


if __name__ == "__main__":
    main()

"""Stable-Baselines3 on our environment, with our networks and hyperparameters: the yardstick of the training benchmarks."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import torch
from gymnasium.spaces import Box
from numpy.typing import NDArray
from stable_baselines3 import DDPG, PPO, SAC, TD3
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.noise import NormalActionNoise
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from stable_baselines3.common.vec_env import VecEnv, VecNormalize
from torch import Tensor, nn

from sim.arrays import PolicyFunction
from sim.envs.vector import NavigationVectorEnv
from workers.config import (
    AddedAlgorithmConfig,
    DdpgConfig,
    MlpNetwork,
    PpoConfig,
    ResBlockNetwork,
    SacConfig,
    Td3Config,
    TrainingConfig,
)
from workers.networks.modules import build_network

Floats = NDArray[np.float32]


class Sb3Navigation(VecEnv):
    """`NavigationVectorEnv` behind Stable-Baselines3's interface, without a copy that it doesn't ask for."""

    def __init__(self, config: TrainingConfig, seed: int, reward_scale: float) -> None:
        self._env = NavigationVectorEnv(config.task, config.algorithm.robots, seed=seed)
        self._scale = np.float32(reward_scale)
        self._actions: Floats = np.zeros((self._env.num_envs, 2), np.float32)
        super().__init__(
            self._env.num_envs, self._env.single_observation_space, Box(np.array([0.0, -1.0], np.float32), np.float32(1.0))
        )

    def reset(self) -> Floats:
        """See `VecEnv.reset`."""
        observations, _ = self._env.reset()
        return observations

    def step_async(self, actions: Floats) -> None:
        """Keep the actions for `step_wait`."""
        self._actions = actions

    def step_wait(self) -> tuple[Floats, Floats, NDArray[np.bool_], list[dict[str, Any]]]:
        """See `VecEnv.step_wait`."""
        observations, rewards, terminations, truncations, _ = self._env.step(self._actions)
        dones = terminations | truncations
        infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
        for robot in np.flatnonzero(dones):
            infos[robot] = {
                "terminal_observation": self._env.final_observations[robot].copy(),
                "TimeLimit.truncated": bool(truncations[robot]),
            }
        return observations, rewards * self._scale, dones, infos

    def close(self) -> None:
        """See `VecEnv.close`."""
        self._env.close()

    def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
        """An attribute of the environment, once for each robot."""
        return [getattr(self._env, attr_name, None)] * self.num_envs

    def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
        """Refused: the robots share one environment."""
        raise AttributeError(f"{attr_name} cannot be set")

    def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
        """Refused: the robots share one environment."""
        raise AttributeError(f"{method_name} is not a method of the robots")

    def env_is_wrapped(self, wrapper_class: type[Any], indices: Any = None) -> list[bool]:
        """No robot is."""
        return [False] * self.num_envs

    def seed(self, seed: int | None = None) -> Sequence[int | None]:
        """The seed was given at construction."""
        return [seed] * self.num_envs


class ResBlockTrunk(BaseFeaturesExtractor):
    """The paper's network up to its head, which Stable-Baselines3 puts on top."""

    def __init__(self, observation_space: Box) -> None:
        size = observation_space.shape[0]
        super().__init__(observation_space, 4 * size)
        self._network = build_network(ResBlockNetwork(), size, 1)
        self._network.head = nn.Identity()

    def forward(self, observations: Tensor) -> Tensor:
        """(n, size) to (n, 4 size)."""
        output: Tensor = self._network(observations)
        return output


def build(config: TrainingConfig, seed: int) -> BaseAlgorithm:
    """The same training for Stable-Baselines3: same environment, networks, batches, rates and number of gradient steps."""
    algorithm = config.algorithm
    if isinstance(algorithm, AddedAlgorithmConfig):
        raise SystemExit(f"{algorithm.name} is not compared with Stable-Baselines3")
    layers = list(algorithm.network.hidden_sizes) if isinstance(algorithm.network, MlpNetwork) else []
    policy: dict[str, Any] = {"activation_fn": nn.ReLU}
    if not isinstance(algorithm.network, MlpNetwork):
        policy |= {"features_extractor_class": ResBlockTrunk, "share_features_extractor": False}
    common: dict[str, Any] = {"seed": seed, "device": "cpu", "gamma": algorithm.gamma}
    if isinstance(algorithm, PpoConfig):
        env = VecNormalize(Sb3Navigation(config, seed, 1.0), norm_obs=False, norm_reward=True, gamma=algorithm.gamma)
        rate = algorithm.learning_rate
        return PPO(
            "MlpPolicy",
            env,
            learning_rate=(lambda left: rate * left) if algorithm.learning_rate_schedule == "linear" else rate,
            n_steps=algorithm.rollout_steps,
            batch_size=algorithm.minibatch_size,
            n_epochs=algorithm.epochs,
            gae_lambda=algorithm.gae_lambda,
            clip_range=algorithm.clip_range,
            ent_coef=algorithm.entropy_coefficient,
            max_grad_norm=algorithm.max_grad_norm,
            # One deviation for both actions is all that it offers: the geometric mean of ours.
            policy_kwargs=policy
            | {
                "net_arch": {"pi": layers, "vf": layers},
                "log_std_init": 0.5 * float(np.log(algorithm.initial_std_linear * algorithm.initial_std_angular)),
            },
            **common,
        )
    # One rate for actor and critics, and no logit penalty: what it offers.
    critic_rate = algorithm.critic_learning_rate
    replay: dict[str, Any] = {
        "learning_rate": (
            (lambda left: critic_rate * left) if algorithm.learning_rate_schedule == "linear" else critic_rate
        ),
        "buffer_size": algorithm.replay_size,
        "learning_starts": algorithm.warmup_steps,
        "batch_size": algorithm.batch_size,
        "tau": algorithm.tau,
        "train_freq": (1, "step"),
        "gradient_steps": algorithm.updates_per_step,
        "policy_kwargs": policy | {"net_arch": layers},
        **common,
    }
    environment = Sb3Navigation(config, seed, algorithm.reward_scale)
    match algorithm:
        case SacConfig():
            return SAC(
                "MlpPolicy",
                environment,
                ent_coef=f"auto_{algorithm.initial_temperature}",
                target_entropy=algorithm.target_entropy,
                **replay,
            )
        case DdpgConfig() | Td3Config():
            # Its noise does not decay: about the mean of ours.
            noise = NormalActionNoise(np.zeros(2), np.full(2, 0.5 * algorithm.exploration_noise))
            if isinstance(algorithm, DdpgConfig):
                return DDPG("MlpPolicy", environment, action_noise=noise, **replay)
            return TD3("MlpPolicy", environment, action_noise=noise, policy_delay=algorithm.policy_delay, **replay)


def policy_of(model: BaseAlgorithm) -> PolicyFunction:
    """The model's deterministic policy."""

    def act(observations: Floats) -> Floats:
        with torch.no_grad():
            actions, _ = model.predict(observations, deterministic=True)
        return np.asarray(actions, np.float32)

    return act

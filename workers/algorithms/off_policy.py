"""What DDPG, TD3 and SAC share: a memory, uniform actions to fill it, several updates a step, slow target networks."""

from abc import ABC, abstractmethod
from collections.abc import Callable

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from sim.actions import ActionLayout
from workers.algorithms.base import Arrays, with_prefix, without_prefix
from workers.algorithms.flat import FlatAdam, FlatParameters
from workers.algorithms.storage.replay import ReplayBuffer, Transitions
from workers.config import OffPolicyConfig
from workers.networks.modules import take_weights

# The keys of `online` whose parameters another training may hand on.
_NETWORKS = ("actor", "critic")


class OffPolicyAlgorithm(ABC):
    """The frame around one update rule.

    Args:
        config: hyperparameters that the three algorithms share.
        online: what is trained, by the name under which its state is kept.
        targets: slow copies, by name.
        observation_size: numbers in an observation.
        actions: what an action is.
        generator: of exploration and of sampling, on the same device as the networks.
    """

    steps_per_update = 1

    def __init__(
        self,
        config: OffPolicyConfig,
        online: dict[str, FlatAdam],
        targets: dict[str, FlatParameters],
        observation_size: int,
        actions: ActionLayout,
        generator: torch.Generator,
    ) -> None:
        self.robots = config.robots
        self._shared = config
        self._online, self._targets = online, targets
        self._learning_rates = {name: adam.learning_rate for name, adam in online.items()}
        self._generator = generator
        self._device = generator.device
        self._replay = ReplayBuffer(config.replay_size, config.robots, observation_size, self._device, actions.size)
        self._observations = torch.zeros(config.robots, observation_size, device=self._device)
        self._actions = torch.zeros(config.robots, actions.size, device=self._device)
        self.action_layout = actions
        self._low, self._high = (
            torch.tensor(actions.lows, device=self._device),
            torch.ones(actions.size, device=self._device),
        )
        self._steps = 0
        self._progress = 0.0

    @abstractmethod
    def explore(self, observations: Tensor) -> Tensor:
        """Exploring actions (robots, A) for observations (robots, size), not yet clipped."""

    @abstractmethod
    def learn(self, batch: Transitions) -> dict[str, Tensor]:
        """One update from one minibatch; scalars under the project's metric names."""

    @abstractmethod
    def set_progress(self, progress: float) -> dict[str, float]:
        """Moves an algorithm's own schedules to a part of the training, 0 to 1; what to report of them."""

    @property
    def warming_up(self) -> bool:
        """Whether actions are still uniform and nothing is learned."""
        return self._steps < self._shared.warmup_steps

    @torch.no_grad()
    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """See `Algorithm.act`."""
        self._observations.copy_(torch.from_numpy(observations))
        if self.warming_up:
            uniform = torch.rand(self._actions.shape, generator=self._generator, device=self._device)
            self._actions.copy_(self._low + (self._high - self._low) * uniform)
        else:
            torch.clamp(self.explore(self._observations), self._low, self._high, out=self._actions)
        self._steps += self.robots
        actions: NDArray[np.float32] = self._actions.cpu().numpy()
        return actions

    def record(
        self,
        observations: NDArray[np.float32],
        rewards: NDArray[np.float32],
        terminations: NDArray[np.bool_],
        truncations: NDArray[np.bool_],
        final_observations: NDArray[np.float32],
    ) -> None:
        """See `Algorithm.record`."""
        ended = terminations | truncations
        following = np.where(ended[:, None], final_observations, observations) if ended.any() else observations
        self._replay.add(
            self._observations,
            self._actions,
            torch.from_numpy(rewards * np.float32(self._shared.reward_scale)),
            torch.from_numpy(~terminations),
            torch.from_numpy(following),
        )

    def update(self, progress: float) -> dict[str, float]:
        """See `Algorithm.update`."""
        schedules = self._schedule(progress)
        if self.warming_up:
            return schedules
        totals: dict[str, Tensor] = {}
        counts: dict[str, int] = {}
        for batch in self._replay.sample(self._shared.updates_per_step, self._shared.batch_size, self._generator):
            for name, value in self.learn(batch).items():
                totals[name] = totals[name] + value if name in totals else value
                counts[name] = counts.get(name, 0) + 1
        return schedules | {name: total.item() / counts[name] for name, total in totals.items()}

    def _schedule(self, progress: float) -> dict[str, float]:
        self._progress = progress
        left = 1.0 - progress if self._shared.learning_rate_schedule == "linear" else 1.0
        for name, adam in self._online.items():
            adam.learning_rate = left * self._learning_rates[name]
        return {"optim/learning_rate": left * self._shared.actor_learning_rate, **self.set_progress(progress)}

    def follow(self, target: str, online: str) -> None:
        """Moves a target network a little towards its original: target += tau (online - target)."""
        self._targets[target].values.lerp_(self._online[online].values, self._shared.tau)

    @torch.no_grad()
    def begin_with(self, weights: Arrays, state: Arrays | None) -> tuple[str, ...]:
        """See `Algorithm.begin_with`: target networks begin as copies; memory, noise and temperature as configured."""
        take_weights(self.policy_network, weights)
        fits = state is not None and all(
            state[f"{name}/values"].shape == tuple(self._online[name].values.shape) for name in _NETWORKS
        )
        if fits and state is not None:
            for name in _NETWORKS:
                self._online[name].take_over(state[f"{name}/values"])
        for name, target in self._targets.items():
            target.values.copy_(self._online[name.removeprefix("target_")].values)
        return ("critics",) if fits else ()

    @property
    @abstractmethod
    def policy_network(self) -> nn.Module:
        """The network whose first outputs are the deterministic policy's."""

    @property
    def finite(self) -> bool:
        """See `Algorithm.finite`."""
        return all(parameters.finite for parameters in self._online.values())

    @abstractmethod
    def policy_weights(self) -> dict[str, NDArray[np.float32]]:
        """See `Algorithm.policy_weights`."""

    def state(self) -> dict[str, NDArray[np.generic]]:
        """See `Algorithm.state`."""
        return {**with_prefix("replay", self._replay.state()), **self._state_but_replay()}

    def snapshot(self) -> Callable[[], dict[str, NDArray[np.generic]]]:
        """See `Algorithm.snapshot`: the memory, which is nearly all of the state, is not copied."""
        self._replay.mark()
        rest = self._state_but_replay()
        return lambda: {**with_prefix("replay", self._replay.marked_state()), **rest}

    def _state_but_replay(self) -> dict[str, NDArray[np.generic]]:
        state: dict[str, NDArray[np.generic]] = {
            "generator": self._generator.get_state().numpy().copy(),
            "steps": np.array(self._steps),
            "progress": np.array(self._progress),
        }
        for name, adam in self._online.items():
            state |= with_prefix(name, adam.state())
        for name, target in self._targets.items():
            state[name] = target.values.cpu().numpy().copy()
        return state

    def load_state(self, state: Arrays) -> None:
        """See `Algorithm.load_state`."""
        self._replay.load_state(without_prefix("replay", state))
        self._generator.set_state(torch.from_numpy(np.array(state["generator"], np.uint8)))
        self._steps = int(state["steps"])
        self._schedule(float(state["progress"]))
        for name, adam in self._online.items():
            adam.load_state(without_prefix(name, state))
        for name, target in self._targets.items():
            target.values.copy_(torch.from_numpy(np.array(state[name], np.float32)))

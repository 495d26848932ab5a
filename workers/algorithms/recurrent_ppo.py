"""PPO with networks that remember: backpropagation through time, truncated to sequences of a fixed length.

Actor and critic remember apart from one another. Memory is zeros where an episode begins, goes on from rollout to rollout,
and is kept as it was at the first step of each sequence: gradients end there. (The 'stored state' of Hausknecht & Stone 2015
and Kapturowski et al. 2019.) A minibatch is so many whole sequences of any robots.
"""

from collections.abc import Iterator

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from workers.algorithms.base import Arrays
from workers.algorithms.gradients.ppo import AutogradPpo
from workers.algorithms.ppo import Ppo
from workers.algorithms.storage.rollout import RolloutStorage, Samples
from workers.config import PpoConfig, RecurrentNetworkConfig
from workers.networks.modules import Described, GaussianActor
from workers.networks.squashing import bound_actions


class RecurrentGradients(AutogradPpo):
    """The losses of PPO over sequences; minibatches are rows (steps, sequences).

    Attributes:
        starts: (steps, robots, memory) of actor and critic; only the first step of each sequence is read.
        keep: (steps, robots, 1), 0 where an episode begins, else 1.
    """

    def __init__(
        self, config: PpoConfig, actor: GaussianActor, critic: Described, starts: list[Tensor], keep: Tensor
    ) -> None:
        super().__init__(actor, critic, config.clip_range, config.entropy_coefficient)
        self.starts, self.keep = starts, keep
        self._networks = (actor.network, critic)

    def predict(self, batch: Samples, rows: Tensor) -> tuple[Tensor, Tensor]:
        """See `AutogradPpo.predict`."""
        keep = self.keep.flatten(0, 1)[rows]
        seen = batch.observations, batch.critic_observations
        outputs = []
        for network, starts, observations in zip(self._networks, self.starts, seen, strict=True):
            assert isinstance(network, Described)
            sequences = observations.view(*rows.shape, -1)
            outputs.append(network.unroll(sequences, starts.flatten(0, 1)[rows[0]], keep).flatten(0, 1))
        logits, values = outputs
        return bound_actions(logits, self._actor.actions), values[:, 0]


class RecurrentPpo(Ppo):
    """PPO whose networks remember; see `Ppo` for the arguments."""

    critic: Described

    def __init__(
        self,
        config: PpoConfig,
        actor: GaussianActor,
        critic: Described,
        storage: RolloutStorage,
        generator: torch.Generator,
    ) -> None:
        assert isinstance(config.network, RecurrentNetworkConfig)
        self._length = config.network.sequence_length
        steps, robots, size = storage.steps, storage.robots, critic.memory_size
        self._memories = [torch.zeros(robots, size, device=storage.device) for _ in range(2)]
        self._starts = [torch.zeros(steps, robots, size, device=storage.device) for _ in range(2)]
        self._keep = torch.ones(steps, robots, 1, device=storage.device)
        self._seen = torch.zeros(steps + 1, robots, device=storage.device)
        self._final_values: list[Tensor] = []
        super().__init__(
            config, actor, critic, storage, generator, RecurrentGradients(config, actor, critic, self._starts, self._keep)
        )

    def logits(self, observations: Tensor) -> Tensor:
        """See `Ppo.logits`; the critic looks on, so that it remembers the same episode."""
        step = self.storage.step
        for start, memory in zip(self._starts, self._memories, strict=True):
            start[step] = memory
        logits, self._memories[0] = self.actor.network(observations, self._memories[0])
        values, self._memories[1] = self.critic(self.storage.critic_observations[step], self._memories[1])
        self._seen[step] = values[:, 0]
        assert isinstance(logits, Tensor)
        return logits

    @torch.no_grad()
    def record(
        self,
        observations: NDArray[np.float32],
        rewards: NDArray[np.float32],
        terminations: NDArray[np.bool_],
        truncations: NDArray[np.bool_],
        final_observations: NDArray[np.float32],
    ) -> None:
        """See `Algorithm.record`."""
        cut = np.flatnonzero(truncations & ~terminations)
        if cut.size:
            last = final_observations[cut]
            if self.guidance is not None:
                last = np.concatenate((last, self.guidance.final[cut]), axis=1)
            seen = torch.from_numpy(last).to(self.storage.device)
            self._final_values.append(self.critic(seen, self._memories[1][torch.from_numpy(cut)])[0][:, 0])
        keep = torch.from_numpy(~(terminations | truncations)).to(self.storage.device, torch.float32)[:, None]
        for memory in self._memories:
            memory.mul_(keep)
        super().record(observations, rewards, terminations, truncations, final_observations)
        if not self.storage.full:
            self._keep[self.storage.step] = keep
            return
        # Looked at only: the next rollout begins with the same observation.
        values, _ = self.critic(self.storage.critic_observations[-1], self._memories[1])
        self._seen[-1] = values[:, 0]

    def update(self, progress: float) -> dict[str, float]:
        """See `Algorithm.update`."""
        diagnostics = super().update(progress)
        self._final_values.clear()
        return diagnostics

    def minibatches(self) -> Iterator[Tensor]:
        """Rows (steps, sequences) of the rollout's samples, every sequence once, in a new order."""
        robots, length = self.storage.robots, self._length
        sequences = self.storage.steps // length * robots
        order = torch.randperm(sequences, generator=self._generator, device=self.storage.device)
        steps = torch.arange(length, device=self.storage.device)[:, None] * robots
        for chosen in order.split(max(1, self.config.minibatch_size // length)):
            yield chosen // robots * (length * robots) + chosen % robots + steps

    def values(self) -> Tensor:
        """See `Ppo.values`: as they were seen on the way, since weights do not change during a rollout."""
        return self._seen.clone()

    def final_values(self, observations: Tensor) -> Tensor:
        """See `Ppo.final_values`."""
        return torch.cat(self._final_values)

    def state(self) -> dict[str, NDArray[np.generic]]:
        """See `Algorithm.state`."""
        actor, critic = (memory.cpu().numpy().copy() for memory in self._memories)
        return {**super().state(), "memory/actor": actor, "memory/critic": critic}

    def load_state(self, state: Arrays) -> None:
        """See `Algorithm.load_state`."""
        super().load_state(state)
        self._final_values.clear()
        for memory, name in zip(self._memories, ("memory/actor", "memory/critic"), strict=True):
            memory.copy_(torch.from_numpy(np.array(state[name], np.float32)))

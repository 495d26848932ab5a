"""Twin Delayed DDPG (Fujimoto et al. 2018, 'Addressing function approximation error in actor-critic methods').

The lines of its Algorithm 1 are named in `Td3.learn`.
"""

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from sim.actions import DEFAULT_ACTIONS, ActionLayout
from sim.streams import EXPLORATION, stream_seed
from workers.algorithms.base import Arrays
from workers.algorithms.ddpg import NoisyPolicy, build_noisy_networks
from workers.algorithms.gradients.actor_critic import action_value
from workers.algorithms.storage.replay import Transitions
from workers.config import Td3Config
from workers.networks.inputs import Inputs


class Td3(NoisyPolicy):
    """TD3: two critics, a smoothed target, an actor that waits for them."""

    config: Td3Config
    _updates = 0

    def learn(self, batch: Transitions) -> dict[str, Tensor]:
        """See `OffPolicyAlgorithm.learn`."""
        config = self.config
        with torch.no_grad():
            # a~ <- pi'(s') + eps, eps ~ clip(N(0, sigma), -c, c)
            limit = config.target_noise_clip * self._half_range
            noise = torch.clamp(config.target_noise * self.normal(tuple(batch.actions.shape)), -limit, limit)
            next_actions = self.target_actor(batch.next_observations) + noise
            next_actions = torch.clamp(next_actions, self._low, self._high)
            # y <- r + gamma min_{i=1,2} Q'_i(s', a~)
            following = torch.minimum(
                *(action_value(critic, batch.next_observations, next_actions) for critic in self.target_critics)
            )
            targets = batch.rewards + config.gamma * batch.continues * following

        # Update critics theta_i <- argmin 1/N sum (y - Q_i(s, a))^2
        critic_loss = self.gradients.critics(batch, targets)
        self.critic_optimizer.step()
        losses = {"loss/value": critic_loss, "value/mean": targets.mean()}

        # if t mod d then
        self._updates += 1
        if self._updates % config.policy_delay == 0:
            # Update phi by the deterministic policy gradient 1/N sum grad_a Q_1(s, a) grad pi(s)
            losses["loss/policy"] = self.gradients.actor(batch.observations)
            self.actor_optimizer.step()
            # Update target networks
            self.follow("target_critic", "critic")
            self.follow("target_actor", "actor")
        return losses

    def state(self) -> dict[str, NDArray[np.generic]]:
        """See `Algorithm.state`."""
        return {**super().state(), "updates": np.array(self._updates)}

    def load_state(self, state: Arrays) -> None:
        """See `Algorithm.load_state`."""
        super().load_state(state)
        self._updates = int(state["updates"])


def build_td3(
    config: Td3Config, inputs: Inputs | int, seed: int, device: torch.device, actions: ActionLayout = DEFAULT_ACTIONS
) -> Td3:
    """TD3 with freshly initialised networks."""
    actor, critics = build_noisy_networks(config, 2, inputs, seed, device, actions)
    return Td3(config, actor, critics, torch.Generator(device).manual_seed(stream_seed(seed, EXPLORATION)))

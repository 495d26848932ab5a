"""Soft Actor-Critic with a learned temperature (Haarnoja et al. 2018, 'Soft actor-critic algorithms and applications').

The lines of its Algorithm 1 are named in `Sac.learn`. The policy squashes a normal variable u as `bound_actions`
does; its deterministic form squashes the mean, so that the exported policy is a network with the same heads as every other
algorithm's.
"""

import copy
import math

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from sim.actions import DEFAULT_ACTIONS, ActionLayout
from sim.streams import EXPLORATION, WEIGHTS, stream_seed
from workers.algorithms.flat import FlatAdam, FlatParameters
from workers.algorithms.gradients.actor_critic import action_value
from workers.algorithms.gradients.sac import SacGradients, fastest_gradients, squashed_sample
from workers.algorithms.off_policy import OffPolicyAlgorithm
from workers.algorithms.storage.replay import Transitions
from workers.config import SacConfig
from workers.errors import NetworkError
from workers.networks.inputs import Inputs, as_inputs
from workers.networks.layout import policy_shapes
from workers.networks.modules import build_network


class Temperature(nn.Module):
    """The weight of entropy, kept as its logarithm so that it stays positive."""

    def __init__(self, initial: float) -> None:
        super().__init__()
        self.log_alpha = nn.Parameter(torch.tensor([math.log(initial)]))


class Sac(OffPolicyAlgorithm):
    """SAC.

    Args:
        config: hyperparameters.
        actor: observations (n, size) to mean and logarithm of the deviation of u, (n, 2 A).
        critics: two networks of observation and action.
        inputs: what an observation is.
        actions: what an action is.
        generator: of exploration and of sampling.
    """

    def __init__(
        self,
        config: SacConfig,
        actor: nn.Module,
        critics: tuple[nn.Module, ...],
        inputs: Inputs,
        actions: ActionLayout,
        generator: torch.Generator,
    ) -> None:
        self.config, self.actor, self.critics = config, actor, critics
        self._policy_shapes = policy_shapes(config.network, inputs, actions)
        self.temperature = Temperature(config.initial_temperature).to(generator.device)
        self.target_critics = copy.deepcopy(critics)
        self.actor_optimizer = FlatAdam(actor, learning_rate=config.actor_learning_rate)
        self.critic_optimizer = FlatAdam(*critics, learning_rate=config.critic_learning_rate)
        self.temperature_optimizer = FlatAdam(self.temperature, learning_rate=config.actor_learning_rate)
        super().__init__(
            config,
            online={
                "actor": self.actor_optimizer,
                "critic": self.critic_optimizer,
                "temperature": self.temperature_optimizer,
            },
            targets={"target_critic": FlatParameters(*self.target_critics)},
            observation_size=inputs.size,
            actions=actions,
            generator=generator,
        )
        self.gradients: SacGradients = fastest_gradients(
            actor, critics, self.actor_optimizer, self.critic_optimizer, config.batch_size, actions
        )

    def sample(self, observations: Tensor) -> tuple[Tensor, Tensor]:
        """Actions (n, A) of observations (n, size), and their log densities (n, 1)."""
        return squashed_sample(self.actor(observations), self._noise(len(observations)), self.action_layout)

    def explore(self, observations: Tensor) -> Tensor:
        """See `OffPolicyAlgorithm.explore`."""
        return self.sample(observations)[0]

    def learn(self, batch: Transitions) -> dict[str, Tensor]:
        """See `OffPolicyAlgorithm.learn`."""
        config = self.config
        alpha = self.temperature.log_alpha.detach().exp()

        # theta_i <- theta_i - lambda_Q grad J_Q(theta_i), J_Q and its target from Eq. 5 and 6
        with torch.no_grad():
            next_actions, next_log_probs = self.sample(batch.next_observations)
            following = torch.minimum(
                *(action_value(critic, batch.next_observations, next_actions) for critic in self.target_critics)
            )
            targets = batch.rewards + config.gamma * batch.continues * (following - alpha * next_log_probs)
        critic_loss = self.gradients.critics(batch, targets)
        self.critic_optimizer.step()

        # phi <- phi - lambda_pi grad J_pi(phi), Eq. 10
        actor_loss, log_probs = self.gradients.actor(batch.observations, self._noise(len(batch.observations)), alpha)
        self.actor_optimizer.step()

        # alpha <- alpha - lambda grad J(alpha), Eq. 18, by the logarithm of alpha: J = -log(alpha) (log pi + target)
        self.temperature_optimizer.gradients.fill_(-(log_probs.mean() + config.target_entropy))
        self.temperature_optimizer.step()

        # target_i <- tau theta_i + (1 - tau) target_i
        self.follow("target_critic", "critic")
        return {
            "loss/policy": actor_loss,
            "loss/value": critic_loss,
            "value/mean": targets.mean(),
            "policy/entropy": -log_probs.mean(),
            "policy/temperature": alpha.sum(),
        }

    def _noise(self, rows: int) -> Tensor:
        return torch.randn((rows, self.action_layout.size), generator=self._generator, device=self._device)

    def set_progress(self, progress: float) -> dict[str, float]:
        """See `OffPolicyAlgorithm.set_progress`: the temperature sees to exploration."""
        return {}

    @property
    def policy_network(self) -> nn.Module:
        """See `OffPolicyAlgorithm.policy_network`: outputs after the means make the deviations."""
        return self.actor

    def policy_weights(self) -> dict[str, NDArray[np.float32]]:
        """See `Algorithm.policy_weights`: without the head's rows that make the deviation."""
        weights = {name: tensor.cpu().numpy() for name, tensor in self.actor.state_dict().items()}
        return {name: weights[name][: shape[0]].copy() for name, shape in self._policy_shapes.items()}


def build_sac(
    config: SacConfig, inputs: Inputs | int, seed: int, device: torch.device, actions: ActionLayout = DEFAULT_ACTIONS
) -> Sac:
    """SAC with freshly initialised networks; the same seed gives the same weights on every device."""
    inputs = as_inputs(inputs)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(stream_seed(seed, WEIGHTS))
        actor = build_network(config.network, inputs, 2 * actions.size).to(device)
        critics = tuple(build_network(config.network, inputs.and_also(actions.size), 1).to(device) for _ in range(2))
    for name, shape in policy_shapes(config.network, inputs, actions).items():
        if tuple(actor.get_parameter(name).shape[1:]) != shape[1:]:
            raise NetworkError(
                f"SAC needs a network whose last layer alone depends on its outputs, unlike {name} of this one"
            )
    generator = torch.Generator(device).manual_seed(stream_seed(seed, EXPLORATION))
    return Sac(config, actor, critics, inputs, actions, generator)

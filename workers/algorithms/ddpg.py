"""Deep Deterministic Policy Gradient (Lillicrap et al. 2016, 'Continuous control with deep reinforcement learning').

The lines of its Algorithm 1 are named in `Ddpg.learn`. Different here: noise is uncorrelated and decays (its
Ornstein-Uhlenbeck process gains nothing on this task), all robots act at once, the critic sees actions from its first
layer on, learning rates may decay, and a penalty keeps the actor's logits small (`actor_critic_gradients`).
"""

import copy

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from sim.actions import DEFAULT_ACTIONS, ActionLayout
from sim.streams import EXPLORATION, WEIGHTS, stream_seed
from workers.algorithms.flat import FlatAdam, FlatParameters
from workers.algorithms.gradients.actor_critic import ActorCriticGradients, action_value, fastest_gradients
from workers.algorithms.off_policy import OffPolicyAlgorithm
from workers.algorithms.storage.replay import Transitions
from workers.config import DdpgConfig, Td3Config
from workers.networks.inputs import Inputs, as_inputs
from workers.networks.modules import DeterministicActor, build_network


class NoisyPolicy(OffPolicyAlgorithm):
    """A deterministic actor with decaying noise: what DDPG and TD3 have in common."""

    def __init__(
        self,
        config: DdpgConfig | Td3Config,
        actor: DeterministicActor,
        critics: tuple[nn.Module, ...],
        generator: torch.Generator,
    ) -> None:
        self.config, self.actor, self.critics = config, actor, critics
        self.target_actor, self.target_critics = copy.deepcopy(actor), copy.deepcopy(critics)
        self.actor_optimizer = FlatAdam(actor, learning_rate=config.actor_learning_rate)
        self.critic_optimizer = FlatAdam(*critics, learning_rate=config.critic_learning_rate)
        super().__init__(
            config,
            online={"actor": self.actor_optimizer, "critic": self.critic_optimizer},
            targets={
                "target_actor": FlatParameters(self.target_actor),
                "target_critic": FlatParameters(*self.target_critics),
            },
            observation_size=actor.observation_size,
            actions=actor.actions,
            generator=generator,
        )
        self.gradients: ActorCriticGradients = fastest_gradients(
            actor, critics, self.actor_optimizer, self.critic_optimizer, config.batch_size, config.logit_penalty
        )
        self._noise = config.exploration_noise
        self._half_range = torch.tensor(actor.actions.half_spans, device=generator.device)

    def explore(self, observations: Tensor) -> Tensor:
        """See `OffPolicyAlgorithm.explore`."""
        actions: Tensor = self.actor(observations)
        return actions + self._noise * self.normal((len(observations), self.action_layout.size))

    def normal(self, shape: tuple[int, ...]) -> Tensor:
        """Standard normal noise in halves of the actions' ranges."""
        return self._half_range * torch.randn(shape, generator=self._generator, device=self._device)

    def set_progress(self, progress: float) -> dict[str, float]:
        """See `OffPolicyAlgorithm.set_progress`."""
        first, last = self.config.exploration_noise, self.config.final_exploration_noise
        self._noise = first + (last - first) * progress
        layout = self.action_layout
        return {f"policy/std_{name}": half * self._noise for name, half in zip(layout.names, layout.half_spans, strict=True)}

    @property
    def policy_network(self) -> nn.Module:
        """See `OffPolicyAlgorithm.policy_network`."""
        return self.actor.network

    def policy_weights(self) -> dict[str, NDArray[np.float32]]:
        """See `Algorithm.policy_weights`."""
        return {name: tensor.cpu().numpy().copy() for name, tensor in self.actor.network.state_dict().items()}


class Ddpg(NoisyPolicy):
    """DDPG."""

    def learn(self, batch: Transitions) -> dict[str, Tensor]:
        """See `OffPolicyAlgorithm.learn`."""
        # Set y_i = r_i + gamma Q'(s_{i+1}, mu'(s_{i+1}))
        with torch.no_grad():
            next_actions = self.target_actor(batch.next_observations)
            following = action_value(self.target_critics[0], batch.next_observations, next_actions)
            targets = batch.rewards + self.config.gamma * batch.continues * following

        # Update critic by minimizing the loss L = 1/N sum_i (y_i - Q(s_i, a_i))^2
        critic_loss = self.gradients.critics(batch, targets)
        self.critic_optimizer.step()

        # Update the actor policy using the sampled policy gradient 1/N sum_i grad_a Q(s_i, a) grad mu(s_i)
        actor_loss = self.gradients.actor(batch.observations)
        self.actor_optimizer.step()

        # Update the target networks
        self.follow("target_critic", "critic")
        self.follow("target_actor", "actor")
        return {"loss/policy": actor_loss, "loss/value": critic_loss, "value/mean": targets.mean()}


def build_noisy_networks(
    config: DdpgConfig | Td3Config,
    critics: int,
    inputs: Inputs | int,
    seed: int,
    device: torch.device,
    actions: ActionLayout,
) -> tuple[DeterministicActor, tuple[nn.Module, ...]]:
    """Actor and critics, freshly initialised; the same seed gives the same weights on every device."""
    inputs = as_inputs(inputs)
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(stream_seed(seed, WEIGHTS))
        actor = DeterministicActor(build_network(config.network, inputs, actions.size), inputs.size, actions)
        networks = [build_network(config.network, inputs.and_also(actions.size), 1) for _ in range(critics)]
    return actor.to(device), tuple(network.to(device) for network in networks)


def build_ddpg(
    config: DdpgConfig, inputs: Inputs | int, seed: int, device: torch.device, actions: ActionLayout = DEFAULT_ACTIONS
) -> Ddpg:
    """DDPG with freshly initialised networks."""
    actor, critics = build_noisy_networks(config, 1, inputs, seed, device, actions)
    return Ddpg(config, actor, critics, torch.Generator(device).manual_seed(stream_seed(seed, EXPLORATION)))

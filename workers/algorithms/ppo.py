"""Proximal Policy Optimization (Schulman et al. 2017), with the actor-critic losses of its section 5.

Implementation details that matter (Huang et al. 2022, 'The 37 implementation details of PPO', by their numbers there):
vectorised collection (1), Adam's learning rate annealed (4), generalised advantages (5), minibatches from a shuffled rollout
(6), advantages normalised (7; here over the rollout), the clipped surrogate (8), gradient clipping (11; here for actor and
critic each), returns scaled (continuous control, 3), state-independent deviation (2). Not used: value clipping (9), shared
layers (14), orthogonal initialisation (2).

Read `workers.algorithms.plain_ppo` first: the same on one page.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import nn

from sim.actions import DEFAULT_ACTIONS, ActionLayout
from sim.engine.guidance import GUIDANCE_SIZE, Guidance
from sim.engine.stretches import Crew
from sim.streams import EXPLORATION, WEIGHTS, stream_seed
from workers.algorithms.base import Arrays, with_prefix, without_prefix
from workers.algorithms.flat import FlatAdam
from workers.algorithms.gradients.ppo import AutogradPpo, PpoGradients, WrittenPpo, entropy, log_prob
from workers.algorithms.graphed import GraphedMinibatches
from workers.algorithms.storage.return_scaler import ReturnScaler
from workers.algorithms.storage.rollout import RolloutStorage, Samples, generalized_advantages
from workers.config import PpoConfig, RecurrentNetworkConfig
from workers.kernels.ppo import ACTOR, BOTH, CRITIC
from workers.networks.compiled import Inference, is_compiled
from workers.networks.inputs import Inputs, as_inputs
from workers.networks.modules import Described, GaussianActor, build_network, take_weights
from workers.networks.squashing import bound_actions

# A deviation between 1.8 % and 270 % of the action's unit: beyond either, exploration is none or all.
LOG_STD_RANGE = (-4.0, 1.0)

_EPSILON = 1e-8


class Ppo:
    """PPO with a Gaussian actor and a separate critic.

    Args:
        config: hyperparameters.
        actor: the policy, on `storage.device`.
        critic: observations (n, size), and what it alone is told, to values (n, 1), on the same device.
        storage: for one rollout of `config.rollout_steps` steps of `config.robots` robots.
        generator: of exploration and of the order of minibatches, on the same device.
        gradients: how a minibatch's gradients are computed; None is the fastest way that there is.

    Attributes:
        is_guided: whether the critic is told the shortest paths.
        guidance: which these are, where it is.
        graphed: how minibatches are learned on a CUDA device; None: kernel by kernel, as on every other.
    """

    def __init__(
        self,
        config: PpoConfig,
        actor: GaussianActor,
        critic: nn.Module,
        storage: RolloutStorage,
        generator: torch.Generator,
        gradients: PpoGradients | None = None,
    ) -> None:
        self.config = config
        self.actor, self.critic, self.storage = actor, critic, storage
        self.robots, self.steps_per_update = config.robots, config.rollout_steps
        self._generator = generator
        self._optimizer = FlatAdam(actor, critic, learning_rate=config.learning_rate)
        self._gradients = gradients or fastest_gradients(config, actor, critic)
        self._see, self._judge = (Inference(network, config.robots) for network in (actor.network, critic))
        self.graphed: GraphedMinibatches | None = None
        if storage.device.type == "cuda" and all(isinstance(network, Described) for network in (actor.network, critic)):
            self.graphed = GraphedMinibatches(self._gradients, self._optimizer, config.max_grad_norm)
        self._scaler = ReturnScaler(config.robots, config.gamma)
        self._crew = Crew()
        self.is_guided = config.critic_sees == "path"
        self.guidance: Guidance | None = None

    @property
    def threads(self) -> int:
        """Of all that follows, bit for bit alike.

        Where compiled passes are known networks see some of the robots on each, and with 2 the actor learns beside the
        critic.
        """
        return self._crew.threads

    @threads.setter
    def threads(self, threads: int) -> None:
        # Made anew each time: a thread flushes denormal numbers as the one did that started it.
        self._crew = Crew(threads)

    @torch.no_grad()
    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """See `Algorithm.act`."""
        storage, step = self.storage, self.storage.step
        storage.see(step, observations, None if self.guidance is None else self.guidance.now)
        storage.noise[step].normal_(generator=self._generator)
        mean = bound_actions(self.logits(storage.observations[step]), self.actor.actions)
        torch.addcmul(mean, storage.noise[step], torch.exp(self.actor.log_std), out=storage.actions[step])
        actions: NDArray[np.float32] = storage.actions[step].cpu().numpy()
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
        now, final = (None, None) if self.guidance is None else (self.guidance.now, self.guidance.final)
        self.storage.add_outcome(rewards, terminations, truncations, final_observations, final)
        if self.storage.full:
            self.storage.see(-1, observations, now)

    @torch.no_grad()
    def update(self, progress: float) -> dict[str, float]:
        """See `Algorithm.update`; needs a full rollout."""
        config, storage = self.config, self.storage
        if config.learning_rate_schedule == "linear":
            self._optimizer.learning_rate = config.learning_rate * (1.0 - progress)

        values, advantages = self._estimate()
        returns = advantages + values[:-1]
        explained_variance = 1.0 - (advantages.var() / (returns.var() + _EPSILON)).item()
        normalised = (advantages - advantages.mean()) / (advantages.std() + _EPSILON)
        samples = storage.samples(log_prob(storage.noise, self.actor.log_std), normalised, returns)

        minibatches = [minibatch for _ in range(config.epochs) for minibatch in self.minibatches()]
        if isinstance(self._gradients, WrittenPpo):
            totals = self._learn_compiled(self._gradients, samples, minibatches, log_std_range(config, progress))
        elif self.graphed is not None:
            limits = log_std_range(config, progress)
            totals = self.graphed.learn(samples, minibatches, lambda: self.actor.log_std.clamp_(*limits))
        else:
            totals = self._learn(samples, minibatches, log_std_range(config, progress))
        storage.clear()

        policy_loss, value_loss, kl, clip_fraction = (totals / len(minibatches)).tolist()
        deviations = zip(self.actor.actions.names, self.actor.log_std.exp().tolist(), strict=True)
        return {
            "loss/policy": policy_loss,
            "loss/value": value_loss,
            "policy/kl": kl,
            "policy/entropy": entropy(self.actor.log_std).item(),
            "policy/clip_fraction": clip_fraction,
            **{f"policy/std_{name}": deviation for name, deviation in deviations},
            "value/explained_variance": explained_variance,
            "optim/learning_rate": self._optimizer.learning_rate,
        }

    def _learn(self, samples: Samples, minibatches: Iterable[torch.Tensor], limits: tuple[float, float]) -> torch.Tensor:
        """One step of both networks for each minibatch; the sums (4,) of what `PpoGradients` returns."""
        totals = torch.zeros(4, dtype=torch.float64, device=self.storage.device)
        for minibatch in minibatches:
            totals += self._gradients(samples, minibatch)
            self._optimizer.clip_gradients(self.config.max_grad_norm)
            self._optimizer.step()
            self.actor.log_std.clamp_(*limits)
        return totals

    def _learn_compiled(
        self,
        gradients: WrittenPpo,
        samples: Samples,
        minibatches: Sequence[torch.Tensor],
        limits: tuple[float, float],
    ) -> torch.Tensor:
        """The same in one call; on two threads bit for bit alike, since neither network looks at the other."""
        steps = self._optimizer.next_steps(len(minibatches), self.config.max_grad_norm)
        if self.threads == 1:
            return gradients.learn(BOTH, samples, minibatches, steps, limits)
        of_actor, of_critic = self._crew.share(
            lambda part: gradients.learn((ACTOR, CRITIC)[part], samples, minibatches, steps, limits), 2
        )
        return of_actor + of_critic

    def minibatches(self) -> Iterator[torch.Tensor]:
        """The rows of the rollout's samples once, in a new order."""
        rows = self.storage.steps * self.storage.robots
        order = torch.randperm(rows, generator=self._generator, device=self.storage.device)
        yield from order.split(self.config.minibatch_size)

    def logits(self, observations: torch.Tensor) -> torch.Tensor:
        """What the actor's network puts out (robots, outputs) for what they see in the step that is due."""
        return self._see(observations, self._crew)

    def values(self) -> torch.Tensor:
        """Values (steps + 1, robots) of what the critic saw in the rollout."""
        if self.storage.device.type == "cuda":  # has room for all at once, and each launch costs
            every: torch.Tensor = self.critic(self.storage.critic_observations.flatten(0, 1))
            return every.view(self.storage.steps + 1, self.robots)
        # Some at a time: whole rollouts of a wide layer's activations would go through memory instead of a core's cache.
        values = self._judge(self.storage.critic_observations.flatten(0, 1), self._crew)
        return values.view(self.storage.steps + 1, self.robots)

    def final_values(self, observations: torch.Tensor) -> torch.Tensor:
        """Values (k,) of what the critic saw (k, size) where the step limit cut episodes."""
        values: torch.Tensor = self.critic(observations)[:, 0]
        return values

    def _estimate(self) -> tuple[torch.Tensor, torch.Tensor]:
        """Values (steps + 1, robots) and advantages (steps, robots) of the rollout, in scaled rewards."""
        config, storage = self.config, self.storage
        if config.scale_returns:
            self._scaler.update(storage.rewards, storage.dones)
        scale = self._scaler.scale if config.scale_returns else 1.0
        rewards = storage.rewards * np.float32(scale)
        steps, robots, final_observations = storage.truncations()
        if steps.size:
            rewards[steps, robots] += np.float32(config.gamma) * self.final_values(final_observations).cpu().numpy()
        values = self.values()
        advantages = generalized_advantages(rewards, values.cpu().numpy(), storage.dones, config.gamma, config.gae_lambda)
        return values, torch.from_numpy(advantages).to(storage.device)

    @property
    def finite(self) -> bool:
        """See `Algorithm.finite`."""
        return self._optimizer.finite

    def policy_weights(self) -> dict[str, NDArray[np.float32]]:
        """See `Algorithm.policy_weights`."""
        return {name: tensor.cpu().numpy().copy() for name, tensor in self.actor.network.state_dict().items()}

    @torch.no_grad()
    def begin_with(self, weights: Arrays, state: Arrays | None) -> tuple[str, ...]:
        """See `Algorithm.begin_with`: deviations begin as configured, the scale of returns counts as one rollout."""
        take_weights(self.actor.network, weights)
        if state is None or state["optimizer/values"].shape != tuple(self._optimizer.values.shape):
            return ()
        log_std = self.actor.log_std.clone()
        self._optimizer.take_over(state["optimizer/values"])
        self.actor.log_std.copy_(log_std)
        self._scaler.take_over(without_prefix("scaler", state), self.storage.steps * self.robots)
        return "critic", "scale of returns"

    def state(self) -> dict[str, NDArray[np.generic]]:
        """See `Algorithm.state`; only between an update and the next `act`."""
        return {
            **with_prefix("optimizer", self._optimizer.state()),
            **with_prefix("scaler", self._scaler.state()),
            "generator": self._generator.get_state().numpy().copy(),
        }

    def snapshot(self) -> Callable[[], dict[str, NDArray[np.generic]]]:
        """See `Algorithm.snapshot`."""
        state = self.state()
        return lambda: state

    def load_state(self, state: Arrays) -> None:
        """See `Algorithm.load_state`."""
        self._optimizer.load_state(without_prefix("optimizer", state))
        self._scaler.load_state(without_prefix("scaler", state))
        self._generator.set_state(torch.from_numpy(np.array(state["generator"], np.uint8)))
        self.storage.clear()


def fastest_gradients(config: PpoConfig, actor: GaussianActor, critic: nn.Module) -> PpoGradients:
    """Written out where compiled passes are known; by autograd elsewhere."""
    if is_compiled(actor.network, critic):
        return WrittenPpo(actor, critic, config.clip_range, config.entropy_coefficient)
    return AutogradPpo(actor, critic, config.clip_range, config.entropy_coefficient)


def log_std_range(config: PpoConfig, progress: float) -> tuple[float, float]:
    """Within which the logarithms of the deviations are kept after `progress` (0 to 1) of the training.

    With a final deviation the upper end falls to it from half of the training on, evenly in the logarithm.
    """
    low, high = LOG_STD_RANGE
    if config.final_std is None:
        return low, high
    fallen = max(0.0, 2.0 * progress - 1.0)
    return low, high + fallen * (math.log(config.final_std) - high)


def initial_deviations(config: PpoConfig, actions: ActionLayout) -> tuple[float, ...]:
    """Of each component's exploration, in fractions of its limit: that of a speed is for a range of 1, and grows with it."""
    return tuple(
        config.initial_std_angular if component.turns else component.span * config.initial_std_linear
        for component in actions.components
    )


def build_actor_critic(
    config: PpoConfig, inputs: Inputs, seed: int, actions: ActionLayout
) -> tuple[GaussianActor, nn.Module]:
    """Freshly initialised networks on the CPU; the same seed gives the same weights."""
    with torch.random.fork_rng(devices=[]):
        torch.manual_seed(stream_seed(seed, WEIGHTS))
        network = build_network(config.network, inputs, actions.size)
        actor = GaussianActor(network, initial_deviations(config, actions), actions)
        return actor, build_network(config.network, inputs.and_also(told(config)), 1)


def told(config: PpoConfig) -> int:
    """Numbers that the critic is told beyond what the robot sees."""
    return GUIDANCE_SIZE if config.critic_sees == "path" else 0


def build_ppo(
    config: PpoConfig, inputs: Inputs | int, seed: int, device: torch.device, actions: ActionLayout = DEFAULT_ACTIONS
) -> Ppo:
    """PPO with freshly initialised networks; the same seed gives the same weights on every device."""
    inputs = as_inputs(inputs)
    actor, critic = build_actor_critic(config, inputs, seed, actions)
    actor, critic = actor.to(device), critic.to(device)
    storage = RolloutStorage(config.rollout_steps, config.robots, inputs.size, actions.size, device, told(config))
    generator = torch.Generator(device).manual_seed(stream_seed(seed, EXPLORATION))
    if isinstance(config.network, RecurrentNetworkConfig):
        # Only now: it is made of this.
        from workers.algorithms.recurrent_ppo import RecurrentPpo

        assert isinstance(critic, Described)
        return RecurrentPpo(config, actor, critic, storage, generator)
    return Ppo(config, actor, critic, storage, generator)

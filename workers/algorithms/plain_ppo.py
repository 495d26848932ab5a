"""All of PPO (Schulman et al. 2017) on one page, to be read from top to bottom.

`workers.algorithms.ppo` trains to the same weights, quicker; docs/ppo.md shows where there each part of this page is.
Networks, environment and random streams are shared, arithmetic is not: tests/workers/test_plain_ppo.py compares the two.
"""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.distributions import Normal

from sim.actions import action_layout
from sim.arenas import with_maps_of
from sim.envs.vector import NavigationVectorEnv
from sim.streams import EXPLORATION, stream_seed
from workers.algorithms.ppo import build_actor_critic, log_std_range
from workers.algorithms.storage.return_scaler import ReturnScaler
from workers.config import PpoConfig, TrainingConfig
from workers.networks.inputs import inputs_of
from workers.networks.modules import GaussianActor


class Rollout(NamedTuple):
    """What T steps of N robots brought.

    Attributes:
        observations: (T, N, size).
        critic_observations: (T, N, size), or (T, N, size + G) with what the critic alone is told.
        actions: (T, N, A) as sampled; the environment clips them to their range.
        log_probs: (T, N) of these actions under the policy that sampled them.
        rewards: (T, N) as the environment paid them.
        terminated: (T, N) bool: a collision, after which nothing follows.
        dones: (T, N) bool: terminated, or cut by the step limit.
        values: (T, N) of the observations.
        next_values: (T, N) of what followed within the episode: 0 where it terminated.
    """

    observations: Tensor
    critic_observations: Tensor
    actions: Tensor
    log_probs: Tensor
    rewards: Tensor
    terminated: Tensor
    dones: Tensor
    values: Tensor
    next_values: Tensor


@dataclass
class Learner:
    """The state of a training.

    Attributes:
        config: hyperparameters.
        actor: observations (n, size) to the mean (n, A) of a normal distribution, whose deviations are its own.
        critic: observations (n, size), and what it alone is told, to values (n, 1), in scaled rewards.
        env: all robots.
        observations: (N, size) that the next actions are for.
        generator: of exploration and of the order of minibatches.
    """

    config: PpoConfig
    actor: GaussianActor
    critic: nn.Module
    env: NavigationVectorEnv
    observations: NDArray[np.float32]
    generator: torch.Generator

    def __post_init__(self) -> None:
        self.optimizer = torch.optim.Adam([*self.actor.parameters(), *self.critic.parameters()])
        self.scaler = ReturnScaler(self.config.robots, self.config.gamma)


def train(config: TrainingConfig, seed: int) -> Learner:
    """Collects and learns in turn until the configured steps are done; PPO without recurrent networks, on the CPU."""
    ppo = config.algorithm
    assert isinstance(ppo, PpoConfig)
    actor, critic = build_actor_critic(ppo, inputs_of(config.task), seed, action_layout(config.task.robot))
    env = NavigationVectorEnv(with_maps_of(config.task, seed), ppo.robots, seed=seed, guides=ppo.critic_sees == "path")
    observations, _ = env.reset(seed=seed)
    generator = torch.Generator().manual_seed(stream_seed(seed, EXPLORATION))
    learner = Learner(ppo, actor, critic, env, observations, generator)

    updates = math.ceil(config.steps / (ppo.rollout_steps * ppo.robots))
    for update in range(updates):
        progress = update / updates
        decay = 1.0 - progress if ppo.learning_rate_schedule == "linear" else 1.0
        learner.optimizer.param_groups[0]["lr"] = ppo.learning_rate * decay
        learn(learner, collect(learner), log_std_range(ppo, progress))
    return learner


@torch.no_grad()
def collect(learner: Learner) -> Rollout:
    """One rollout with the exploring policy."""
    config, actor, env = learner.config, learner.actor, learner.env
    steps = []
    for _ in range(config.rollout_steps):
        observations = torch.from_numpy(learner.observations)
        critic_observations = with_guidance(observations, env, final=False)
        policy = Normal(actor(observations), actor.log_std.exp())
        noise = torch.empty_like(policy.mean).normal_(generator=learner.generator)
        actions = policy.mean + policy.stddev * noise

        # Where an episode ends the next one begins at once; `final_observations` keeps what the old one saw last.
        learner.observations, rewards, terminations, truncations, _ = env.step(actions.numpy())
        terminated, dones = torch.from_numpy(terminations), torch.from_numpy(terminations | truncations)
        followed = torch.where(
            dones[:, None], torch.from_numpy(env.final_observations), torch.from_numpy(learner.observations)
        )
        critic_followed = torch.where(
            dones[:, None], with_guidance(followed, env, final=True), with_guidance(followed, env, final=False)
        )
        values, next_values = learner.critic(critic_observations)[:, 0], learner.critic(critic_followed)[:, 0]
        steps.append(
            Rollout(
                observations=observations,
                critic_observations=critic_observations,
                actions=actions,
                log_probs=policy.log_prob(actions).sum(dim=1),
                rewards=torch.from_numpy(rewards),
                terminated=terminated,
                dones=dones,
                values=values,
                next_values=torch.where(terminated, 0.0, next_values),
            )
        )
    return Rollout(*(torch.stack(column) for column in zip(*steps, strict=True)))


def with_guidance(observations: Tensor, env: NavigationVectorEnv, *, final: bool) -> Tensor:
    """What the critic sees (n, size): the same, or with the way to the target behind it, now or as an episode ended."""
    if env.guidance is None:
        return observations
    return torch.cat((observations, torch.from_numpy(env.guidance.final if final else env.guidance.now)), dim=1)


def estimate_advantages(config: PpoConfig, rewards: Tensor, rollout: Rollout) -> Tensor:
    """Generalised advantages (T, N) (Schulman et al. 2016): how much better than expected each action turned out.

    A_t = delta_t + gamma lambda A_{t+1} within an episode, delta_t = r_t + gamma V_{t+1} - V_t: what came and is now
    expected, less what was expected. `rewards` (T, N) are scaled.
    """
    deltas = rewards + config.gamma * rollout.next_values - rollout.values
    advantages = torch.zeros_like(deltas)
    following = torch.zeros_like(deltas[0])
    for step in reversed(range(len(deltas))):
        following = torch.where(rollout.dones[step], 0.0, following)
        advantages[step] = following = deltas[step] + config.gamma * config.gae_lambda * following
    return advantages


def learn(learner: Learner, rollout: Rollout, limits: tuple[float, float]) -> None:
    """Some epochs of minibatches over one rollout; logarithms of deviations stay within the limits."""
    config, actor, critic = learner.config, learner.actor, learner.critic
    rewards = rollout.rewards
    if config.scale_returns:
        learner.scaler.update(rewards.numpy(), rollout.dones.numpy())
        rewards = rewards * learner.scaler.scale
    advantages = estimate_advantages(config, rewards, rollout)
    returns = (advantages + rollout.values).flatten()
    advantages = ((advantages - advantages.mean()) / (advantages.std() + 1e-8)).flatten()
    observations, actions = rollout.observations.flatten(0, 1), rollout.actions.flatten(0, 1)
    critic_observations = rollout.critic_observations.flatten(0, 1)
    log_probs = rollout.log_probs.flatten()

    for _ in range(config.epochs):
        for rows in torch.randperm(len(returns), generator=learner.generator).split(config.minibatch_size):
            policy = Normal(actor(observations[rows]), actor.log_std.exp())
            ratio = torch.exp(policy.log_prob(actions[rows]).sum(dim=1) - log_probs[rows])
            clipped = ratio.clamp(1.0 - config.clip_range, 1.0 + config.clip_range)
            # Nothing is gained by going further from the old policy than the clip, in the direction that seems to pay.
            surrogate = torch.minimum(ratio * advantages[rows], clipped * advantages[rows]).mean()
            entropy = policy.entropy()[0].sum()  # of one action: the deviations are the same everywhere
            value_loss = (critic(critic_observations[rows])[:, 0] - returns[rows]).square().mean()

            learner.optimizer.zero_grad()
            (value_loss - surrogate - config.entropy_coefficient * entropy).backward()
            for module in (actor, critic):  # they share no parameters, so each has a gradient of its own
                nn.utils.clip_grad_norm_(module.parameters(), config.max_grad_norm)
            learner.optimizer.step()
            with torch.no_grad():
                actor.log_std.clamp_(*limits)

"""What PPO remembers of one rollout, and the advantages that follow from it."""

from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor


class Samples(NamedTuple):
    """What PPO learns from, a row for each step of each robot.

    Attributes:
        observations: (n, size).
        critic_observations: (n, size) the same ones, or (n, size + G) with what the critic alone is told behind them.
        actions: (n, A) as sampled, before the environment clipped them.
        log_probs: (n,) under the policy that sampled them.
        advantages: (n,) normalised over the rollout.
        returns: (n,) the critic's targets.
    """

    observations: Tensor
    critic_observations: Tensor
    actions: Tensor
    log_probs: Tensor
    advantages: Tensor
    returns: Tensor


class RolloutStorage:
    """Preallocated arrays for `steps` steps of `robots` robots, filled step by step.

    Attributes:
        observations: (steps + 1, robots, size); the last one is what followed the last action.
        critic_observations: the same array, or (steps + 1, robots, size + G) where the critic is told G numbers more.
        actions, noise: (steps, robots, A); the sampled actions and the standard normal noise in them.
        rewards: (steps, robots) float32.
        dones: (steps, robots) bool, terminated or truncated.
    """

    def __init__(
        self, steps: int, robots: int, observation_size: int, action_size: int, device: torch.device, told: int = 0
    ) -> None:
        self.steps, self.robots, self.device = steps, robots, device
        self.observations = torch.zeros(steps + 1, robots, observation_size, device=device)
        self.critic_observations = self.observations
        if told:
            self.critic_observations = torch.zeros(steps + 1, robots, observation_size + told, device=device)
        self.actions = torch.zeros(steps, robots, action_size, device=device)
        self.noise = torch.zeros(steps, robots, action_size, device=device)
        self.rewards = np.zeros((steps, robots), np.float32)
        self.dones = np.zeros((steps, robots), np.bool_)
        self._truncations: list[tuple[int, NDArray[np.intp], NDArray[np.float32]]] = []
        self.step = 0

    @property
    def full(self) -> bool:
        """Whether the rollout is complete."""
        return self.step == self.steps

    def clear(self) -> None:
        """Starts the next rollout."""
        self.step = 0
        self._truncations.clear()

    def see(self, step: int, observations: NDArray[np.float32], told: NDArray[np.float32] | None = None) -> None:
        """What robots see at a step (robots, size), and what their critic is told besides (robots, G)."""
        self.observations[step] = torch.from_numpy(observations)
        if told is not None:
            size = observations.shape[1]
            self.critic_observations[step, :, :size] = self.observations[step]
            self.critic_observations[step, :, size:] = torch.from_numpy(told)

    def add_outcome(
        self,
        rewards: NDArray[np.float32],
        terminations: NDArray[np.bool_],
        truncations: NDArray[np.bool_],
        final_observations: NDArray[np.float32],
        final_told: NDArray[np.float32] | None = None,
    ) -> None:
        """Closes the current step with what the environment answered."""
        self.rewards[self.step] = rewards
        np.logical_or(terminations, truncations, out=self.dones[self.step])
        truncated = np.flatnonzero(truncations & ~terminations)
        if truncated.size:
            last = final_observations[truncated]
            if final_told is not None:
                last = np.concatenate((last, final_told[truncated]), axis=1)
            self._truncations.append((self.step, truncated, last))
        self.step += 1

    def truncations(self) -> tuple[NDArray[np.intp], NDArray[np.intp], Tensor]:
        """Where the step limit cut an episode: steps (k,), robots (k,) and what the critic saw there (k, size)."""
        size = self.critic_observations.shape[-1]
        if not self._truncations:
            return np.empty(0, np.intp), np.empty(0, np.intp), torch.empty(0, size, device=self.device)
        steps = np.concatenate([np.full(robots.size, step) for step, robots, _ in self._truncations])
        robots = np.concatenate([robots for _, robots, _ in self._truncations])
        observations = np.concatenate([observations for _, _, observations in self._truncations])
        return steps, robots, torch.from_numpy(observations).to(self.device)

    def samples(self, log_probs: Tensor, advantages: Tensor, returns: Tensor) -> Samples:
        """The rollout's rows, step by step, with what is known of them (steps, robots) after it."""
        observations, actions = self.observations[:-1].flatten(0, 1), self.actions.flatten(0, 1)
        told = self.critic_observations is not self.observations
        critic_observations = self.critic_observations[:-1].flatten(0, 1) if told else observations
        known = log_probs.flatten(), advantages.flatten(), returns.flatten()
        return Samples(observations, critic_observations, actions, *known)


def generalized_advantages(
    rewards: NDArray[np.float32], values: NDArray[np.float32], dones: NDArray[np.bool_], gamma: float, gae_lambda: float
) -> NDArray[np.float32]:
    """Generalised advantage estimation (Schulman et al. 2016, Eq. 16).

    Args:
        rewards: (steps, robots); where the step limit cut an episode, gamma times the value of what would have followed
            is already added.
        values: (steps + 1, robots), the last row for what followed the last step.
        dones: (steps, robots), whether the episode ended in that step.
        gamma: discount.
        gae_lambda: 0 is one-step temporal difference, 1 the whole return.

    Returns:
        (steps, robots): A_t = delta_t + gamma lambda A_{t+1} within an episode, delta_t = r_t + gamma V_{t+1} - V_t.
    """
    discounts = np.where(dones, 0.0, gamma).astype(np.float32)
    advantages: NDArray[np.float32] = rewards + discounts * values[1:] - values[:-1]
    decay = discounts * np.float32(gae_lambda)
    for step in range(len(rewards) - 2, -1, -1):
        advantages[step] += decay[step] * advantages[step + 1]
    return advantages

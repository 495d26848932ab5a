"""The gradients of PPO's losses: by autograd, which reads as the paper does, and written out, which is faster on a CPU.

The losses, over a minibatch of n samples (Schulman et al. 2017):

    policy  -mean(min(r A, clip(r, 1 - eps, 1 + eps) A)) - c_entropy H,  r = pi(a|o) / pi_old(a|o)      Eq. 7 and 9
    value   mean((V(o) - R)^2)                                                                         Eq. 9

Actor and critic share nothing, so each gradient is that of its own loss and needs no weighing against the other.
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from workers.algorithms.storage.rollout import Samples
from workers.kernels.adam import AdamSteps
from workers.kernels.ppo import BOTH, LOG_SQRT_2PI, STATISTICS, differentiate, learn
from workers.networks.compiled import ROWS_AT_ONCE, passes_of
from workers.networks.modules import GaussianActor


class PpoGradients(Protocol):
    """Fills the `.grad` of the actor's and the critic's parameters."""

    def __call__(self, samples: Samples, rows: Tensor) -> Tensor:
        """Overwrites the gradients.

        Args:
            samples: a rollout's.
            rows: (n,) int64, those that are in the minibatch; with recurrent networks (steps, sequences).

        Returns:
            (4,): policy loss (without the entropy bonus), value loss, estimate of KL(old, new), clipped fraction.
        """


def log_prob(noise: Tensor, log_std: Tensor) -> Tensor:
    """Log density (n,) of a diagonal normal at mean + std * noise, for standard normal `noise` (n, A)."""
    return (-0.5 * noise.square() - log_std - LOG_SQRT_2PI).sum(-1)


def entropy(log_std: Tensor) -> Tensor:
    """Entropy of a diagonal normal, summed over its dimensions."""
    return (log_std + 0.5 + LOG_SQRT_2PI).sum()


class AutogradPpo:
    """By autograd: of any network, on any device."""

    def __init__(self, actor: GaussianActor, critic: nn.Module, clip_range: float, entropy_coefficient: float) -> None:
        self._actor, self._critic = actor, critic
        self._clip_range, self._entropy_coefficient = clip_range, entropy_coefficient

    @torch.enable_grad()
    def __call__(self, samples: Samples, rows: Tensor) -> Tensor:
        """See `PpoGradients`."""
        batch = Samples(*(column[rows.flatten()] for column in samples))
        for parameter in (*self._actor.parameters(), *self._critic.parameters()):
            if parameter.grad is not None:
                parameter.grad.zero_()
        log_std = self._actor.log_std
        mean, values = self.predict(batch, rows)
        noise = (batch.actions - mean) / torch.exp(log_std)
        log_ratio = log_prob(noise, log_std) - batch.log_probs
        ratio = torch.exp(log_ratio)
        clipped = ratio.clamp(1.0 - self._clip_range, 1.0 + self._clip_range)
        policy_loss = -torch.min(ratio * batch.advantages, clipped * batch.advantages).mean()
        value_loss = (values - batch.returns).square().mean()
        (policy_loss - self._entropy_coefficient * entropy(log_std) + value_loss).backward()
        with torch.no_grad():
            kl = (ratio - 1.0 - log_ratio).mean()
            clip_fraction = (ratio != clipped).float().mean()
            return torch.stack((policy_loss, value_loss, kl, clip_fraction))

    def predict(self, batch: Samples, rows: Tensor) -> tuple[Tensor, Tensor]:
        """Mean actions (n, A) and values (n,) of samples, which are these rows of the rollout."""
        return self._actor(batch.observations), self._critic(batch.critic_observations)[:, 0]


class WrittenPpo:
    """The same gradients where compiled passes are known; a test compares them with `AutogradPpo`'s."""

    def __init__(self, actor: GaussianActor, critic: nn.Module, clip_range: float, entropy_coefficient: float) -> None:
        log_std = actor.log_std
        assert log_std.grad is not None, "FlatAdam gives every parameter its gradient"
        self._log_std, self._grad_log_std = log_std.detach().numpy(), log_std.grad.numpy()
        self._lows = np.array(actor.actions.lows, np.float32)
        self._clip_range, self._entropy_coefficient = clip_range, entropy_coefficient
        self._actor, self._critic = passes_of(actor.network, ROWS_AT_ONCE), passes_of(critic, ROWS_AT_ONCE)

    def __call__(self, samples: Samples, rows: Tensor) -> Tensor:
        """See `PpoGradients`."""
        statistics, grad_log_std = np.zeros(STATISTICS), np.full(len(self._lows), -self._entropy_coefficient)
        differentiate(
            self._actor, self._critic, BOTH, _arrays(samples), rows.numpy(), ROWS_AT_ONCE,
            self._log_std, self._lows, self._clip_range, grad_log_std, statistics,
        )  # fmt: skip
        self._grad_log_std[:] = grad_log_std
        return torch.from_numpy(statistics)

    def learn(
        self,
        whose: int,
        samples: Samples,
        minibatches: Sequence[Tensor],
        steps: AdamSteps,
        log_std_range: tuple[float, float],
    ) -> Tensor:
        """Gradients, clipping and a step of Adam for each minibatch, in one call.

        Args:
            whose: `BOTH`, or `ACTOR` or `CRITIC` alone, perhaps while another thread does the other.
            samples: a rollout's.
            minibatches: (n,) int64 each, rows of the samples.
            steps: one for each minibatch.
            log_std_range: within which the log deviations are kept.

        Returns:
            (4,): sums over the minibatches of what `PpoGradients` returns; of one network alone the other's are 0.
        """
        statistics = np.zeros(STATISTICS)
        rows, ends = torch.cat(list(minibatches)).numpy(), np.cumsum([len(minibatch) for minibatch in minibatches])
        learn(
            self._actor, self._critic, whose, _arrays(samples), rows, ends, ROWS_AT_ONCE, self._log_std, log_std_range,
            self._lows, self._clip_range, self._entropy_coefficient, self._grad_log_std, steps, statistics,
        )  # fmt: skip
        return torch.from_numpy(statistics)


def _arrays(samples: Samples) -> tuple[NDArray[np.float32], ...]:
    return tuple(column.numpy() for column in samples)

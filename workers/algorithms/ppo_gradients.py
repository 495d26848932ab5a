"""The gradients of PPO's losses: by autograd, which reads as the paper does, and written out, which is faster.

The losses, over a minibatch of n samples (Schulman et al. 2017):

    policy  -mean(min(r A, clip(r, 1 - eps, 1 + eps) A)) - c_entropy H,  r = pi(a|o) / pi_old(a|o)      Eq. 7 and 9
    value   mean((V(o) - R)^2)                                                                         Eq. 9

Actor and critic share nothing, so each gradient is that of its own loss and needs no weighing against the other.
"""

import math
from typing import Protocol

import torch
from torch import Tensor

from workers.algorithms.rollout import Minibatch
from workers.backward import backward_of
from workers.networks import Body, GaussianActor

LOG_SQRT_2PI = 0.5 * math.log(2.0 * math.pi)


class PpoGradients(Protocol):
    """Fills the `.grad` of the actor's and the critic's parameters."""

    def __call__(self, batch: Minibatch) -> Tensor:
        """Overwrites the gradients.

        Returns:
            (4,): policy loss (without the entropy bonus), value loss, estimate of KL(old, new), clipped fraction.
        """


def log_prob(noise: Tensor, log_std: Tensor) -> Tensor:
    """Log density (n,) of a diagonal normal at mean + std * noise, for standard normal `noise` (n, 2)."""
    return (-0.5 * noise.square() - log_std - LOG_SQRT_2PI).sum(-1)


def entropy(log_std: Tensor) -> Tensor:
    """Entropy of a diagonal normal, summed over its dimensions."""
    return (log_std + 0.5 + LOG_SQRT_2PI).sum()


class AutogradPpo:
    """The reference."""

    def __init__(self, actor: GaussianActor, critic: Body, clip_range: float, entropy_coefficient: float) -> None:
        self._actor, self._critic = actor, critic
        self._clip_range, self._entropy_coefficient = clip_range, entropy_coefficient

    @torch.enable_grad()
    def __call__(self, batch: Minibatch) -> Tensor:
        """See `PpoGradients`."""
        for parameter in (*self._actor.parameters(), *self._critic.parameters()):
            if parameter.grad is not None:
                parameter.grad.zero_()
        log_std = self._actor.log_std
        noise = (batch.actions - self._actor(batch.observations)) / torch.exp(log_std)
        log_ratio = log_prob(noise, log_std) - batch.log_probs
        ratio = torch.exp(log_ratio)
        clipped = ratio.clamp(1.0 - self._clip_range, 1.0 + self._clip_range)
        policy_loss = -torch.min(ratio * batch.advantages, clipped * batch.advantages).mean()
        value_loss = (self._critic(batch.observations)[:, 0] - batch.returns).square().mean()
        (policy_loss - self._entropy_coefficient * entropy(log_std) + value_loss).backward()
        with torch.no_grad():
            kl = (ratio - 1.0 - log_ratio).mean()
            clip_fraction = (ratio != clipped).float().mean()
            return torch.stack((policy_loss, value_loss, kl, clip_fraction))


class WrittenPpo:
    """The same gradients without autograd; a test compares them with `AutogradPpo`'s."""

    def __init__(
        self, actor: GaussianActor, critic: Body, clip_range: float, entropy_coefficient: float, batch_size: int
    ) -> None:
        self._log_std = actor.log_std
        self._clip_range, self._entropy_coefficient = clip_range, entropy_coefficient
        self._policy = backward_of(actor.network, batch_size)
        self._critic = backward_of(critic, batch_size)

    @torch.no_grad()
    def __call__(self, batch: Minibatch) -> Tensor:
        """See `PpoGradients`."""
        rows = len(batch.advantages)
        log_std, advantages = self._log_std, batch.advantages
        logits = self._policy.forward(batch.observations)
        mean = torch.empty_like(logits)
        torch.sigmoid(logits[:, 0], out=mean[:, 0])
        torch.tanh(logits[:, 1], out=mean[:, 1])
        inverse_std = torch.exp(-log_std)
        noise = (batch.actions - mean).mul_(inverse_std)
        squares = noise.square()
        log_ratio = squares.sum(1).mul_(-0.5).sub_(batch.log_probs).sub_(log_std.sum() + 2 * LOG_SQRT_2PI)
        ratio = log_ratio.exp()

        # min(r A, clip(r) A) is r A, whose derivative by log r is r A, unless clip(r) A is smaller: then it is constant.
        surrogate = ratio * advantages
        clipped = ratio.clamp(1.0 - self._clip_range, 1.0 + self._clip_range)
        clipped_surrogate = clipped * advantages
        by_log_prob = torch.where(clipped_surrogate < surrogate, 0.0, surrogate).mul_(-1.0 / rows).unsqueeze(1)
        log_std_gradient = self._log_std.grad
        assert log_std_gradient is not None, "FlatAdam gives every parameter its gradient"
        torch.sum(squares.sub_(1.0).mul_(by_log_prob), 0, out=log_std_gradient)
        log_std_gradient.sub_(self._entropy_coefficient)

        # d log p / d mean = noise / std; then through sigmoid (s (1 - s)) and tanh (1 - t^2).
        by_logits = noise.mul_(by_log_prob).mul_(inverse_std)
        by_logits[:, 0].mul_(mean[:, 0] * (1.0 - mean[:, 0]))
        by_logits[:, 1].mul_(1.0 - mean[:, 1].square())
        self._policy.backward(by_logits)

        error = self._critic.forward(batch.observations)[:, 0] - batch.returns
        value_loss = error.dot(error) / rows
        self._critic.backward(error.mul_(2.0 / rows).unsqueeze(1))

        policy_loss = -torch.minimum(surrogate, clipped_surrogate).mean()
        kl = (ratio - 1.0 - log_ratio).mean()
        clip_fraction = (ratio != clipped).float().mean()
        return torch.stack((policy_loss, value_loss, kl, clip_fraction))

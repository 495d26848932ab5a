"""The gradients of SAC's losses: by autograd, which reads as the paper does, and written out, which is faster.

critics  L = sum_i 1/N sum (y - Q_i(s, a))^2
actor    J = 1/N sum (alpha log pi(a|s) - min_i Q_i(s, a)), a = squash(u), u = mean(s) + std(s) noise      its Eq. 9 and 10
"""

from collections.abc import Sequence
from typing import Protocol

import torch
from torch import Tensor, nn

from sim.actions import DEFAULT_ACTIONS, ActionLayout
from workers.algorithms.flat import FlatParameters
from workers.algorithms.gradients.actor_critic import action_value, differentiate_critics, write_critic_gradients
from workers.algorithms.gradients.ppo import log_prob
from workers.algorithms.storage.replay import Transitions
from workers.networks.compiled import TensorPasses, is_compiled
from workers.networks.squashing import bound_actions, log_slope, multiply_by_slope

# Deviations of u from 0.7 % to 740 %: outside of it gradients vanish or samples saturate.
_LOW, _HIGH = -5.0, 2.0
_HALF = 0.5 * (_HIGH - _LOW)


class SacGradients(Protocol):
    """Fills the `.grad` of the actor's or of the critics' parameters."""

    def critics(self, batch: Transitions, targets: Tensor) -> Tensor:
        """Overwrites the critics' gradients, given targets (n, 1); returns the loss."""

    def actor(self, observations: Tensor, noise: Tensor, alpha: Tensor) -> tuple[Tensor, Tensor]:
        """Overwrites the actor's gradients.

        Args:
            observations: (n, size).
            noise: (n, A), standard normal, of the actions to try.
            alpha: scalar or (1,), the weight of entropy.

        Returns:
            The loss and the actions' log densities (n, 1).
        """


def squashed_sample(outputs: Tensor, noise: Tensor, actions: ActionLayout = DEFAULT_ACTIONS) -> tuple[Tensor, Tensor]:
    """Actions (n, A) and their log densities (n, 1), from the actor's outputs (n, 2 A) and standard normal noise (n, A)."""
    mean, raw = outputs.split(actions.size, dim=1)
    log_std = _LOW + _HALF * (torch.tanh(raw) + 1.0)
    u = mean + torch.exp(log_std) * noise
    return bound_actions(u, actions), (log_prob(noise, log_std) - log_slope(u, actions)).unsqueeze(1)


class AutogradSac:
    """By autograd: of any network, on any device."""

    def __init__(
        self,
        actor: nn.Module,
        critics: Sequence[nn.Module],
        actor_parameters: FlatParameters,
        critic_parameters: FlatParameters,
        actions: ActionLayout = DEFAULT_ACTIONS,
    ) -> None:
        self._layout = actions
        self._actor, self._critics = actor, critics
        self._actor_parameters, self._critic_parameters = actor_parameters, critic_parameters

    def critics(self, batch: Transitions, targets: Tensor) -> Tensor:
        """See `SacGradients.critics`."""
        return differentiate_critics(self._critics, self._critic_parameters, batch, targets)

    @torch.enable_grad()
    def actor(self, observations: Tensor, noise: Tensor, alpha: Tensor) -> tuple[Tensor, Tensor]:
        """See `SacGradients.actor`."""
        actions, log_probs = squashed_sample(self._actor(observations), noise, self._layout)
        values = torch.minimum(*(action_value(critic, observations, actions) for critic in self._critics))
        loss = (alpha * log_probs - values).mean()
        self._actor_parameters.differentiate(loss)
        return loss.detach(), log_probs.detach()


class WrittenSac:
    """The same gradients where compiled passes are known; a test compares them with `AutogradSac`'s."""

    def __init__(
        self, actor: nn.Module, critics: Sequence[nn.Module], batch_size: int, actions: ActionLayout = DEFAULT_ACTIONS
    ) -> None:
        self._layout = actions
        self._actor = TensorPasses(actor, batch_size)
        self._critics = [TensorPasses(critic, batch_size) for critic in critics]

    def critics(self, batch: Transitions, targets: Tensor) -> Tensor:
        """See `SacGradients.critics`."""
        return write_critic_gradients(self._critics, batch, targets)

    @torch.no_grad()
    def actor(self, observations: Tensor, noise: Tensor, alpha: Tensor) -> tuple[Tensor, Tensor]:
        """See `SacGradients.actor`."""
        rows, size = observations.shape
        mean, raw = self._actor.forward(observations).split(self._layout.size, dim=1)
        bent = torch.tanh(raw)
        log_std = _LOW + _HALF * (bent + 1.0)
        spread = torch.exp(log_std) * noise
        u = mean + spread
        actions = bound_actions(u, self._layout)
        log_probs = (log_prob(noise, log_std) - log_slope(u, self._layout)).unsqueeze(1)

        inputs = torch.cat((observations, actions), dim=1)
        first, second = (critic.forward(inputs) for critic in self._critics)
        # Each sample's loss falls with the smaller of its two values.
        grad_first = (first <= second).float().div_(-rows)
        grad_u = torch.zeros_like(actions)
        for critic, grad_value in zip(self._critics, (grad_first, -1.0 / rows - grad_first), strict=True):
            grad_u += critic.input_gradient(grad_value)[:, size:]

        weight = alpha / rows
        multiply_by_slope(grad_u, actions, self._layout, weight)
        grad_raw = (grad_u * spread - weight) * (_HALF * (1.0 - bent.square()))
        self._actor.backward(torch.cat((grad_u, grad_raw), dim=1))
        return (alpha * log_probs - torch.minimum(first, second)).mean(), log_probs


def fastest_gradients(
    actor: nn.Module,
    critics: Sequence[nn.Module],
    actor_parameters: FlatParameters,
    critic_parameters: FlatParameters,
    batch_size: int,
    actions: ActionLayout = DEFAULT_ACTIONS,
) -> SacGradients:
    """Written out where compiled passes are known; by autograd elsewhere."""
    if is_compiled(actor, *critics):
        return WrittenSac(actor, critics, batch_size, actions)
    return AutogradSac(actor, critics, actor_parameters, critic_parameters, actions)

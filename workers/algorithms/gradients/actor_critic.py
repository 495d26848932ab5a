"""The gradients of DDPG's and TD3's losses: by autograd, which reads as the papers do, and written out, which is faster.

critics  L = sum_i 1/N sum (y - Q_i(s, a))^2
actor    J = 1/N sum (-Q_1(s, mu(s)) + penalty |z|^2), where mu(s) squashes the logits z of the actor's network

The penalty keeps sigmoid and tanh from their flat ends. There their slope is zero, so no critic, however right, moves the
actor any more: see docs/recipes.md, 'Why DDPG failed'.
"""

from collections.abc import Sequence
from typing import Protocol

import torch
from torch import Tensor, nn

from workers.algorithms.flat import FlatParameters
from workers.algorithms.storage.replay import Transitions
from workers.networks.compiled import TensorPasses, is_compiled
from workers.networks.modules import DeterministicActor
from workers.networks.squashing import bound_actions, multiply_by_slope


class ActorCriticGradients(Protocol):
    """Fills the `.grad` of the actor's or of the critics' parameters."""

    def critics(self, batch: Transitions, targets: Tensor) -> Tensor:
        """Overwrites the critics' gradients, given targets (n, 1); returns the loss."""

    def actor(self, observations: Tensor) -> Tensor:
        """Overwrites the actor's gradients, given observations (n, size); returns the loss without its penalty."""


def action_value(critic: nn.Module, observations: Tensor, actions: Tensor) -> Tensor:
    """Q (n, 1) of observations (n, size) and actions (n, A)."""
    value: Tensor = critic(torch.cat((observations, actions), dim=1))
    return value


@torch.enable_grad()
def differentiate_critics(
    critics: Sequence[nn.Module], parameters: FlatParameters, batch: Transitions, targets: Tensor
) -> Tensor:
    """Overwrites the critics' gradients by autograd, given targets (n, 1); returns the loss."""
    errors = [action_value(critic, batch.observations, batch.actions) - targets for critic in critics]
    loss = torch.stack([error.square().mean() for error in errors]).sum()
    parameters.differentiate(loss)
    return loss.detach()


@torch.no_grad()
def write_critic_gradients(critics: Sequence[TensorPasses], batch: Transitions, targets: Tensor) -> Tensor:
    """The same, written out."""
    inputs = torch.cat((batch.observations, batch.actions), dim=1)
    loss = torch.zeros((), device=targets.device)
    for critic in critics:
        error = critic.forward(inputs).sub_(targets)
        loss += error.square().mean()
        critic.backward(error.mul_(2.0 / len(targets)))
    return loss


class AutogradActorCritic:
    """By autograd: of any network, on any device."""

    def __init__(
        self,
        actor: DeterministicActor,
        critics: Sequence[nn.Module],
        actor_parameters: FlatParameters,
        critic_parameters: FlatParameters,
        logit_penalty: float,
    ) -> None:
        self._actor, self._critics, self._penalty = actor, critics, logit_penalty
        self._actor_parameters, self._critic_parameters = actor_parameters, critic_parameters

    def critics(self, batch: Transitions, targets: Tensor) -> Tensor:
        """See `ActorCriticGradients.critics`."""
        return differentiate_critics(self._critics, self._critic_parameters, batch, targets)

    @torch.enable_grad()
    def actor(self, observations: Tensor) -> Tensor:
        """See `ActorCriticGradients.actor`."""
        logits = self._actor.network(observations)
        value = action_value(self._critics[0], observations, bound_actions(logits, self._actor.actions)).mean()
        self._actor_parameters.differentiate(self._penalty * logits.square().sum(dim=1).mean() - value)
        return -value.detach()


class WrittenActorCritic:
    """The same gradients where compiled passes are known; a test compares them with `AutogradActorCritic`'s."""

    def __init__(
        self, actor: DeterministicActor, critics: Sequence[nn.Module], batch_size: int, logit_penalty: float
    ) -> None:
        self._penalty, self._layout = logit_penalty, actor.actions
        self._actor = TensorPasses(actor.network, batch_size)
        self._critics = [TensorPasses(critic, batch_size) for critic in critics]

    def critics(self, batch: Transitions, targets: Tensor) -> Tensor:
        """See `ActorCriticGradients.critics`."""
        return write_critic_gradients(self._critics, batch, targets)

    @torch.no_grad()
    def actor(self, observations: Tensor) -> Tensor:
        """See `ActorCriticGradients.actor`."""
        rows, size = observations.shape
        logits = self._actor.forward(observations)
        actions = bound_actions(logits, self._layout)
        values = self._critics[0].forward(torch.cat((observations, actions), dim=1))
        grad_actions = self._critics[0].input_gradient(torch.full_like(values, -1.0 / rows))[:, size:]
        grad_logits = grad_actions.contiguous()
        multiply_by_slope(grad_logits, actions, self._layout)
        if self._penalty:
            grad_logits.add_(logits, alpha=2.0 * self._penalty / rows)
        self._actor.backward(grad_logits)
        return -values.mean()


def fastest_gradients(
    actor: DeterministicActor,
    critics: Sequence[nn.Module],
    actor_parameters: FlatParameters,
    critic_parameters: FlatParameters,
    batch_size: int,
    logit_penalty: float,
) -> ActorCriticGradients:
    """Written out where compiled passes are known; by autograd elsewhere."""
    if is_compiled(actor.network, *critics):
        return WrittenActorCritic(actor, critics, batch_size, logit_penalty)
    return AutogradActorCritic(actor, critics, actor_parameters, critic_parameters, logit_penalty)

"""How a network's unbounded outputs become an action, for tensors (`sim.actions` says what an action is)."""

import math

import torch
from torch import Tensor
from torch.nn import functional

from sim.actions import DEFAULT_ACTIONS, ActionLayout


def bound_actions(logits: Tensor, actions: ActionLayout = DEFAULT_ACTIONS) -> Tensor:
    """(n, A) network outputs to (n, A) actions: a tanh where a component is symmetric, elsewhere a sigmoid."""
    columns = []
    for index, component in enumerate(actions.components):
        logit = logits[:, index : index + 1]
        if component.symmetric:
            columns.append(torch.tanh(logit))
        else:
            sigmoid = torch.sigmoid(logit)
            columns.append(sigmoid if component.low == 0.0 else component.low + component.span * sigmoid)
    return torch.cat(columns, dim=1)


def multiply_by_slope(
    grad_actions: Tensor, actions: Tensor, layout: ActionLayout, entropy_weight: Tensor | None = None
) -> None:
    """Turns derivatives by actions (n, A) in place into those by the logits that `bound_actions` made them of.

    Args:
        grad_actions: overwritten.
        actions: what the logits became.
        layout: what an action is.
        entropy_weight: scalar or (1,); so many times the derivative of minus `log_slope` is added.
    """
    for index, component in enumerate(layout.components):
        column, action = grad_actions[:, index], actions[:, index]
        if component.symmetric:
            # Through tanh, 1 - t^2, whose log slope has the derivative -2 t.
            column.mul_(1.0 - action.square())
            if entropy_weight is not None:
                column.add_(entropy_weight * (2.0 * action))
        else:
            # Through the sigmoid, s (1 - s), whose log slope has the derivative 1 - 2 s.
            share = action if component.low == 0.0 else (action - component.low) / component.span
            slope = share * (1.0 - share)
            column.mul_(slope if component.low == 0.0 else component.span * slope)
            if entropy_weight is not None:
                column.add_(entropy_weight * (2.0 * share - 1.0))


def log_slope(logits: Tensor, actions: ActionLayout = DEFAULT_ACTIONS) -> Tensor:
    """Log of the derivative of `bound_actions` by the logits, summed over an action: (n, A) to (n,).

    sigmoid'(u) = sigmoid(u) sigmoid(-u), tanh'(u) = 4 sigmoid(2 u) sigmoid(-2 u): exact where 1 - tanh(u)^2 would cancel.
    """
    total: Tensor | None = None
    constant = 0.0
    for index, component in enumerate(actions.components):
        u = 2.0 * logits[:, index] if component.symmetric else logits[:, index]
        rising = functional.logsigmoid(u)
        total = (rising if total is None else total + rising) + functional.logsigmoid(-u)
        constant += math.log(4.0) if component.symmetric else math.log(component.span)
    assert total is not None, "an action has a component"
    return total + constant

"""The gates of a gated recurrent unit as one node of autograd's graph: half the time of its formula, line by line.

A test holds it equal to `workers.networks.description`.
"""

from typing import Any

import torch
from torch import Tensor


class GruGates(torch.autograd.Function):
    """The next memory (n, m) of what comes in and of memory, both (n, 3 m) behind their layers, and of memory (n, m)."""

    @staticmethod
    def forward(ctx: Any, inputs: Tensor, remembered: Tensor, memory: Tensor) -> Tensor:
        """R and z = sigmoid(i + g), n = tanh(i + r g), h' = n + z (h - n)."""
        two = 2 * memory.shape[1]
        gates = torch.sigmoid(inputs[:, :two] + remembered[:, :two])
        reset, update = gates.chunk(2, dim=1)
        new = torch.tanh(torch.addcmul(inputs[:, two:], reset, remembered[:, two:]))
        ctx.save_for_backward(gates, new, remembered, memory)
        return torch.lerp(new, memory, update)

    @staticmethod
    def backward(ctx: Any, *gradients: Any) -> Any:
        """By the chain rule; sigmoid' = s (1 - s), tanh' = 1 - t^2."""
        (by_output,) = gradients
        gates, new, remembered, memory = ctx.saved_tensors
        size = memory.shape[1]
        reset, update = gates.chunk(2, dim=1)
        by_memory = by_output * update
        by_new = (by_output - by_memory).mul_(1.0 - new.square())
        by_inputs = torch.empty_like(remembered)
        torch.mul(by_new, remembered[:, 2 * size :], out=by_inputs[:, :size])
        torch.mul(by_output, memory - new, out=by_inputs[:, size : 2 * size])
        by_inputs[:, : 2 * size].mul_(torch.addcmul(gates, gates, gates, value=-1.0))
        by_inputs[:, 2 * size :] = by_new
        by_remembered = by_inputs.clone()
        by_remembered[:, 2 * size :].mul_(reset)
        return by_inputs, by_remembered, by_memory

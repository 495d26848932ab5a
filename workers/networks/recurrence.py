"""The recurrent part of a gated recurrent unit over a whole sequence as one node of autograd's graph, compiled, on a CPU.

A test holds it equal to `workers.networks.description`, line by line.
"""

from typing import Any

import torch
from torch import Tensor

from workers.kernels.gru import gru_backward, gru_forward


class GruSequence(torch.autograd.Function):
    """Memory (T, n, m) after each step.

    Of what comes in (T, n, 3 m), the memory's layer's weight (3 m, m) and bias (3 m,), memory (n, m) from before, and
    keep (T, n), 0 where an episode begins.
    """

    @staticmethod
    def forward(ctx: Any, inputs: Tensor, weight: Tensor, bias: Tensor, memory: Tensor, keep: Tensor) -> Tensor:
        """See `workers.kernels.gru.gru_forward`."""
        steps, rows, size = *inputs.shape[:2], memory.shape[1]
        kept, new, memories = (torch.empty(steps, rows, size) for _ in range(3))
        remembered, gates = torch.empty(steps, rows, 3 * size), torch.empty(steps, rows, 2 * size)
        given = (inputs, weight, bias, memory, keep)
        gru_forward(*(_array(tensor) for tensor in (*given, kept, remembered, gates, new, memories)))
        ctx.save_for_backward(weight, keep, kept, remembered, gates, new)
        return memories

    @staticmethod
    def backward(ctx: Any, *gradients: Any) -> Any:
        """See `workers.kernels.gru.gru_backward`."""
        (grad_memories,) = gradients
        weight, keep, kept, remembered, gates, new = ctx.saved_tensors
        grad_inputs, grad_remembered = torch.empty_like(remembered), torch.empty_like(remembered)
        grad_memory = torch.empty_like(new[0])
        saved = (weight, keep, kept, remembered, gates, new)
        gru_backward(*(_array(tensor) for tensor in (grad_memories, *saved, grad_inputs, grad_remembered, grad_memory)))
        grad_layer = grad_remembered.flatten(0, 1)
        return grad_inputs, grad_layer.T @ kept.flatten(0, 1), grad_layer.sum(0), grad_memory, None


def _array(tensor: Tensor) -> Any:
    return tensor.detach().contiguous().numpy()

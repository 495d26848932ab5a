"""The networks as compiled code runs them forward and backward on a CPU, and the same for tensors.

Autograd is the reference: a test holds the two equal.
"""

from itertools import accumulate

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from sim.engine.stretches import Crew
from sim.kernels.options import bound
from workers.kernels.networks import RELU, RESBLOCK, TANH, Passes, backward, forward, input_gradient
from workers.networks.config import MlpNetwork, ResBlockNetwork
from workers.networks.modules import Described

ROWS_AT_ONCE = 128
"""Rows that go through a network at once where there are more: a core's cache keeps their activations until they go back.

Half or twice as many change the time of PPO's gradients by 4 % at most, of all networks from 32-32 to 256-256.
"""

ROWS_OF_A_THREAD = 256
"""Rows that go forward only, on one of several threads: few robots are worth no second one."""


def is_compiled(*networks: nn.Module) -> bool:
    """Whether compiled passes are known for all of these networks, and they are on a CPU."""
    return all(
        isinstance(network, Described)
        and (isinstance(network.config, MlpNetwork) or network.config == ResBlockNetwork())
        and next(network.parameters()).device.type == "cpu"
        for network in networks
    )


def passes_of(network: nn.Module, rows: int) -> Passes:
    """A network for compiled code, with buffers for so many rows.

    Its parameters and their gradients must be parts of two vectors and stay there: `FlatParameters` sees to both.
    """
    config = network.config if isinstance(network, Described) else None
    assert isinstance(config, MlpNetwork) or config == ResBlockNetwork(), "others go by autograd"
    linear = [module for module in network.modules() if isinstance(module, nn.Linear)]
    weights = [layer.weight.numel() for layer in linear]
    layers = [
        (layer.weight.storage_offset(), layer.bias.storage_offset(), start, layer.in_features, layer.out_features)
        for layer, start in zip(linear, accumulate(weights, initial=0), strict=False)
    ]
    columns = [layer.out_features for layer in linear]
    if isinstance(config, ResBlockNetwork):
        kind = RESBLOCK
        width1, width2 = linear[1].out_features, linear[3].out_features
        columns += [2 * width1, 2 * width2, width1, width2]
    else:
        kind = TANH if config.activation == "tanh" else RELU
    columns.append(linear[0].in_features)
    starts = accumulate((rows * count for count in columns), initial=0)
    values, gradients = _vector(linear[0].weight), _vector(linear[0].weight.grad)
    return Passes(
        kind=kind,
        layers=np.array(layers, np.int64),
        buffers=np.array(list(zip(starts, columns, strict=False)), np.int64),
        values=values,
        gradients=gradients,
        transposed=np.empty(sum(weights), np.float32),
        outputs=np.empty(rows * sum(columns), np.float32),
        deltas=np.empty(rows * sum(columns), np.float32),
    )


class TensorPasses:
    """A network's passes for CPU tensors of any layout; results are buffers that the next call overwrites."""

    def __init__(self, network: nn.Module, rows: int) -> None:
        self._passes = passes = passes_of(network, rows)
        self._inputs: NDArray[np.float32]
        table = np.empty((1, 1), np.float32)
        self._forward = bound(forward, passes, table, False)
        self._backward = bound(backward, passes, table, table, False)
        self._input_gradient = bound(input_gradient, passes, table)

    def forward(self, inputs: Tensor, *, same: bool = False) -> Tensor:
        """(n, inputs) to (n, outputs), n at most the rows that there are buffers for.

        With `same`, which saves work, the parameters are those of the call before.
        """
        self._inputs = _contiguous(inputs)
        return torch.from_numpy(self._forward(self._passes, self._inputs, same))

    def backward(self, grad_output: Tensor) -> None:
        """Overwrites every parameter's `.grad`: `grad_output` (n, outputs) is a scalar's derivative by the last outputs."""
        self._backward(self._passes, self._inputs, _contiguous(grad_output), False)

    def input_gradient(self, grad_output: Tensor) -> Tensor:
        """The derivative (n, inputs) of that scalar by the inputs; leaves the parameters' `.grad` alone."""
        return torch.from_numpy(self._input_gradient(self._passes, _contiguous(grad_output)))


class Inference:
    """The fastest way from (n, inputs) to (n, outputs), on as many threads as a crew has, bit for bit alike.

    Args:
        network: any.
        rows: that go through it at once; at most `ROWS_OF_A_THREAD` where compiled passes are known.
    """

    def __init__(self, network: nn.Module, rows: int) -> None:
        self._network = network
        self._compiled = is_compiled(network)
        self._rows = min(rows, ROWS_OF_A_THREAD) if self._compiled else rows
        self._passes = [TensorPasses(network, self._rows)] if self._compiled else []

    def __call__(self, inputs: Tensor, crew: Crew) -> Tensor:
        """(n, inputs) to (n, outputs), which the next call may overwrite."""
        if len(inputs) <= self._rows:
            one: Tensor = self._passes[0].forward(inputs) if self._compiled else self._network(inputs)
            return one
        blocks = inputs.split(self._rows)
        if not self._compiled:
            return torch.cat([self._network(block) for block in blocks])
        parts = min(crew.threads, len(blocks))
        while len(self._passes) < parts:
            self._passes.append(TensorPasses(self._network, self._rows))

        def go(part: int) -> list[Tensor]:
            passes = self._passes[part]
            first, end = (len(blocks) * edge // parts for edge in (part, part + 1))
            return [passes.forward(blocks[block], same=block > first).clone() for block in range(first, end)]

        return torch.cat([values for found in crew.share(go, parts) for values in found])


def _contiguous(tensor: Tensor) -> NDArray[np.float32]:
    array: NDArray[np.float32] = tensor.detach().contiguous().numpy()
    return array


def _vector(part: Tensor | None) -> NDArray[np.float32]:
    """All of the vector that a tensor is a part of."""
    assert part is not None, "FlatParameters gives every parameter its gradient"
    size = part.untyped_storage().nbytes() // part.element_size()
    vector: NDArray[np.float32] = part.detach().as_strided((size,), (1,), 0).numpy()
    return vector

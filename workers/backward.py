"""Backward passes of the two networks, written out for a CPU: what autograd computes, without its bookkeeping.

Each class here runs one network forward and backward by the compiled functions of `workers.dense`, on NumPy views of the
parameters and of their `.grad`, which must exist and stay in their places (`FlatParameters` sees to both). Autograd is the
reference: a test holds the two equal.
"""

from typing import Any, Protocol

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from workers import dense
from workers.layout import LEAKY_SLOPE
from workers.networks import Body, Mlp, ResBlock

Floats = NDArray[np.floating[Any]]
"""Of the parameters' own type."""

_FEWEST_ROWS, _MOST_ROWS = 32, 512


def rows_at_once(network: Body) -> int:
    """Rows that best go through a network at once: as many as leave every product small enough for the quick kernels.

    Measured with PPO's minibatches of 1,024, one row more takes 23 % (ResBlock) or 25 % (128 wide) longer. Networks so wide that
    too few rows would be left are quickest with many.
    """
    rows = dense.SMALL_PRODUCT // max(parameter.numel() for parameter in network.parameters())
    return min(rows, _MOST_ROWS) if rows >= _FEWEST_ROWS else _MOST_ROWS


class Backward(Protocol):
    """One network's forward and backward pass; the gradients belong to the `forward` before them.

    Results are buffers that the next call overwrites.
    """

    def forward(self, inputs: Floats, *, same: bool = False) -> Floats:
        """(n, inputs) to (n, outputs), n at most the rows that the buffers were made for.

        With `same`, which saves work, the parameters are those of the call before.
        """

    def backward(self, by_output: Floats, *, add: bool = False) -> None:
        """Overwrites every parameter's `.grad`, or adds to it: `by_output` (n, outputs) is the derivative of some scalar."""

    def input_gradient(self, by_output: Floats) -> Floats:
        """The derivative (n, inputs) of that scalar by the inputs; leaves the parameters' `.grad` alone."""


def backward_of(network: Body, rows: int) -> Backward:
    """The written-out passes of a network, with buffers for that many rows."""
    return ResBlockBackward(network, rows) if isinstance(network, ResBlock) else MlpBackward(network, rows)


class TensorBackward:
    """The same for CPU tensors of any layout."""

    def __init__(self, passes: Backward) -> None:
        self._passes = passes

    def forward(self, inputs: Tensor) -> Tensor:
        """See `Backward.forward`."""
        return torch.from_numpy(self._passes.forward(_contiguous(inputs)))

    def backward(self, by_output: Tensor) -> None:
        """See `Backward.backward`."""
        self._passes.backward(_contiguous(by_output))

    def input_gradient(self, by_output: Tensor) -> Tensor:
        """See `Backward.input_gradient`."""
        return torch.from_numpy(self._passes.input_gradient(_contiguous(by_output)))


class _Layer:
    """One `nn.Linear` with buffers: `outputs`, after its activation, and `delta`, the derivative by its sums before it."""

    def __init__(self, layer: nn.Linear, rows: int, slope: float) -> None:
        self.weight, self._bias = _array(layer.weight), _array(layer.bias)
        self._by_weight, self._by_bias = _array(layer.weight.grad), _array(layer.bias.grad)
        self._transposed = np.empty(self.weight.shape[::-1], self.weight.dtype)
        self.slope = self.weight.dtype.type(slope)
        self.outputs = _buffer(self, rows, layer.out_features)
        self.delta = np.empty_like(self.outputs)

    def forward(self, inputs: Floats, same: bool) -> Floats:
        outputs = self.outputs[: len(inputs)]
        if not same:
            dense.transpose(self.weight, self._transposed)
        dense.dense(inputs, self._transposed, self._bias, self.slope, outputs)
        return outputs

    def backward(self, delta: Floats, inputs: Floats, add: bool) -> None:
        dense.parameter_gradients(delta, inputs, add, self._by_weight, self._by_bias)


class MlpBackward:
    """`Mlp`, forward and backward."""

    def __init__(self, network: Mlp, rows: int) -> None:
        self._tanh = network.activation == "tanh"
        slope = 1.0 if self._tanh else 0.0
        self._layers = [_Layer(layer, rows, slope) for layer in network.layers if isinstance(layer, nn.Linear)]
        self._layers.append(_Layer(network.head, rows, 1.0))
        self._by_input = _buffer(self._layers[0], rows, self._layers[0].weight.shape[1])
        self._inputs: Floats = self._by_input

    def forward(self, inputs: Floats, *, same: bool = False) -> Floats:
        """See `Backward.forward`."""
        self._inputs = values = inputs
        for layer in self._layers:
            values = layer.forward(values, same)
            if self._tanh and layer is not self._layers[-1]:
                np.tanh(values, out=values)
        return values

    def backward(self, by_output: Floats, *, add: bool = False) -> None:
        """See `Backward.backward`."""
        deltas = self._backpropagate(by_output)
        inputs = (self._inputs, *(layer.outputs[: len(by_output)] for layer in self._layers))
        for layer, delta, layer_inputs in zip(self._layers, deltas, inputs, strict=False):
            layer.backward(delta, layer_inputs, add)

    def input_gradient(self, by_output: Floats) -> Floats:
        """See `Backward.input_gradient`."""
        return np.dot(self._backpropagate(by_output)[0], self._layers[0].weight, out=self._by_input[: len(by_output)])

    def _backpropagate(self, by_output: Floats) -> list[Floats]:
        """The derivative by each layer's sums before its activation, first layer first."""
        rows = len(by_output)
        deltas = [by_output]
        for layer, below in zip(self._layers[:0:-1], self._layers[-2::-1], strict=True):
            outputs, delta = below.outputs[:rows], below.delta[:rows]
            if self._tanh:
                dense.dense_backward_tanh(deltas[-1], layer.weight, outputs, delta)
            else:
                dense.dense_backward(deltas[-1], layer.weight, outputs, below.slope, delta)
            deltas.append(delta)
        return deltas[::-1]


class ResBlockBackward:
    """`ResBlock`, forward and backward; names follow the layers in the paper's tables."""

    def __init__(self, network: ResBlock, rows: int) -> None:
        self._layer1, self._layer3 = _Layer(network.layer1, rows, LEAKY_SLOPE), _Layer(network.layer3, rows, LEAKY_SLOPE)
        self._layer2, self._layer4 = _Layer(network.layer2, rows, 1.0), _Layer(network.layer4, rows, LEAKY_SLOPE)
        self._head = _Layer(network.head, rows, 1.0)
        self._slope = self._layer4.slope
        width1, width2 = network.layer2.out_features, network.layer4.out_features
        self._concat1, self._by_concat1 = (_buffer(self._head, rows, 2 * width1) for _ in range(2))
        self._concat2, self._by_concat2 = (_buffer(self._head, rows, 2 * width2) for _ in range(2))
        self._shortcut1 = _buffer(self._head, rows, width1)
        self._shortcut2 = _buffer(self._head, rows, width2)
        self._by_input = _buffer(self._head, rows, width1)
        self._inputs: Floats = self._by_input

    def forward(self, inputs: Floats, *, same: bool = False) -> Floats:
        """See `Backward.forward`."""
        rows = len(inputs)
        self._inputs = inputs
        concat1, concat2 = self._concat1[:rows], self._concat2[:rows]
        hidden = self._layer2.forward(self._layer1.forward(inputs, same), same)
        dense.join(hidden, inputs, self._slope, concat1)
        hidden = self._layer4.forward(self._layer3.forward(concat1, same), same)
        dense.join(hidden, concat1, self._slope, concat2)
        return self._head.forward(concat2, same)

    def backward(self, by_output: Floats, *, add: bool = False) -> None:
        """See `Backward.backward`."""
        rows = len(by_output)
        self._backpropagate(by_output)
        self._head.backward(by_output, self._concat2[:rows], add)
        self._layer4.backward(self._layer4.delta[:rows], self._layer3.outputs[:rows], add)
        self._layer3.backward(self._layer3.delta[:rows], self._concat1[:rows], add)
        self._layer2.backward(self._layer2.delta[:rows], self._layer1.outputs[:rows], add)
        self._layer1.backward(self._layer1.delta[:rows], self._inputs, add)

    def input_gradient(self, by_output: Floats) -> Floats:
        """See `Backward.input_gradient`."""
        rows = len(by_output)
        self._backpropagate(by_output)
        by_input = np.dot(self._layer1.delta[:rows], self._layer1.weight, out=self._by_input[:rows])
        by_input += self._shortcut1[:rows]
        return by_input

    def _backpropagate(self, by_output: Floats) -> None:
        """Fills the deltas of layers 1 to 4 and the derivatives by what the two shortcuts carry."""
        rows, slope = len(by_output), self._slope
        layer1, layer2, layer3, layer4 = self._layer1, self._layer2, self._layer3, self._layer4
        concat1, by_concat1 = self._concat1[:rows], self._by_concat1[:rows]
        concat2, by_concat2 = self._concat2[:rows], self._by_concat2[:rows]
        shortcut1, shortcut2 = self._shortcut1[:rows], self._shortcut2[:rows]

        np.dot(by_output, self._head.weight, out=by_concat2)
        # Layer 4 has an activation of its own under that of the concatenation: the slope counts twice.
        dense.join_backward(by_concat2, concat2, slope * slope, slope, layer4.delta[:rows], shortcut2)
        dense.dense_backward(layer4.delta[:rows], layer4.weight, layer3.outputs[:rows], slope, layer3.delta[:rows])
        np.dot(layer3.delta[:rows], layer3.weight, out=by_concat1)
        by_concat1 += shortcut2
        dense.join_backward(by_concat1, concat1, slope, slope, layer2.delta[:rows], shortcut1)
        dense.dense_backward(layer2.delta[:rows], layer2.weight, layer1.outputs[:rows], slope, layer1.delta[:rows])


def _contiguous(tensor: Tensor) -> Floats:
    array: Floats = tensor.contiguous().numpy()
    return array


def _array(tensor: Tensor | None) -> Floats:
    assert tensor is not None, "FlatParameters gives every parameter its gradient"
    array: Floats = tensor.detach().numpy()
    return array


def _buffer(layer: _Layer, rows: int, columns: int) -> Floats:
    return np.empty((rows, columns), layer.weight.dtype)

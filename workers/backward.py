"""Backward passes of the two networks, written out: what autograd computes, without its bookkeeping.

At these sizes autograd spends as much time on its graph as on arithmetic. Each class here runs one network forward and
backward into buffers that it keeps, and writes the gradients into the parameters' `.grad`, which must exist. Autograd is
the reference: a test holds the two equal.
"""

from typing import Protocol

import torch
from torch import Tensor, nn

from workers.layout import LEAKY_SLOPE
from workers.networks import Body, Mlp, ResBlock

_aten = torch.ops.aten


class Backward(Protocol):
    """One network's forward and backward pass; the gradients belong to the `forward` before them."""

    def forward(self, inputs: Tensor) -> Tensor:
        """(n, inputs) to (n, outputs), n at most the batch size that the buffers were made for."""

    def backward(self, output_gradient: Tensor) -> None:
        """Overwrites every parameter's `.grad`, given the derivative (n, outputs) of a scalar by the outputs."""

    def input_gradient(self, output_gradient: Tensor) -> Tensor:
        """The derivative (n, inputs) of that scalar by the inputs; leaves the parameters' `.grad` alone."""


def backward_of(network: Body, batch_size: int) -> Backward:
    """The written-out passes of a network, with buffers for `batch_size` rows."""
    return ResBlockBackward(network, batch_size) if isinstance(network, ResBlock) else MlpBackward(network, batch_size)


class MlpBackward:
    """`Mlp`, forward and backward."""

    def __init__(self, network: Mlp, batch_size: int) -> None:
        self._layers = [layer for layer in network.layers if isinstance(layer, nn.Linear)]
        self._head = network.head
        self._relu = network.activation == "relu"
        self._hidden = [_buffer(layer, batch_size) for layer in self._layers]
        self._deltas = [_buffer(layer, batch_size) for layer in self._layers]
        self._inputs = torch.empty(0)

    def forward(self, inputs: Tensor) -> Tensor:
        """See `Backward.forward`."""
        self._inputs = inputs
        activate_ = torch.relu_ if self._relu else torch.tanh_
        hidden, rows = inputs, len(inputs)
        for layer, buffer in zip(self._layers, self._hidden, strict=True):
            hidden = activate_(_linear(layer, hidden, buffer[:rows]))
        return torch.addmm(self._head.bias, hidden, self._head.weight.t())

    def backward(self, output_gradient: Tensor) -> None:
        """See `Backward.backward`."""
        deltas = self._backpropagate(output_gradient)
        inputs = (self._inputs, *(hidden[: len(output_gradient)] for hidden in self._hidden))
        for layer, layer_inputs, delta in zip((*self._layers, self._head), inputs, deltas, strict=True):
            _parameter_gradients(layer, layer_inputs, delta)

    def input_gradient(self, output_gradient: Tensor) -> Tensor:
        """See `Backward.input_gradient`."""
        return self._backpropagate(output_gradient)[0] @ self._layers[0].weight

    def _backpropagate(self, output_gradient: Tensor) -> list[Tensor]:
        """The derivative by each layer's sum before its activation, first layer first."""
        rows = len(output_gradient)
        deltas = [output_gradient]
        for above, hidden, buffer in zip(
            (self._head, *reversed(self._layers[1:])), reversed(self._hidden), reversed(self._deltas), strict=True
        ):
            delta = torch.mm(deltas[-1], above.weight, out=buffer[:rows])
            if self._relu:
                _aten.threshold_backward.grad_input(delta, hidden[:rows], 0, grad_input=delta)
            else:
                _aten.tanh_backward.grad_input(delta, hidden[:rows], grad_input=delta)
            deltas.append(delta)
        return deltas[::-1]


class ResBlockBackward:
    """`ResBlock`, forward and backward; names follow the layers in the paper's tables."""

    def __init__(self, network: ResBlock, batch_size: int) -> None:
        self._net = network
        self._width1 = network.layer2.out_features
        self._width2 = network.layer4.out_features
        self._hidden1, self._delta1 = _buffer(network.layer1, batch_size), _buffer(network.layer1, batch_size)
        self._hidden3, self._delta3 = _buffer(network.layer3, batch_size), _buffer(network.layer3, batch_size)
        self._concat1 = network.head.weight.new_empty(batch_size, 2 * self._width1)
        self._concat2 = network.head.weight.new_empty(batch_size, 2 * self._width2)
        self._inputs = torch.empty(0)

    def forward(self, inputs: Tensor) -> Tensor:
        """See `Backward.forward`."""
        self._inputs = inputs
        net, rows = self._net, len(inputs)
        hidden1 = _leaky_(_linear(net.layer1, inputs, self._hidden1[:rows]))
        concat1 = self._concat1[:rows]
        concat1[:, : self._width1] = torch.addmm(net.layer2.bias, hidden1, net.layer2.weight.t())
        concat1[:, self._width1 :] = inputs
        _leaky_(concat1)
        hidden3 = _leaky_(_linear(net.layer3, concat1, self._hidden3[:rows]))
        concat2 = self._concat2[:rows]
        concat2[:, : self._width2] = _leaky_(torch.addmm(net.layer4.bias, hidden3, net.layer4.weight.t()))
        concat2[:, self._width2 :] = concat1
        _leaky_(concat2)
        return torch.addmm(net.head.bias, concat2, net.head.weight.t())

    def backward(self, output_gradient: Tensor) -> None:
        """See `Backward.backward`."""
        net, rows = self._net, len(output_gradient)
        delta1, delta2, delta3, delta4, _ = self._backpropagate(output_gradient)
        _parameter_gradients(net.head, self._concat2[:rows], output_gradient)
        _parameter_gradients(net.layer4, self._hidden3[:rows], delta4)
        _parameter_gradients(net.layer3, self._concat1[:rows], delta3)
        _parameter_gradients(net.layer2, self._hidden1[:rows], delta2)
        _parameter_gradients(net.layer1, self._inputs, delta1)

    def input_gradient(self, output_gradient: Tensor) -> Tensor:
        """See `Backward.input_gradient`."""
        delta1, _, _, _, shortcut = self._backpropagate(output_gradient)
        return torch.addmm(shortcut, delta1, self._net.layer1.weight)

    def _backpropagate(self, output_gradient: Tensor) -> tuple[Tensor, Tensor, Tensor, Tensor, Tensor]:
        """The derivatives by the sums of layers 1 to 4 before activation, and by the inputs over the first shortcut."""
        net, rows = self._net, len(output_gradient)
        concat1, concat2 = self._concat1[:rows], self._concat2[:rows]
        delta_concat2 = _through_leaky(output_gradient @ net.head.weight, concat2)
        delta4 = _through_leaky(delta_concat2[:, : self._width2], concat2[:, : self._width2])
        delta3 = torch.mm(delta4, net.layer4.weight, out=self._delta3[:rows])
        _through_leaky(delta3, self._hidden3[:rows])
        delta_concat1 = torch.addmm(delta_concat2[:, self._width2 :], delta3, net.layer3.weight)
        _through_leaky(delta_concat1, concat1)
        delta2 = delta_concat1[:, : self._width1]
        delta1 = torch.mm(delta2, net.layer2.weight, out=self._delta1[:rows])
        _through_leaky(delta1, self._hidden1[:rows])
        return delta1, delta2, delta3, delta4, delta_concat1[:, self._width1 :]


def _buffer(layer: nn.Linear, rows: int) -> Tensor:
    return layer.weight.new_empty(rows, layer.out_features)


def _linear(layer: nn.Linear, inputs: Tensor, out: Tensor) -> Tensor:
    return torch.addmm(layer.bias, inputs, layer.weight.t(), out=out)


def _leaky_(values: Tensor) -> Tensor:
    return nn.functional.leaky_relu_(values, LEAKY_SLOPE)


def _through_leaky(delta: Tensor, result: Tensor) -> Tensor:
    """In place: the slope's sign can be read from the result as well as from the argument."""
    _aten.leaky_relu_backward.grad_input(delta, result, LEAKY_SLOPE, True, grad_input=delta)
    return delta


def _parameter_gradients(layer: nn.Linear, inputs: Tensor, delta: Tensor) -> None:
    torch.mm(delta.t(), inputs, out=layer.weight.grad)
    torch.sum(delta, 0, out=layer.bias.grad)

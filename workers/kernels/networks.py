"""Whole networks forward and backward, compiled: what autograd computes, without its bookkeeping or a call for each layer.

Results are buffers that the next call overwrites.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workers.kernels.blas import multiply
from workers.kernels.constants import LEAKY_SLOPE
from workers.kernels.dense import (
    dense,
    dense_backward,
    dense_backward_tanh,
    join,
    join_backward,
    parameter_gradients,
    tanh,
    transpose,
)
from workers.kernels.options import kernel

RELU, TANH, RESBLOCK = range(3)
"""Kinds: fully connected with either activation, and the paper's residual blocks."""

WEIGHT, BIAS, TRANSPOSED, INPUTS, OUTPUTS = range(5)
"""Columns of `Passes.layers`."""

START, COLUMNS = range(2)
"""Columns of `Passes.buffers`."""

# ResBlock's layers by the names of the paper's tables, and the buffers that follow those of its layers.
_LAYER1, _LAYER2, _LAYER3, _LAYER4, _HEAD, _JOINED1, _JOINED2, _SHORTCUT1, _SHORTCUT2 = range(9)

_ZERO, _ONE, _SLOPE = np.float32(0.0), np.float32(1.0), np.float32(LEAKY_SLOPE)


class Passes(NamedTuple):
    """A network, of one type whatever its layers, so that it is compiled once.

    Attributes:
        kind: `RELU`, `TANH` or `RESBLOCK`.
        layers: (L, 5) of each layer, the head last: where its weight (out, in) and its bias begin in `values` and
            `gradients`, where the transposed weight begins in `transposed`, in, out.
        buffers: (B, 2) of each layer, then of ResBlock's joints and shortcuts, then of the network's inputs: where the first
            row begins in `outputs` and `deltas`, columns.
        values: (P,) a vector that holds the network's parameters, and perhaps others'.
        gradients: (P,) theirs, in the same places.
        transposed: the weights transposed.
        outputs: what the layers put out after their activation, and the joints.
        deltas: the derivatives by the layers' sums before their activation, by the joints, and by the inputs.
    """

    kind: int
    layers: NDArray[np.int64]
    buffers: NDArray[np.int64]
    values: NDArray[np.float32]
    gradients: NDArray[np.float32]
    transposed: NDArray[np.float32]
    outputs: NDArray[np.float32]
    deltas: NDArray[np.float32]


@kernel(allocates=True)
def forward(network, inputs, same):
    """(n, inputs) to (n, outputs); with `same`, which saves work, the parameters are those of the call before."""
    if not same:
        for layer in range(network.layers.shape[0]):
            transpose(_weight(network, layer), _transposed(network, layer))
    if network.kind == RESBLOCK:
        return _resblock_forward(network, inputs)
    return _mlp_forward(network, inputs)


@kernel(allocates=True)
def backward(network, inputs, grad_output, add):
    """Overwrites the parameters' gradients, or adds to them, after `forward` of the same inputs.

    `grad_output` (n, outputs) is the derivative of some scalar by what came out.
    """
    if network.kind == RESBLOCK:
        _resblock_backpropagate(network, grad_output)
        _resblock_gradients(network, inputs, grad_output, add)
    else:
        _mlp_backpropagate(network, grad_output)
        _mlp_gradients(network, inputs, grad_output, add)


@kernel(allocates=True)
def input_gradient(network, grad_output):
    """The derivative (n, inputs) of that scalar by the inputs; leaves the parameters' gradients alone."""
    rows = grad_output.shape[0]
    grad_inputs = _buffer(network.deltas, network, network.buffers.shape[0] - 1, rows)
    if network.kind == RESBLOCK:
        _resblock_backpropagate(network, grad_output)
        grad_inputs[:] = _buffer(network.deltas, network, _SHORTCUT1, rows)
        delta, add = _buffer(network.deltas, network, _LAYER1, rows), True
    else:
        delta, add = _mlp_backpropagate(network, grad_output), False
    multiply(delta, False, _weight(network, 0), add, grad_inputs)
    return grad_inputs


@kernel(allocates=True)
def _mlp_forward(network, inputs):
    """`Mlp`."""
    slope = _ONE if network.kind == TANH else _ZERO
    head = network.layers.shape[0] - 1
    values = inputs
    for layer in range(head + 1):
        values = _layer_forward(network, layer, values, _ONE if layer == head else slope)
        if network.kind == TANH and layer < head:
            tanh(values)
    return values


@kernel(allocates=True)
def _mlp_backpropagate(network, grad_output):
    """Fills the deltas of all layers but the head, whose delta is `grad_output`; returns the first layer's."""
    rows = grad_output.shape[0]
    above = grad_output
    for layer in range(network.layers.shape[0] - 1, 0, -1):
        outputs, delta = _both(network, layer - 1, rows)
        if network.kind == TANH:
            dense_backward_tanh(above, _weight(network, layer), outputs, delta)
        else:
            dense_backward(above, _weight(network, layer), outputs, _ZERO, delta)
        above = delta
    return above


@kernel(allocates=True)
def _mlp_gradients(network, inputs, grad_output, add):
    """The parameters' gradients, given the deltas."""
    rows = grad_output.shape[0]
    head = network.layers.shape[0] - 1
    below = inputs
    for layer in range(head):
        outputs, delta = _both(network, layer, rows)
        _layer_gradients(network, layer, delta, below, add)
        below = outputs
    _layer_gradients(network, head, grad_output, below, add)


@kernel(allocates=True)
def _resblock_forward(network, inputs):
    """`ResBlock`."""
    rows = inputs.shape[0]
    joined1 = _buffer(network.outputs, network, _JOINED1, rows)
    joined2 = _buffer(network.outputs, network, _JOINED2, rows)
    hidden = _layer_forward(network, _LAYER1, inputs, _SLOPE)
    join(_layer_forward(network, _LAYER2, hidden, _ONE), inputs, _SLOPE, joined1)
    hidden = _layer_forward(network, _LAYER3, joined1, _SLOPE)
    join(_layer_forward(network, _LAYER4, hidden, _SLOPE), joined1, _SLOPE, joined2)
    return _layer_forward(network, _HEAD, joined2, _ONE)


@kernel(allocates=True)
def _resblock_backpropagate(network, grad_output):
    """Fills the deltas of layers 1 to 4 and the derivatives by what the two shortcuts carry."""
    rows = grad_output.shape[0]
    joined1, grad_joined1 = _both(network, _JOINED1, rows)
    joined2, grad_joined2 = _both(network, _JOINED2, rows)
    grad_shortcut1 = _buffer(network.deltas, network, _SHORTCUT1, rows)
    grad_shortcut2 = _buffer(network.deltas, network, _SHORTCUT2, rows)
    outputs1, delta1 = _both(network, _LAYER1, rows)
    delta2 = _buffer(network.deltas, network, _LAYER2, rows)
    outputs3, delta3 = _both(network, _LAYER3, rows)
    delta4 = _buffer(network.deltas, network, _LAYER4, rows)

    multiply(grad_output, False, _weight(network, _HEAD), False, grad_joined2)
    # Layer 4 has an activation of its own under that of the joint: the slope counts twice.
    join_backward(grad_joined2, joined2, _SLOPE * _SLOPE, _SLOPE, delta4, grad_shortcut2)
    dense_backward(delta4, _weight(network, _LAYER4), outputs3, _SLOPE, delta3)
    grad_joined1[:] = grad_shortcut2
    multiply(delta3, False, _weight(network, _LAYER3), True, grad_joined1)
    join_backward(grad_joined1, joined1, _SLOPE, _SLOPE, delta2, grad_shortcut1)
    dense_backward(delta2, _weight(network, _LAYER2), outputs1, _SLOPE, delta1)


@kernel(allocates=True)
def _resblock_gradients(network, inputs, grad_output, add):
    """The parameters' gradients, given the deltas."""
    rows = grad_output.shape[0]
    outputs1, delta1 = _both(network, _LAYER1, rows)
    outputs3, delta3 = _both(network, _LAYER3, rows)
    joined1 = _buffer(network.outputs, network, _JOINED1, rows)
    _layer_gradients(network, _LAYER1, delta1, inputs, add)
    _layer_gradients(network, _LAYER2, _buffer(network.deltas, network, _LAYER2, rows), outputs1, add)
    _layer_gradients(network, _LAYER3, delta3, joined1, add)
    _layer_gradients(network, _LAYER4, _buffer(network.deltas, network, _LAYER4, rows), outputs3, add)
    _layer_gradients(network, _HEAD, grad_output, _buffer(network.outputs, network, _JOINED2, rows), add)


@kernel(allocates=True)
def _layer_forward(network, layer, inputs, slope):
    """What a layer puts out."""
    outputs = _buffer(network.outputs, network, layer, inputs.shape[0])
    dense(inputs, _transposed(network, layer), _bias(network.values, network, layer), slope, outputs)
    return outputs


@kernel(allocates=True)
def _layer_gradients(network, layer, delta, inputs, add):
    """A layer's gradients."""
    start, wide, tall = network.layers[layer, WEIGHT], network.layers[layer, INPUTS], network.layers[layer, OUTPUTS]
    grad_weight = network.gradients[start : start + wide * tall].reshape(tall, wide)
    parameter_gradients(delta, inputs, add, grad_weight, _bias(network.gradients, network, layer))


@kernel(allocates=True)
def _weight(network, layer):
    """(out, in)."""
    start, wide, tall = network.layers[layer, WEIGHT], network.layers[layer, INPUTS], network.layers[layer, OUTPUTS]
    return network.values[start : start + wide * tall].reshape(tall, wide)


@kernel(allocates=True)
def _transposed(network, layer):
    """(in, out)."""
    start, wide, tall = network.layers[layer, TRANSPOSED], network.layers[layer, INPUTS], network.layers[layer, OUTPUTS]
    return network.transposed[start : start + wide * tall].reshape(wide, tall)


@kernel(allocates=True)
def _bias(vector, network, layer):
    """(out,) of the values or of the gradients."""
    start = network.layers[layer, BIAS]
    return vector[start : start + network.layers[layer, OUTPUTS]]


@kernel(allocates=True)
def _buffer(vector, network, index, rows):
    """(rows, columns) of the outputs or of the deltas."""
    start, columns = network.buffers[index, START], network.buffers[index, COLUMNS]
    return vector[start : start + rows * columns].reshape(rows, columns)


@kernel(allocates=True)
def _both(network, index, rows):
    """Outputs and deltas."""
    return _buffer(network.outputs, network, index, rows), _buffer(network.deltas, network, index, rows)

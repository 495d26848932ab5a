"""Fully connected layers forward and backward, compiled: BLAS for the products, and all that surrounds one in the same call.

Matrices of some hundred rows are multiplied so quickly that calls and passes over memory around the products take as long
again. All functions take float32 matrices, rows contiguous, and write into what the caller gives them.

An activation is its slope where its argument is negative: 1 is none, 0 ReLU, between them LeakyReLU. The sign of its result
is that of its argument, so that the derivative can be read from the result. NaN stays NaN everywhere.
"""

import numpy as np

from workers.kernels.blas import multiply
from workers.kernels.options import kernel

# tanh x = x P(x^2) / Q(x^2), fitted to the least relative error, 2.1e-8, for |x| up to 9; beyond that it is 1 in a float32.
# Unlike the library's function this is computed for many numbers at once: 30 times as quickly.
_P = tuple(map(np.float32, (0.99999998, 0.133809811, 3.49553449e-3, 2.06081841e-5, 1.33534121e-8)))
_Q = tuple(map(np.float32, (1.0, 0.467142968, 2.58767798e-2, 3.28554625e-4, 7.77604676e-7)))
_SATURATED = np.float32(9.0)

_ZERO, _ONE = np.float32(0.0), np.float32(1.0)


@kernel()
def transpose(matrix, transposed):
    """Writes transposed (n, m) = matrix (m, n)^T."""
    for j in range(matrix.shape[1]):
        for i in range(matrix.shape[0]):
            transposed[j, i] = matrix[i, j]


@kernel()
def dense(inputs, transposed, bias, slope, outputs):
    """Forward: outputs (n, out) = f(inputs (n, in) transposed (in, out) + bias (out,)), given the transposed weight."""
    multiply(inputs, False, transposed, False, outputs)
    for i in range(outputs.shape[0]):
        for j in range(outputs.shape[1]):
            total = outputs[i, j] + bias[j]
            outputs[i, j] = total if total > _ZERO else slope * total


@kernel()
def tanh(values):
    """Replaces values (n, m) by their tanh."""
    for i in range(values.shape[0]):
        for j in range(values.shape[1]):
            x = values[i, j]
            x = max(min(x, _SATURATED), -_SATURATED)
            square = x * x
            p = (((_P[4] * square + _P[3]) * square + _P[2]) * square + _P[1]) * square + _P[0]
            q = (((_Q[4] * square + _Q[3]) * square + _Q[2]) * square + _Q[1]) * square + _Q[0]
            values[i, j] = max(min(x * p / q, _ONE), -_ONE)


@kernel()
def dense_backward(delta, weight, below, slope, delta_below):
    """Backward: delta_below (n, in) = (delta (n, out) weight (out, in)) f'(below (n, in)); `below` came out of f."""
    multiply(delta, False, weight, False, delta_below)
    for i in range(delta_below.shape[0]):
        for j in range(delta_below.shape[1]):
            value = delta_below[i, j]
            delta_below[i, j] = value if below[i, j] > _ZERO else slope * value


@kernel()
def dense_backward_tanh(delta, weight, below, delta_below):
    """The same where what went into the layer came out of a tanh, whose derivative is 1 - tanh^2."""
    multiply(delta, False, weight, False, delta_below)
    for i in range(delta_below.shape[0]):
        for j in range(delta_below.shape[1]):
            delta_below[i, j] *= _ONE - below[i, j] * below[i, j]


@kernel()
def parameter_gradients(delta, inputs, add, grad_weight, grad_bias):
    """Backward: grad_weight (out, in) = delta (n, out)^T inputs (n, in) and grad_bias (out,) = the sum of delta's rows.

    With `add` both are added to what is there.
    """
    multiply(delta, True, inputs, add, grad_weight)
    if not add:
        grad_bias[:] = 0
    for i in range(delta.shape[0]):
        for j in range(delta.shape[1]):
            grad_bias[j] += delta[i, j]


@kernel()
def join(left, right, slope, joined):
    """A shortcut: joined (n, a + b) = f(concatenation of left (n, a) and right (n, b))."""
    width = left.shape[1]
    for i in range(joined.shape[0]):
        for j in range(width):
            value = left[i, j]
            joined[i, j] = value if value > _ZERO else slope * value
        for j in range(right.shape[1]):
            value = right[i, j]
            joined[i, width + j] = value if value > _ZERO else slope * value


@kernel()
def join_backward(delta, joined, left_slope, right_slope, left_delta, right_delta):
    """Backward: left_delta (n, a), right_delta (n, b) = the columns of delta (n, a + b), each times f' of its side."""
    width = left_delta.shape[1]
    for i in range(joined.shape[0]):
        for j in range(width):
            value = delta[i, j]
            left_delta[i, j] = value if joined[i, j] > _ZERO else left_slope * value
        for j in range(right_delta.shape[1]):
            value = delta[i, width + j]
            right_delta[i, j] = value if joined[i, width + j] > _ZERO else right_slope * value

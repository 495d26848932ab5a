"""Fully connected layers forward and backward, compiled: BLAS for the products, and all that surrounds one in the same call.

Matrices of some hundred rows are multiplied so quickly that calls and passes over memory around the products take as long
again. All functions take float32 or float64 matrices, rows contiguous, and write into what the caller gives them.

An activation is its slope where its argument is negative: 1 is none, 0 ReLU, between them LeakyReLU. The sign of its result
is that of its argument, so that the derivative can be read from the result. NaN stays NaN everywhere.
"""

import numba as nb
import numpy as np
import scipy.linalg.cython_blas  # noqa: F401  # where Numba's products find BLAS: loaded before the limit below
from threadpoolctl import threadpool_limits

# Threads that wait for one another over matrices this small take ten times the processor time that they save.
threadpool_limits(limits=1, user_api="blas")


@nb.njit(cache=True, nogil=True, error_model="numpy")
def dense(inputs, weight, bias, slope, outputs):
    """Forward: outputs (n, out) = f(inputs (n, in) weight (out, in)^T + bias (out,))."""
    zero = outputs.dtype.type(0)
    np.dot(inputs, weight.T, outputs)
    for i in range(outputs.shape[0]):
        for j in range(outputs.shape[1]):
            total = outputs[i, j] + bias[j]
            outputs[i, j] = total if total > zero else slope * total


@nb.njit(cache=True, nogil=True, error_model="numpy")
def dense_backward(delta, weight, below, slope, delta_below):
    """Backward: delta_below (n, in) = (delta (n, out) weight (out, in)) f'(below (n, in)); `below` came out of f."""
    zero = below.dtype.type(0)
    np.dot(delta, weight, delta_below)
    for i in range(delta_below.shape[0]):
        for j in range(delta_below.shape[1]):
            value = delta_below[i, j]
            delta_below[i, j] = value if below[i, j] > zero else slope * value


@nb.njit(cache=True, nogil=True, error_model="numpy")
def dense_backward_tanh(delta, weight, below, delta_below):
    """The same where what went into the layer came out of a tanh, whose derivative is 1 - tanh^2."""
    one = below.dtype.type(1)
    np.dot(delta, weight, delta_below)
    for i in range(delta_below.shape[0]):
        for j in range(delta_below.shape[1]):
            delta_below[i, j] *= one - below[i, j] * below[i, j]


@nb.njit(cache=True, nogil=True, error_model="numpy")
def parameter_gradients(delta, inputs, add, scratch, by_weight, by_bias):
    """Backward: by_weight (out, in) = delta (n, out)^T inputs (n, in) and by_bias (out,) = the sum of delta's rows.

    With `add` both are added to what is there; `scratch` (out, in) is overwritten then.
    """
    if add:
        np.dot(delta.T, inputs, scratch)
        for i in range(by_weight.shape[0]):
            for j in range(by_weight.shape[1]):
                by_weight[i, j] += scratch[i, j]
    else:
        np.dot(delta.T, inputs, by_weight)
        by_bias[:] = 0
    for i in range(delta.shape[0]):
        for j in range(delta.shape[1]):
            by_bias[j] += delta[i, j]


@nb.njit(cache=True, nogil=True, error_model="numpy")
def join(left, right, slope, joined):
    """A shortcut: joined (n, a + b) = f(concatenation of left (n, a) and right (n, b))."""
    zero = joined.dtype.type(0)
    width = left.shape[1]
    for i in range(joined.shape[0]):
        for j in range(width):
            value = left[i, j]
            joined[i, j] = value if value > zero else slope * value
        for j in range(right.shape[1]):
            value = right[i, j]
            joined[i, width + j] = value if value > zero else slope * value


@nb.njit(cache=True, nogil=True, error_model="numpy")
def join_backward(delta, joined, left_slope, right_slope, left_delta, right_delta):
    """Backward: left_delta (n, a), right_delta (n, b) = the columns of delta (n, a + b), each times f' of its side."""
    zero = joined.dtype.type(0)
    width = left_delta.shape[1]
    for i in range(joined.shape[0]):
        for j in range(width):
            value = delta[i, j]
            left_delta[i, j] = value if joined[i, j] > zero else left_slope * value
        for j in range(right_delta.shape[1]):
            value = delta[i, width + j]
            right_delta[i, j] = value if joined[i, width + j] > zero else right_slope * value

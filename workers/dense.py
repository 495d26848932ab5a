"""Fully connected layers forward and backward, compiled: BLAS for the products, and all that surrounds one in the same call.

Matrices of some hundred rows are multiplied so quickly that calls and passes over memory around the products take as long
again. All functions take float32 or float64 matrices, rows contiguous, and write into what the caller gives them.

The fewer rows, the quicker: OpenBLAS multiplies matrices with up to `SMALL_PRODUCT` multiplications by kernels that read them
where they lie, and larger ones after copying them. On a core with AVX-512 the former do 110 billion operations a second
where the latter do 54 to 90. They are slow only where rows are multiplied by rows (`inputs weight^T`), so that layers
work with weights that have been transposed.

An activation is its slope where its argument is negative: 1 is none, 0 ReLU, between them LeakyReLU. The sign of its result
is that of its argument, so that the derivative can be read from the result. NaN stays NaN everywhere.
"""

import numba as nb
import numpy as np
import scipy.linalg.cython_blas  # noqa: F401  # loads the BLAS that is called below, before its threads are limited
from llvmlite.binding import add_symbol
from numba import types
from numba.core import cgutils
from numba.extending import get_cython_function_address, intrinsic
from threadpoolctl import threadpool_limits

SMALL_PRODUCT = 1_000_000
"""Multiplications of a matrix product that OpenBLAS counts as small."""

# Threads that wait for one another over matrices this small take ten times the processor time that they save.
threadpool_limits(limits=1, user_api="blas")


def _blas(name):
    """A routine of BLAS for compiled code, found by name: kept code must not hold addresses. Fortran passes addresses only."""
    symbol = f"mapless_{name}"
    add_symbol(symbol, get_cython_function_address("scipy.linalg.cython_blas", name))
    return types.ExternalFunction(symbol, types.void(*[types.intp] * 13))


_sgemm, _dgemm = _blas("sgemm"), _blas("dgemm")
_AS_IT_IS, _TRANSPOSED = np.uint8(ord("N")), np.uint8(ord("T"))


@intrinsic
def _address(_, value):
    """Where a copy of a number lies, until the function that calls this returns."""

    def build(context, builder, _, arguments):
        slot = cgutils.alloca_once_value(builder, arguments[0])
        return builder.ptrtoint(slot, context.get_value_type(types.intp))

    return types.intp(value), build


@nb.njit(cache=True, nogil=True, error_model="numpy")
def multiply(a, a_transposed, b, b_transposed, add, product):
    """product (m, n) = A (m, k) B (k, n), added to what is there with `add`; A is a or a^T, B is b or b^T."""
    rows, columns = product.shape
    inner = a.shape[0] if a_transposed else a.shape[1]
    # Fortran's matrices are ours transposed: product^T = B^T A^T.
    first = _address(_TRANSPOSED if b_transposed else _AS_IT_IS)
    second = _address(_TRANSPOSED if a_transposed else _AS_IT_IS)
    m, n, k = _address(np.int32(columns)), _address(np.int32(rows)), _address(np.int32(inner))
    row_b, row_a = _address(np.int32(b.shape[1])), _address(np.int32(a.shape[1]))
    one = product.dtype.type(1)
    alpha, beta = _address(one), _address(one if add else product.dtype.type(0))
    at_b, at_a, at_product = b.ctypes.data, a.ctypes.data, product.ctypes.data
    if product.itemsize == 4:
        _sgemm(first, second, m, n, k, alpha, at_b, row_b, at_a, row_a, beta, at_product, m)
    else:
        _dgemm(first, second, m, n, k, alpha, at_b, row_b, at_a, row_a, beta, at_product, m)


@nb.njit(cache=True, nogil=True, error_model="numpy")
def transpose(matrix, transposed):
    """transposed (n, m) = matrix (m, n)^T."""
    for j in range(matrix.shape[1]):
        for i in range(matrix.shape[0]):
            transposed[j, i] = matrix[i, j]


@nb.njit(cache=True, nogil=True, error_model="numpy")
def dense(inputs, transposed, bias, slope, outputs):
    """Forward: outputs (n, out) = f(inputs (n, in) transposed (in, out) + bias (out,)), given the transposed weight."""
    zero = outputs.dtype.type(0)
    multiply(inputs, False, transposed, False, False, outputs)
    for i in range(outputs.shape[0]):
        for j in range(outputs.shape[1]):
            total = outputs[i, j] + bias[j]
            outputs[i, j] = total if total > zero else slope * total


@nb.njit(cache=True, nogil=True, error_model="numpy")
def dense_backward(delta, weight, below, slope, delta_below):
    """Backward: delta_below (n, in) = (delta (n, out) weight (out, in)) f'(below (n, in)); `below` came out of f."""
    zero = below.dtype.type(0)
    multiply(delta, False, weight, False, False, delta_below)
    for i in range(delta_below.shape[0]):
        for j in range(delta_below.shape[1]):
            value = delta_below[i, j]
            delta_below[i, j] = value if below[i, j] > zero else slope * value


@nb.njit(cache=True, nogil=True, error_model="numpy")
def dense_backward_tanh(delta, weight, below, delta_below):
    """The same where what went into the layer came out of a tanh, whose derivative is 1 - tanh^2."""
    one = below.dtype.type(1)
    multiply(delta, False, weight, False, False, delta_below)
    for i in range(delta_below.shape[0]):
        for j in range(delta_below.shape[1]):
            delta_below[i, j] *= one - below[i, j] * below[i, j]


@nb.njit(cache=True, nogil=True, error_model="numpy")
def parameter_gradients(delta, inputs, add, by_weight, by_bias):
    """Backward: by_weight (out, in) = delta (n, out)^T inputs (n, in) and by_bias (out,) = the sum of delta's rows.

    With `add` both are added to what is there.
    """
    multiply(delta, True, inputs, False, add, by_weight)
    if not add:
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

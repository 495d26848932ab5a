"""Matrix products in compiled code, by the BLAS that SciPy comes with.

On processors with AVX-512 the smaller is the quicker: there OpenBLAS multiplies matrices with up to `SMALL_PRODUCT`
multiplications by kernels that read them where they lie, which do 110 billion operations a second, and larger ones after
copying them, with 54 to 90. The small ones are slow only where rows are multiplied by rows, A B^T. Elsewhere all are copied.
"""

from typing import Any

import numpy as np
import scipy.linalg.cython_blas  # noqa: F401  # loads the BLAS that is called below, before its threads are limited
from llvmlite.binding import add_symbol
from numba import types
from numba.core import cgutils
from numba.extending import get_cython_function_address, intrinsic
from threadpoolctl import threadpool_info, threadpool_limits

from workers.kernels.options import kernel

SMALL_PRODUCT = 1_000_000
"""Multiplications of a matrix product that OpenBLAS counts as small."""

_FEWEST_ROWS = 16  # Wider matrices are multiplied faster all at once than in slices as thin as this.
_CORES_WITH_SMALL_KERNELS = {"skylakex", "cooperlake", "sapphirerapids"}

# Threads that wait for one another over matrices this small take ten times the processor time that they save.
threadpool_limits(limits=1, user_api="blas")

_SLICES = any(library.get("architecture", "").lower() in _CORES_WITH_SMALL_KERNELS for library in threadpool_info())


# Kept code must not hold addresses, so it finds the routine by this name. Fortran takes addresses only.
add_symbol("mapless_sgemm", get_cython_function_address("scipy.linalg.cython_blas", "sgemm"))
_sgemm = types.ExternalFunction("mapless_sgemm", types.void(*[types.intp] * 13))

_AS_IT_IS, _TRANSPOSED = np.uint8(ord("N")), np.uint8(ord("T"))
_ZERO, _ONE = np.float32(0.0), np.float32(1.0)


def _on_stack(_, value):
    """Where a copy of a number lies, until the function that calls this returns."""

    def build(context, builder, _, arguments):
        slot = cgutils.alloca_once_value(builder, arguments[0])
        return builder.ptrtoint(slot, context.get_value_type(types.intp))

    return types.intp(value), build


_address: Any = intrinsic(_on_stack)


@kernel()
def multiply(a, transposed, b, add, product):
    """Writes product (m, n) = A (m, k) B (k, n), or adds to it with `add`; A is a, or a^T where `transposed`.

    All are float32 with contiguous rows, at least one. Where that pays, computed in small products, as equal as can be, by
    slices of the rows of a: rows of the product, or where a is transposed parts of each of its sums.
    """
    rows = a.shape[0]
    most = SMALL_PRODUCT // (product.shape[1] * a.shape[1]) if _SLICES else rows
    pieces = (rows + most - 1) // most if most >= _FEWEST_ROWS else 1
    each = (rows + pieces - 1) // pieces
    for first in range(0, rows, each):
        some = a[first : first + each]
        if transposed:
            _multiply(some, True, b[first : first + each], add or first > 0, product)
        else:
            _multiply(some, False, b, add, product[first : first + each])


@kernel()
def _multiply(a, transposed, b, add, product):
    """The same as one product."""
    rows, columns = product.shape
    # Fortran's matrices are ours transposed: product^T = B^T A^T.
    first, second = _address(_AS_IT_IS), _address(_TRANSPOSED if transposed else _AS_IT_IS)
    m, n, k = _address(np.int32(columns)), _address(np.int32(rows)), _address(np.int32(b.shape[0]))
    row_b, row_a = _address(np.int32(b.shape[1])), _address(np.int32(a.shape[1]))
    alpha, beta = _address(_ONE), _address(_ONE if add else _ZERO)
    at_b, at_a, at_product = b.ctypes.data, a.ctypes.data, product.ctypes.data
    _sgemm(first, second, m, n, k, alpha, at_b, row_b, at_a, row_a, beta, at_product, m)

"""The learners' kernels on their own: matrix products of every shape, and a tanh as good as the library's."""

import numpy as np
import pytest

from workers.kernels.blas import SMALL_PRODUCT, multiply
from workers.kernels.dense import tanh

F = np.float32


@pytest.mark.parametrize(
    ("m", "k", "n"),
    [
        (1, 1, 1),
        (3, 2, 5),
        (61, 128, 128),  # a small product as it is
        (62, 128, 128),  # in two slices
        (100, 512, 64),
        (40, 300, 400),  # too wide for slices
    ],
)
@pytest.mark.parametrize("transposed", [False, True])
@pytest.mark.parametrize("add", [False, True])
def test_products_equal_numpys(m: int, k: int, n: int, transposed: bool, add: bool) -> None:
    rng = np.random.default_rng(0)
    a, b, before = (rng.normal(size=shape).astype(F) for shape in ((m, k), (k, n), (m, n)))
    product = before.copy()
    multiply(np.ascontiguousarray(a.T) if transposed else a, transposed, b, add, product)
    np.testing.assert_allclose(product, a @ b + add * before, rtol=0, atol=2e-4)


def test_transposed_products_are_sliced_too() -> None:
    """The rows of a are summed over then: every slice but the first adds to what those before it left."""
    rows = 2 * SMALL_PRODUCT // (64 * 64) + 1
    rng = np.random.default_rng(1)
    a, b = rng.normal(size=(rows, 64)).astype(F), rng.normal(size=(rows, 64)).astype(F)
    product = np.full((64, 64), np.nan, F)
    multiply(a, True, b, False, product)
    np.testing.assert_allclose(product, a.T @ b, rtol=0, atol=2e-4)


def test_tanh_is_that_of_the_library() -> None:
    x = np.concatenate([np.linspace(-12, 12, 100_001), np.logspace(-30, 0, 1000), [np.inf, -np.inf, 0.0]]).astype(F)
    values = x[None].copy()
    tanh(values)
    # Half a unit in the last place is the rounding; the quotient and the product of two roundings leave some more.
    np.testing.assert_allclose(values[0], np.tanh(x.astype(np.float64)), rtol=4e-7, atol=0)
    assert np.abs(values).max() <= 1.0


def test_tanh_of_nan_stays_nan() -> None:
    values = np.array([[np.nan, 1.0]], F)
    tanh(values)
    assert np.isnan(values[0, 0])
    assert not np.isnan(values[0, 1])

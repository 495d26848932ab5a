"""Adam and clipping over flat float32 vectors, one compiled pass each; the formulas are in `workers.algorithms.flat`."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from workers.kernels.options import kernel

BETA1, BETA2 = 0.9, 0.999
EPSILON = 1e-8


class AdamSteps(NamedTuple):
    """Steps to be taken in compiled code, each module's gradient clipped by itself.

    Attributes:
        mean: (n,) float32, Adam's first moments.
        square: (n,) float32, its second.
        starts: (modules + 1,) int64, where each module begins in the vectors, and their end.
        rates: (steps,) float64, see `adam_step`.
        epsilons: (steps,) float64.
        max_norm: of a module's gradient.
    """

    mean: NDArray[np.float32]
    square: NDArray[np.float32]
    starts: NDArray[np.int64]
    rates: NDArray[np.float64]
    epsilons: NDArray[np.float64]
    max_norm: float


@kernel()
def adam_step(values, gradients, mean, square, rate, epsilon):
    """Update moments and values (n,), given the rate and epsilon that both bias corrections leave."""
    keep1, keep2 = np.float32(BETA1), np.float32(BETA2)
    take1, take2 = np.float32(1.0 - BETA1), np.float32(1.0 - BETA2)
    rate, epsilon = np.float32(rate), np.float32(epsilon)
    for i in range(values.shape[0]):
        gradient = gradients[i]
        mean[i] = keep1 * mean[i] + take1 * gradient
        square[i] = keep2 * square[i] + take2 * gradient * gradient
        values[i] -= rate * mean[i] / (math.sqrt(square[i]) + epsilon)


# The order of a sum is free, or it would be added up one by one; NaN stays NaN.
@kernel(fastmath={"reassoc"})
def clip_norm(gradients, max_norm):
    """Scale gradients (n,) to at most this 2-norm."""
    total = 0.0
    for i in range(gradients.shape[0]):
        total += gradients[i] * gradients[i]
    norm = math.sqrt(total) + 1e-6
    if not norm <= max_norm:
        factor = np.float32(max_norm / norm)
        for i in range(gradients.shape[0]):
            gradients[i] *= factor


@kernel()
def clipped_step(values, gradients, steps, module, step):
    """Clip a module's gradient and move its values against it.

    Args:
        values: (n,) of all modules.
        gradients: (n,).
        steps: `AdamSteps`.
        module: its place.
        step: which of the steps.
    """
    start, end = steps.starts[module], steps.starts[module + 1]
    clip_norm(gradients[start:end], steps.max_norm)
    adam_step(
        values[start:end], gradients[start:end], steps.mean[start:end], steps.square[start:end],
        steps.rates[step], steps.epsilons[step],
    )  # fmt: skip

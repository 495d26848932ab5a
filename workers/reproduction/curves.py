"""Learning curves of a row's seeds on one grid: their mean and its 95 % interval (NumPy only)."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from workers.statistics.seeds import means_band

Floats = NDArray[np.float64]

CURVE_BINS = 60
"""Of a training's steps, in which its curve is drawn and kept."""


def binned(steps: Sequence[int], values: Sequence[float], edges: Floats) -> Floats:
    """The mean of a curve between each two edges, (edges - 1,).

    Where it has no point it is linear in between; nan before its first point and after its last.
    """
    place = np.digitize(np.asarray(steps, np.float64), edges) - 1
    inside = (place >= 0) & (place < len(edges) - 1)
    counts = np.bincount(place[inside], minlength=len(edges) - 1)
    sums = np.bincount(place[inside], weights=np.asarray(values, np.float64)[inside], minlength=len(edges) - 1)
    there = np.flatnonzero(counts)
    if there.size == 0:
        return np.full(len(edges) - 1, np.nan)
    means = sums[there] / counts[there]
    return np.interp(np.arange(len(edges) - 1), there, means, left=np.nan, right=np.nan)


def band(curves: Floats) -> tuple[Floats, Floats, Floats]:
    """Mean over seeds with its 95 % interval at each point.

    Args:
        curves: (seeds, points); nan where a seed has no value.

    Returns:
        mean, low and high, (points,) each; nan where a seed has no value: a mean over fewer seeds would jump, up where the
        worst is missing, as a seed is whose robots end no attempt any more.
    """
    mean, low, high = means_band(curves)
    if len(curves) == 1:
        low = high = mean
    whole = np.isfinite(curves).all(axis=0)
    return np.where(whole, mean, np.nan), np.where(whole, low, np.nan), np.where(whole, high, np.nan)

"""How sure the importances of a study's settings are: percentile intervals of a bootstrap over its complete trials.

PED-ANOVA (Watanabe et al. 2023) as Optuna computes it, on counts instead of trials: a resample is some counts on a grid of
50 values, so that it costs as much whether there are twenty trials or five hundred. tests/server/test_study_rules.py holds
it equal to Optuna's.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from server.studies.space import ListedSetting, RangedSetting, Space, Value, Values

RESAMPLES = 200
"""Bootstrap samples: the ends of a 95 % interval are then five samples from either end."""
LEAST_FOR_INTERVALS = 20
"""Complete trials: the best tenth, which all of it goes by, is two of them."""
_SEED = 0
_CONFIDENCE = 0.95
_BEST = 0.1
_STEPS = 50
_PRIOR = 1.0
_NARROWEST = 0.5 / 1.64

Floats = NDArray[np.float64]
Counts = NDArray[np.int64]


@dataclass(frozen=True)
class _Grid:
    """A setting's values on its grid.

    Attributes:
        places: of each trial's value, from 0.
        size: of the grid.
        ordered: whether neighbours are alike: a range, not a list.
    """

    places: Counts
    size: int
    ordered: bool


def intervals(space: Space, trials: Sequence[Values], scores: Sequence[float]) -> dict[str, tuple[float, float]]:
    """Of each setting's importance the 95 % interval over trials; the same trials have the same.

    Empty below `LEAST_FOR_INTERVALS`, and where all trials did alike.

    Args:
        space: that is searched.
        trials: what the complete ones tried.
        scores: of each; higher is better.
    """
    if len(trials) < LEAST_FOR_INTERVALS or len(set(scores)) == 1:
        return {}
    grids, measured = _grids(space, trials), np.asarray(scores)
    drawn = np.random.default_rng(_SEED).integers(0, len(trials), (RESAMPLES, len(trials)))
    found = np.array([_shares(grids, measured, one) for one in drawn])
    tail = 50.0 * (1.0 - _CONFIDENCE)
    low, high = np.percentile(found, (tail, 100.0 - tail), axis=0)
    return {one.path: (float(low[at]), float(high[at])) for at, one in enumerate(space.settings)}


def shares(space: Space, trials: Sequence[Values], scores: Sequence[float]) -> dict[str, float]:
    """The importances themselves, of all trials; they sum to 1."""
    found = _shares(_grids(space, trials), np.asarray(scores), np.arange(len(trials)))
    return {one.path: float(found[at]) for at, one in enumerate(space.settings)}


def _grids(space: Space, trials: Sequence[Values]) -> list[_Grid]:
    return [_grid(space, setting, [trial[setting.path] for trial in trials]) for setting in space.settings]


def _grid(space: Space, setting: RangedSetting | ListedSetting, values: Sequence[Value]) -> _Grid:
    if isinstance(setting, ListedSetting):
        return _Grid(np.array([setting.values.index(value) for value in values]), len(setting.values), ordered=False)
    low, high, steps = setting.low, setting.high, _STEPS
    numbers = np.array(values, np.float64)
    if setting.mirrored:
        low, high, numbers = -high, -low, -numbers
    if space.is_whole(setting):
        width = high - low + 1
        steps = min(math.ceil(math.log2(width)) + 1 if setting.log else round(width), _STEPS)
    if setting.log:
        low, high, numbers = math.log(low), math.log(high), np.log(numbers)
    places = np.ceil((numbers - low) / ((high - low) / (steps - 1)) - 0.5).astype(np.int64)
    return _Grid(np.clip(places, 0, steps - 1), steps, ordered=True)


def _shares(grids: Sequence[_Grid], scores: Floats, drawn: Counts) -> Floats:
    """Importances by the trials that were drawn, of which one may be there several times."""
    some = scores[drawn]
    cut = math.ceil(_BEST * some.size)
    best = drawn[some >= np.partition(some, -cut)[-cut]]
    found = np.array([_divergence(grid, best, drawn) for grid in grids])
    total = found.sum()
    return found / total if total > 0.0 else np.full(len(grids), 1.0 / len(grids))


def _divergence(grid: _Grid, best: Counts, drawn: Counts) -> float:
    """Pearson's, between where the best lie and where all do."""
    top, local = (_density(grid, np.bincount(grid.places[some], minlength=grid.size)) for some in (best, drawn))
    return float(local @ ((top / local - 1.0) ** 2))


def _density(grid: _Grid, counts: Counts) -> Floats:
    """Parzen's estimate on the grid, with a kernel for each place and one for all that may be."""
    there = np.flatnonzero(counts)
    weights = np.append(counts[there], _PRIOR)
    kernels = _smooth_kernels(there, counts[there], grid.size) if grid.ordered else _choice_kernels(there, grid.size)
    density: Floats = (weights / weights.sum()) @ kernels + 1e-12
    return density


def _choice_kernels(there: Counts, size: int) -> Floats:
    kernels = np.full((there.size + 1, size), _PRIOR / (there.size + 1))
    kernels[np.arange(there.size), there] += 1.0
    normalised: Floats = kernels / kernels.sum(axis=1, keepdims=True)
    return normalised


def _smooth_kernels(there: Counts, counts: Counts, size: int) -> Floats:
    """Normal ones, cut at the ends, as wide as Scott's rule says (1992)."""
    from scipy.special import ndtr  # Half a second, which a server's start need not take.

    cumulated = np.cumsum(counts)
    total = int(cumulated[-1])
    mean = (there @ counts) / total
    spread = math.sqrt(((there - mean) ** 2 @ counts) / max(1, total - 1))
    first = np.searchsorted(cumulated, total // 4, side="left")
    third = min(there.size - 1, int(np.searchsorted(cumulated, total * 3 // 4, side="right")))
    middle_half = float(there[third] - there[first])
    width = max(1.059 * min(middle_half / 1.34, spread) * total**-0.2, _NARROWEST)
    centres = np.append(there, (size - 1) / 2.0)[:, None]
    widths = np.append(np.full(there.size, width), float(size))[:, None]
    # What lies between two edges is one place's; neighbours share theirs.
    edges = ndtr((np.arange(size + 1) - 0.5 - centres) / widths)
    kernels: Floats = np.diff(edges, axis=1) / (edges[:, -1:] - edges[:, :1])
    return kernels

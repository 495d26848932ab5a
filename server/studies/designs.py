"""Trials that depend on their number alone: the points of a grid in a drawn order, and points that fill the space evenly."""

from math import prod

import numpy as np

from server.studies.space import ListedSetting, RangedSetting, Space, Value, Values

MAX_GRID = 10_000
"""Points of a grid."""


def grid_values(space: Space, setting: RangedSetting | ListedSetting) -> list[Value]:
    """The values of a setting in a grid, in order; whole ones that fall together once."""
    if isinstance(setting, ListedSetting):
        return list(setting.values)
    shares = np.linspace(0.0, 1.0, setting.points)
    return list(dict.fromkeys(_between(space, setting, float(share), closed=True) for share in shares))


def grid_size(space: Space) -> int:
    """Points of the whole grid."""
    return prod(len(grid_values(space, setting)) for setting in space.settings)


def grid_point(space: Space, seed: int, number: int) -> Values:
    """The point of a trial.

    Args:
        space: of at most `MAX_GRID` points.
        seed: of the order: who stops early has seen all of the space a little.
        number: of the trial, from 0, below the grid's size.
    """
    place = int(np.random.default_rng(seed).permutation(grid_size(space))[number])
    point: Values = {}
    for setting in reversed(space.settings):
        values = grid_values(space, setting)
        place, index = divmod(place, len(values))
        point[setting.path] = values[index]
    return {setting.path: point[setting.path] for setting in space.settings}


def quasi_point(space: Space, seed: int, number: int) -> Values:
    """A trial's point of a scrambled Sobol sequence (Sobol 1967, Owen 1998).

    Args:
        space: that is searched.
        seed: of the scrambling.
        number: of the trial, from 0.
    """
    from scipy.stats.qmc import Sobol  # Half a second, which a server's start need not take.

    sequence = Sobol(len(space.settings), scramble=True, rng=seed)
    if number:
        sequence.fast_forward(number)
    (shares,) = sequence.random(1)
    return {
        setting.path: _share(space, setting, float(share)) for setting, share in zip(space.settings, shares, strict=True)
    }


def _share(space: Space, setting: RangedSetting | ListedSetting, share: float) -> Value:
    if isinstance(setting, ListedSetting):
        return setting.values[min(int(share * len(setting.values)), len(setting.values) - 1)]
    return _between(space, setting, share, closed=False)


def _between(space: Space, setting: RangedSetting, share: float, *, closed: bool) -> Value:
    """A share of the way, 0 to 1; of whole numbers each has an equal part unless the ends are `closed`."""
    low, high = setting.low, setting.high
    whole = space.is_whole(setting)
    if whole and not closed:
        low, high = low - 0.5 * (1 - 1e-9), high + 0.5 * (1 - 1e-9)
    # Of two negative ends the ratio is that of their amounts.
    value = low * (high / low) ** share if setting.log else low + share * (high - low)
    if whole:
        return int(np.clip(round(value), setting.low, setting.high))
    return float(np.clip(value, setting.low, setting.high))

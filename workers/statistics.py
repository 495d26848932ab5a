"""How sure a measured success rate is."""

import math

_Z_95 = 1.959963984540054
"""Two-sided 95 % quantile of the normal distribution."""


def wilson_interval(successes: float, trials: float) -> tuple[float, float]:
    """95 % interval of a success probability (Wilson 1927); honest at 0 % and 100 %, where the textbook's is a point.

    Neither number need be whole: episodes that depend on each other count as fewer.

    Returns:
        low and high, with low <= successes / trials <= high.

    Raises:
        ValueError: there were no trials, or more successes than trials.
    """
    if not 0 <= successes <= trials or trials <= 0:
        raise ValueError(f"{successes} successes of {trials} trials have no interval")
    share, z2 = successes / trials, _Z_95 * _Z_95
    centre = share + z2 / (2 * trials)
    spread = _Z_95 * math.sqrt(share * (1 - share) / trials + z2 / (4 * trials * trials))
    scale = 1 + z2 / trials
    # At 0 and 1 rounding could leave the share a hair outside its own interval.
    return max(0.0, min((centre - spread) / scale, share)), min(1.0, max((centre + spread) / scale, share))

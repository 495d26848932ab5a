"""Whole distributions side by side: how likely one improves on another, and how many attempts reach a score.

Agarwal, Schwarzer, Castro, Courville and Bellemare 2021, 'Deep Reinforcement Learning at the Edge of the Statistical
Precipice'. A suite's scenarios are their tasks and seeds are their runs. Their intervals are bootstraps; these are
Student's t over seeds, as everywhere here.
"""

from collections.abc import Sequence

import numpy as np

from workers.statistics.differences import welch_error
from workers.statistics.intervals import CONFIDENCE, Floats, Interval, exact_interval, student_t
from workers.statistics.seeds import Band, rates_band


def probability_of_improvement(first: Floats, second: Floats, confidence: float = CONFIDENCE) -> Interval:
    """How likely a seed of the first scores higher than one of the second in a scenario; equal scores count half.

    The error is that of both sides' seeds (DeLong, DeLong and Clarke-Pearson 1988), with Satterthwaite's degrees of freedom,
    on the scale of the logit.

    Args:
        first: (seeds, scenarios) scores, at least two seeds.
        second: (seeds, scenarios), of as many scenarios.
        confidence: of the interval.

    Raises:
        ValueError: fewer than two seeds on a side.
    """
    if min(len(first), len(second)) < 2:
        raise ValueError("an interval needs two seeds on either side")
    # (first's seeds, second's seeds): a pair of policies each.
    wins = np.array([((one > second).mean(axis=1) + (one == second).mean(axis=1) / 2) for one in first])
    value = float(wins.mean())
    variances = [np.asarray(wins.mean(axis=axis).var(ddof=1) / len(side)) for axis, side in ((1, first), (0, second))]
    freedom, error = welch_error(variances, (len(first), len(second)))
    if value in (0.0, 1.0):
        # No logit, and no spread to learn from: as many pairs as are independent, each an improvement or none.
        pairs = min(len(first), len(second))
        return Interval(value, *(float(end) for end in exact_interval(value * pairs, pairs, confidence)))
    reach = float(student_t(freedom, confidence) * error) / (value * (1.0 - value))
    logit = np.log(value / (1.0 - value))
    low, high = (float(1.0 / (1.0 + np.exp(np.minimum(end - logit, 700.0)))) for end in (reach, -reach))
    return Interval(value, min(low, value), max(high, value))


def performance_profile(scores: Sequence[Floats], thresholds: Floats) -> Band:
    """Share of attempts that score more than each threshold, its mean over seeds and the interval (`rates_band`).

    Args:
        scores: of each seed's attempts; at least one seed.
        thresholds: (points,).
    """
    shares = np.array([(seed[:, None] > thresholds).mean(axis=0) for seed in scores])
    return rates_band(shares, np.array([[float(seed.size)] for seed in scores]))

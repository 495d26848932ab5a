"""What a campaign says of the paper's claims: an interval over seeds, and one of three words."""

from collections.abc import Mapping, Sequence
from typing import Literal

import numpy as np

from sim.config import Frozen
from workers.reproduction.rows import CLAIMS, Claim, TableRow

LEAST_SEEDS = 5
"""Below this many seeds a bootstrap interval covers far less than it promises."""

# A difference of less than one point of success is none that anybody drives by.
MATTERS = 0.01

_RESAMPLES = 10_000

Word = Literal["holds", "does not hold", "can't be told"]


class Verdict(Frozen):
    """A claim, judged.

    Attributes:
        difference: of the mean success of both rows, in the direction of the claim.
        low, high: its 95 % interval.
    """

    claim: Claim
    word: Word
    reason: str
    difference: float | None = None
    low: float | None = None
    high: float | None = None


def bootstrap_difference(better: Sequence[float], worse: Sequence[float]) -> tuple[float, float]:
    """95 % percentile interval of the difference of two means, each resampled over its seeds."""
    rng = np.random.default_rng(0)
    means = [rng.choice(np.asarray(values), (_RESAMPLES, len(values))).mean(axis=1) for values in (better, worse)]
    low, high = np.quantile(means[0] - means[1], [0.025, 0.975])
    return float(low), float(high)


def judge(claim: Claim, results: Mapping[str, Sequence[TableRow]]) -> Verdict:
    """A claim against the results of a campaign, one for each seed, by row."""
    better, worse = ([row.success for row in results.get(name, ())] for name in (claim.better, claim.worse))
    if min(len(better), len(worse)) < LEAST_SEEDS:
        return Verdict(claim=claim, word="can't be told", reason=f"fewer than {LEAST_SEEDS} seeds of a row are done")
    difference = float(np.mean(better) - np.mean(worse))
    low, high = bootstrap_difference(better, worse)
    word: Word
    if low > 0.0:
        word, reason = "holds", "the whole interval of the difference is above zero"
    elif high < 0.0:
        word, reason = "does not hold", "the whole interval of the difference is below zero"
    elif max(-low, high) <= MATTERS:
        word, reason = "does not hold", "the two differ by less than one point"
    else:
        word, reason = "can't be told", "the interval of the difference holds zero"
    return Verdict(claim=claim, word=word, reason=reason, difference=difference, low=low, high=high)


def judge_all(results: Mapping[str, Sequence[TableRow]]) -> tuple[Verdict, ...]:
    """Every claim of the paper."""
    return tuple(judge(claim, results) for claim in CLAIMS)

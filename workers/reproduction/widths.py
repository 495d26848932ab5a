"""Which rows need more seeds: a rule that looks at how wide an interval is, and never at which side of zero it lies on."""

from collections.abc import Mapping

from workers.reproduction.claims import CLAIMS, AnyClaim, Comparison, Safety
from workers.reproduction.measures import SCALES
from workers.reproduction.results import Results, rate_spread
from workers.reproduction.verdict import SAFE, compared, the_other_way

MORE_SEEDS = 5
"""That a row gets at a time: intervals are looked at after each five, and not after each seed."""

MOST_SEEDS = 40
"""Of a row: what so many can't tell stays untold."""


def seeds_wanted(results: Results, trained: Mapping[str, int], at_most: int = MOST_SEEDS) -> dict[str, int]:
    """How many seeds the rows whose comparisons are too wide are to have; empty where none is, or none may have more.

    Args:
        results: by row.
        trained: seeds of each row so far, those that failed included.
        at_most: seeds of a row.
    """
    wide = too_wide(results)
    return {row: min(at_most, seeds + MORE_SEEDS) for row, seeds in trained.items() if row in wide and seeds < at_most}


def too_wide(results: Results) -> frozenset[str]:
    """Ids of the rows in whose comparisons half of a 95 % interval is wider than the margin, either way.

    Whether a claim is told already plays no part: to stop at the first interval that leaves zero out would find more effects
    than there are.

    Args:
        results: by row; a comparison with fewer than two seeds on a side is left out.
    """
    return frozenset(row for claim in CLAIMS for row in _wide_rows(claim, results))


def _wide_rows(claim: AnyClaim, results: Results) -> set[str]:
    match claim:
        case Comparison():
            ways = [claim, *filter(None, [the_other_way(claim)])]
            return {row for way in ways if _is_wide(way, results) for row in (way.better, way.worse)}
        case Safety():
            seeds = results.get(claim.row, ())
            if len(seeds) < 2:
                return set()
            rates = rate_spread([seed.measured.collisions or 0.0 for seed in seeds], [seed.attempts for seed in seeds])
            assert rates.low is not None
            assert rates.high is not None
            return {claim.row} if (rates.high - rates.low) / 2 > SAFE else set()
        case _:
            return set()


def _is_wide(claim: Comparison, results: Results) -> bool:
    difference = compared(claim, results)
    return difference is not None and (difference.high - difference.low) / 2 > SCALES[claim.measure].margin

"""How good a trial is, and when it is not worth going on with."""

from collections.abc import Mapping, Sequence
from statistics import median

from workers.statistics.seeds import interquartile_mean
from workers.wording import percent

SeedRungs = Mapping[str, Sequence[float | None]]
"""By seed, its success rate at every evaluation, the first at one interval's steps; None where there was none."""

MEDIAN_AFTER = 4
"""Complete trials before any is stopped early."""
LEAST_SEEDS = 2
"""Seeds of a trial that have to have got as far: one alone may have had bad luck."""
_TIME = 1e-4

RULE = (
    "A trial is stopped early once two or more of its seeds have got as far as a quarter of the steps or more, and their "
    "best success until there is below the median of what the same seeds of all complete trials had after as many steps; "
    f"none before {MEDIAN_AFTER} trials are complete."
)


def score(success: float, seconds: float | None, limit: float) -> float:
    """What the sampler is told: success first, then time to target.

    All of the time weighs less than an episode of 200 with one of three seeds does, so that it only tells apart what
    arrives as often.

    Args:
        success: rate, 0 to 1.
        seconds: to the target, of those that arrived; None where none did.
        limit: seconds after which an episode is cut.
    """
    return success - _TIME * (1.0 if seconds is None else min(1.0, seconds / limit))


def rungs_of(rates: SeedRungs) -> dict[int, float]:
    """Success over the seeds that have got as far, by number of evaluation, from 1."""
    found: dict[int, float] = {}
    for rung in range(1, max(map(len, rates.values()), default=0) + 1):
        here = [rate for rates_of_seed in rates.values() if (rate := _at(rates_of_seed, rung)) is not None]
        if here:
            found[rung] = interquartile_mean(here)
    return found


def hopeless(trial: SeedRungs, complete: Sequence[SeedRungs], first: int) -> str | None:
    """Why a trial is not worth going on with, by the median rule over the same seeds; None while it is.

    Args:
        trial: that goes on.
        complete: the trials that went all the way.
        first: the evaluation before which nobody is judged, from 1.
    """
    if len(complete) < MEDIAN_AFTER:
        return None
    for rung in range(max(map(len, trial.values()), default=0), first - 1, -1):
        seeds = [seed for seed, rates in trial.items() if _at(rates, rung) is not None]
        if len(seeds) < LEAST_SEEDS:
            continue
        others = [value for other in complete if (value := _together(other, seeds, rung)) is not None]
        if len(others) < MEDIAN_AFTER:
            continue
        best = max(value for at in range(1, rung + 1) if (value := _together(trial, seeds, at)) is not None)
        if best < median(others):
            return (
                f"After evaluation {rung} at best {percent(best)} of its episodes had arrived with seeds "
                f"{', '.join(seeds)}, and {percent(median(others))} with the same ones of the median trial."
            )
        return None
    return None


def _together(rates: SeedRungs, seeds: Sequence[str], rung: int) -> float | None:
    """Success over these seeds at an evaluation; None where one of them has none."""
    found = [_at(rates.get(seed, ()), rung) for seed in seeds]
    here = [rate for rate in found if rate is not None]
    return interquartile_mean(here) if len(here) == len(seeds) else None


def _at(rates: Sequence[float | None], rung: int) -> float | None:
    return rates[rung - 1] if rung <= len(rates) else None

"""What may be said of two experiments: better, worse, equivalent, or not told; below five seeds nothing at all."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from server.comparison.figures import FinalFigures
from server.comparison.schemas import ComparisonVerdict, ComparisonWord, Improvement, Measure, PairedTest
from workers.statistics.differences import (
    LEAST_SEEDS,
    Difference,
    Rates,
    Word,
    difference_of_means,
    difference_of_rates,
)
from workers.statistics.improvement import probability_of_improvement
from workers.statistics.significance import Paired, holm, p_of_means, p_of_rates, paired_rates, paired_values
from workers.statistics.wording import Scale, effect, equivalence, favourable, untold

Pair = tuple[FinalFigures, FinalFigures]
"""The base, and what is held against it."""

_STEPS_MARGIN = 0.05
"""Of the base's steps to the target: what is quicker by less than a twentieth is as quick."""

_LEVEL = 0.05

_WORDS: Mapping[Word, ComparisonWord] = {
    "higher": "better",
    "lower": "worse",
    "equivalent": "equivalent",
    "not told": "not told",
}


@dataclass(frozen=True)
class Judged:
    """Two experiments in one measure, before it is known how many were compared.

    Attributes:
        measure: which.
        pair: the base and the other.
        scale: of the measure.
        refusal: why there is no verdict; None where there is one.
        difference: other less base; None where refused.
        p: of the difference.
        paired: the other less the base in each scenario; None where they can't be paired.
    """

    measure: Measure
    pair: Pair
    scale: Scale
    refusal: str | None = None
    difference: Difference | None = None
    p: float | None = None
    paired: Paired | None = None


def verdicts(pairs: Sequence[Pair], margin: float) -> list[ComparisonVerdict]:
    """Every pair, in success and in steps to the target.

    Args:
        pairs: what is held against what.
        margin: success rates that differ by less are equivalent, 0 to 1.
    """
    judged = [each for pair in pairs for each in (_success(pair, margin), _steps(pair))]
    over_seeds = iter(holm([each.p for each in judged if each.p is not None]))
    over_scenarios = iter(holm([each.paired.p for each in judged if each.paired is not None]))
    told = sum(each.p is not None for each in judged)
    return [
        _verdict(
            each,
            None if each.p is None else next(over_seeds),
            None if each.paired is None else next(over_scenarios),
            told,
        )
        for each in judged
    ]


def improvements(pairs: Sequence[Pair]) -> list[Improvement]:
    """How likely each other improves on its base, of the pairs of which something may be said."""
    found = []
    for base, other in pairs:
        if _refusal((base, other), base.seeds, other.seeds) or not _same_scenarios(base, other):
            continue
        scores = [np.array([seed.score for seed in one.driven]) for one in (other, base)]
        told = probability_of_improvement(scores[0], scores[1])
        found.append(Improvement(base=base.id, other=other.id, value=told.value, low=told.low, high=told.high))
    return found


def _success(pair: Pair, margin: float) -> Judged:
    base, other = pair
    scale = Scale(unit="points", factor=100.0, decimals=1, margin=margin, more_is_better=True)
    refusal = _refusal(pair, base.seeds, other.seeds)
    if refusal:
        return Judged("success", pair, scale, refusal)
    rates = Rates(other.arrivals, other.episodes), Rates(base.arrivals, base.episodes)
    paired = None
    if _same_scenarios(base, other):
        arrived = [np.array([seed.arrived for seed in one.driven]) for one in (other, base)]
        paired = paired_rates(arrived[0], arrived[1])
    return Judged("success", pair, scale, None, difference_of_rates(*rates), p_of_rates(*rates), paired)


def _steps(pair: Pair) -> Judged:
    base, other = pair
    means = [[float(steps.mean()) for steps in one.steps if steps.size] for one in pair]
    margin = _STEPS_MARGIN * sum(means[0]) / len(means[0]) if means[0] else 0.0
    scale = Scale(unit="steps to the target", factor=1.0, decimals=1, margin=margin, more_is_better=False)
    refusal = _refusal(pair, len(means[0]), len(means[1]))
    if refusal:
        return Judged("steps_per_target", pair, scale, refusal)
    paired = None
    if _same_scenarios(base, other):
        steps = [np.array([seed.steps for seed in one.driven]) for one in (other, base)]
        paired = paired_values(steps[0], steps[1])
    difference = difference_of_means(means[1], means[0])
    return Judged("steps_per_target", pair, scale, None, difference, p_of_means(means[1], means[0]), paired)


def _refusal(pair: Pair, base_seeds: int, other_seeds: int) -> str | None:
    """Why there is no verdict, as a sentence; None where there is one."""
    base, other = pair
    for one, seeds in ((base, base_seeds), (other, other_seeds)):
        if seeds < LEAST_SEEDS:
            return f"No verdict below {LEAST_SEEDS} seeds: {one.name} has {seeds} to show."
    if base.suite_hash != other.suite_hash:
        return f"No verdict over different suites: {base.suite} is not {other.suite}, or another version of it."
    return None


def _same_scenarios(base: FinalFigures, other: FinalFigures) -> bool:
    """Whether every seed of both drove as many episodes, in the order of the one suite."""
    return base.suite_hash == other.suite_hash and len({*base.episodes, *other.episodes}) == 1


def _verdict(each: Judged, p_holm: float | None, paired_holm: float | None, told: int) -> ComparisonVerdict:
    base, other = each.pair
    word: ComparisonWord = "refused"
    reason = each.refusal or ""
    if each.difference is not None:
        found = favourable(each.scale, each.difference).word(each.scale.margin)
        word, reason = _WORDS[found], _reason(each, each.difference, found, p_holm, told)
    return ComparisonVerdict(
        measure=each.measure,
        base=base.id,
        other=other.id,
        word=word,
        difference=None if each.difference is None else each.difference.value,
        low=None if each.difference is None else each.difference.low,
        high=None if each.difference is None else each.difference.high,
        margin=each.scale.margin,
        p=each.p,
        p_holm=p_holm,
        paired=_paired(each, paired_holm),
        reason=reason,
    )


def _reason(each: Judged, difference: Difference, word: Word, p_holm: float | None, told: int) -> str:
    if word == "equivalent":
        return equivalence(each.scale, difference)
    if word == "not told":
        return untold(each.scale, difference, min(one.seeds for one in each.pair))
    direction = f"{effect(each.scale, difference)}."
    if p_holm is not None and p_holm >= _LEVEL:
        return f"{direction} Among {told} comparisons that may be chance (Holm: p = {p_holm:.2g})."
    return direction


def _paired(each: Judged, p_holm: float | None) -> PairedTest | None:
    if each.paired is None or p_holm is None:
        return None
    more, less = each.paired.more, each.paired.less
    better, worse = (more, less) if each.scale.more_is_better else (less, more)
    return PairedTest(
        test="randomisation" if each.measure == "success" else "signed rank",
        scenarios=each.paired.scenarios,
        better=better,
        worse=worse,
        p=each.paired.p,
        p_holm=p_holm,
    )

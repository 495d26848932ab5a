"""What may be said of two experiments: better, worse, equivalent, or not told; below five seeds nothing at all."""

from collections.abc import Mapping, Sequence

from server.comparison.figures import FinalFigures
from server.comparison.schemas import ComparisonVerdict, ComparisonWord, Measure
from workers.statistics.differences import (
    LEAST_SEEDS,
    Difference,
    Rates,
    Word,
    difference_of_means,
    difference_of_rates,
)
from workers.statistics.wording import Scale, effect, equivalence, favourable, untold

_STEPS_MARGIN = 0.05
"""Of the base's steps to the target: what is quicker by less than a twentieth is as quick."""

_WORDS: Mapping[Word, ComparisonWord] = {
    "higher": "better",
    "lower": "worse",
    "equivalent": "equivalent",
    "not told": "not told",
}


def verdicts(figures: Sequence[FinalFigures], margin: float) -> list[ComparisonVerdict]:
    """Every experiment against the first, in success and in steps to the target.

    Args:
        figures: in the order asked for.
        margin: success rates that differ by less are equivalent, 0 to 1.
    """
    base, *others = figures
    return [verdict for other in others for verdict in (_success(base, other, margin), _steps(base, other))]


def _success(base: FinalFigures, other: FinalFigures, margin: float) -> ComparisonVerdict:
    scale = Scale(unit="points", factor=100.0, decimals=1, margin=margin, more_is_better=True)
    refusal = _refusal(base, other, base.seeds, other.seeds)
    if refusal:
        return _refused("success", base, other, scale, refusal)
    difference = difference_of_rates(Rates(other.arrivals, other.episodes), Rates(base.arrivals, base.episodes))
    return _judged("success", base, other, scale, difference)


def _steps(base: FinalFigures, other: FinalFigures) -> ComparisonVerdict:
    means = [[float(steps.mean()) for steps in one.steps if steps.size] for one in (base, other)]
    margin = _STEPS_MARGIN * sum(means[0]) / len(means[0]) if means[0] else 0.0
    scale = Scale(unit="steps to the target", factor=1.0, decimals=1, margin=margin, more_is_better=False)
    refusal = _refusal(base, other, len(means[0]), len(means[1]))
    if refusal:
        return _refused("steps_per_target", base, other, scale, refusal)
    return _judged("steps_per_target", base, other, scale, difference_of_means(means[1], means[0]))


def _refusal(base: FinalFigures, other: FinalFigures, base_seeds: int, other_seeds: int) -> str | None:
    """Why there is no verdict, as a sentence; None where there is one."""
    for one, seeds in ((base, base_seeds), (other, other_seeds)):
        if seeds < LEAST_SEEDS:
            return f"No verdict below {LEAST_SEEDS} seeds: {one.name} has {seeds} to show."
    if base.suite_hash != other.suite_hash:
        return f"No verdict over different suites: {base.suite} is not {other.suite}, or another version of it."
    return None


def _judged(
    measure: Measure, base: FinalFigures, other: FinalFigures, scale: Scale, difference: Difference
) -> ComparisonVerdict:
    word = favourable(scale, difference).word(scale.margin)
    match word:
        case "equivalent":
            reason = equivalence(scale, difference)
        case "not told":
            reason = untold(scale, difference, min(base.seeds, other.seeds))
        case _:
            reason = f"{effect(scale, difference)}."
    return ComparisonVerdict(
        measure=measure,
        base=base.id,
        other=other.id,
        word=_WORDS[word],
        difference=difference.value,
        low=difference.low,
        high=difference.high,
        margin=scale.margin,
        reason=reason,
    )


def _refused(measure: Measure, base: FinalFigures, other: FinalFigures, scale: Scale, reason: str) -> ComparisonVerdict:
    return ComparisonVerdict(
        measure=measure,
        base=base.id,
        other=other.id,
        word="refused",
        difference=None,
        low=None,
        high=None,
        margin=scale.margin,
        reason=reason,
    )

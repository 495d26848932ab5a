"""What a campaign says of the paper's claims: one of three words, the figures behind it, and the paper's own evidence."""

from collections.abc import Sequence
from typing import Literal, NamedTuple

from sim.config import Frozen
from workers.reproduction.claims import CLAIMS, AnyClaim, Comparison, Safety, Untested
from workers.reproduction.compatibility import Compatibility, compatibility
from workers.reproduction.measures import SCALES, values_of
from workers.reproduction.results import LEARNED, Results, SeedResult, rate_spread
from workers.reproduction.rows import ROW_BY_ID
from workers.statistics.differences import (
    LEAST_SEEDS,
    Difference,
    Rates,
    difference_of_means,
    difference_of_rates,
    fisher_exact,
)
from workers.statistics.wording import Scale, effect, equivalence, favourable, untold

SAFE = 0.01
"""A row of fewer collisions than this per attempt drives without them, for what a drive can tell."""

Word = Literal["holds", "does not hold", "can't be told"]


class Verdict(Frozen):
    """A claim, judged.

    Attributes:
        id, statement, source: of the claim.
        word: holds, does not hold, or can't be told.
        reason: why, with figures, as a sentence.
        compatibility: whether the paper's effect can be ours; None where either has no number.
        evidence: what the paper's own figures can carry, as a sentence; None where it gives none.
        reading: what of our reading may explain a difference; None where nothing is known.
        rows: that were looked at.
    """

    id: str
    statement: str
    source: str
    word: Word
    reason: str
    compatibility: Compatibility | None
    evidence: str | None
    reading: str | None
    rows: tuple[str, ...]


class _Ruling(NamedTuple):
    """What of a verdict is worked out."""

    word: Word
    reason: str
    compatibility: Compatibility | None = None


def judge(claim: AnyClaim, results: Results) -> Verdict:
    """A claim against what a campaign has measured so far."""
    match claim:
        case Comparison():
            return _verdict(claim, _compare(claim, results), _evidence(claim), (claim.better, claim.worse))
        case Safety():
            return _verdict(claim, _safety(results.get(claim.row, ())), "The paper gives no collision rate.", (claim.row,))
        case Untested():
            reason = f"{claim.reason[0].upper()}{claim.reason[1:]}."
            return _verdict(claim, _Ruling("can't be told", reason), None, ())


def judge_all(results: Results) -> tuple[Verdict, ...]:
    """Every claim of the paper."""
    return tuple(judge(claim, results) for claim in CLAIMS)


def _verdict(claim: AnyClaim, ruling: _Ruling, evidence: str | None, rows: tuple[str, ...]) -> Verdict:
    return Verdict(
        id=claim.id,
        statement=claim.statement,
        source=claim.source,
        word=ruling.word,
        reason=ruling.reason,
        compatibility=ruling.compatibility,
        evidence=evidence,
        reading=claim.reading,
        rows=rows,
    )


def _compare(claim: Comparison, results: Results) -> _Ruling:
    better, worse = results.get(claim.better, ()), results.get(claim.worse, ())
    if min(len(better), len(worse)) < LEAST_SEEDS:
        return _Ruling("can't be told", _too_few(min(len(better), len(worse))))
    horizon = min(seed.steps for seed in (*better, *worse))
    firsts, seconds = (values_of(claim.measure, seeds, horizon) for seeds in (better, worse))
    if claim.measure == "learned_at" and {*firsts, *seconds} == {float(horizon)}:
        return _Ruling("can't be told", f"No seed of either reached {LEARNED:.0%} on the frozen suite.")
    scale = SCALES[claim.measure]
    if claim.measure == "success":
        difference = difference_of_rates(_rates(better), _rates(worse))
    else:
        difference = difference_of_means(firsts, seconds)
    word, reason = _word(scale, difference, min(len(better), len(worse)))
    papers = ROW_BY_ID[claim.better].paper, ROW_BY_ID[claim.worse].paper
    return _Ruling(word, reason, compatibility(claim.measure, difference, (better, worse), papers))


def _word(scale: Scale, difference: Difference, seeds: int) -> tuple[Word, str]:
    match favourable(scale, difference).word(scale.margin):
        case "equivalent":
            return "does not hold", equivalence(scale, difference)
        case "higher":
            return "holds", f"{effect(scale, difference)}, all of it in favour of the claim."
        case "lower":
            return "does not hold", f"{effect(scale, difference)}, all of it against the claim."
        case "not told":
            return "can't be told", untold(scale, difference, seeds)


def _safety(seeds: Sequence[SeedResult]) -> _Ruling:
    if len(seeds) < LEAST_SEEDS:
        return _Ruling("can't be told", _too_few(len(seeds)))
    rates = rate_spread([seed.measured.collisions or 0.0 for seed in seeds], [seed.attempts for seed in seeds])
    assert rates.low is not None
    assert rates.high is not None
    figures = (
        f"{100 * rates.mean:.1f} % of its attempts end in a collision, "
        f"95 % interval [{100 * rates.low:.1f}, {100 * rates.high:.1f}]"
    )
    if rates.high <= SAFE:
        return _Ruling("holds", f"{figures}: at most one in a hundred.")
    if rates.low > SAFE:
        return _Ruling("does not hold", f"{figures}: more than one in a hundred.")
    return _Ruling("can't be told", f"{figures}: on both sides of one in a hundred.")


def _too_few(seeds: int) -> str:
    return f"No verdict below {LEAST_SEEDS} seeds: {seeds} of {LEAST_SEEDS} done."


def _rates(seeds: Sequence[SeedResult]) -> Rates:
    attempts = [seed.attempts for seed in seeds]
    return Rates([seed.measured.success * n for seed, n in zip(seeds, attempts, strict=True)], attempts)


def _evidence(claim: Comparison) -> str:
    better, worse = ROW_BY_ID[claim.better].paper, ROW_BY_ID[claim.worse].paper
    match claim.measure:
        case "success":
            counts = [(round(row.success * row.episodes), round(row.episodes)) for row in (better, worse)]
            p = fisher_exact(*counts)
            (a, n), (b, m) = counts
            told = f"The paper: {a} of {n} against {b} of {m} with one seed each, p {_p(p)} (Fisher's exact test)"
            return f"{told}." if p < 0.05 else f"{told}, which does not show it."
        case "reward":
            return (
                f"The paper: {better.reward} against {worse.reward} with one seed each and no spread, which cannot show it."
            )
        case "steps":
            return f"The paper: {better.steps} against {worse.steps} with one seed each and no spread, which cannot show it."
        case "learned_at":
            return "The paper: one curve of each, without a number, which cannot show it."


def _p(value: float) -> str:
    return "< 0.001" if value < 0.001 else f"= {value:.2g}"

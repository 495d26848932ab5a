"""What a campaign says of the paper's claims: one of three words, the figures behind it, and the paper's own evidence."""

from collections.abc import Sequence
from typing import Literal

from sim.config import Frozen
from workers.reproduction.claims import CLAIMS, AnyClaim, Comparison, Safety, Untested
from workers.reproduction.compatibility import Compatibility, compatibility
from workers.reproduction.measures import SCALES, values_of
from workers.reproduction.results import LEARNED, Results, SeedResult, rate_spread
from workers.reproduction.rows import OTHER_WAY, ROW_BY_ID
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


class Ruling(Frozen):
    """What is worked out of a claim.

    Attributes:
        word: holds, does not hold, or can't be told.
        reason: why, with figures, as a sentence.
        compatibility: whether the paper's effect can be ours; None where either has no number.
        rows: that were looked at.
    """

    word: Word
    reason: str
    compatibility: Compatibility | None = None
    rows: tuple[str, ...] = ()


class Verdict(Ruling):
    """A claim, judged.

    Attributes:
        id, statement, source: of the claim.
        evidence: what the paper's own figures can carry, as a sentence; None where it gives none.
        reading: what of our reading may explain a difference; None where nothing is known.
        other_way: the same claim with DDPG's logit penalty; None where no DDPG is compared.
    """

    id: str
    statement: str
    source: str
    evidence: str | None
    reading: str | None
    other_way: Ruling | None


def judge(claim: AnyClaim, results: Results) -> Verdict:
    """A claim against what a campaign has measured so far."""
    match claim:
        case Comparison():
            other = the_other_way(claim)
            return _verdict(claim, _compare(claim, results), _evidence(claim), _compare(other, results) if other else None)
        case Safety():
            return _verdict(claim, _safety(claim.row, results.get(claim.row, ())), "The paper gives no collision rate.")
        case Untested():
            reason = f"{claim.reason[0].upper()}{claim.reason[1:]}."
            return _verdict(claim, Ruling(word="can't be told", reason=reason), None)


def judge_all(results: Results) -> tuple[Verdict, ...]:
    """Every claim of the paper."""
    return tuple(judge(claim, results) for claim in CLAIMS)


def the_other_way(claim: Comparison) -> Comparison | None:
    """The claim with DDPG's logit penalty; None where no DDPG is compared."""
    better, worse = OTHER_WAY.get(claim.better, claim.better), OTHER_WAY.get(claim.worse, claim.worse)
    if (better, worse) == (claim.better, claim.worse):
        return None
    return claim.model_copy(update={"better": better, "worse": worse})


def compared(claim: Comparison, results: Results) -> Difference | None:
    """Better less worse over their seeds; None below two seeds of each, or where no seed of either learned in time."""
    better, worse = results.get(claim.better, ()), results.get(claim.worse, ())
    if min(len(better), len(worse)) < 2:
        return None
    if claim.measure == "success":
        return difference_of_rates(_rates(better), _rates(worse))
    horizon = min(seed.steps for seed in (*better, *worse))
    firsts, seconds = (values_of(claim.measure, seeds, horizon) for seeds in (better, worse))
    if claim.measure == "learned_at" and {*firsts, *seconds} == {float(horizon)}:
        return None
    return difference_of_means(firsts, seconds)


def _verdict(claim: AnyClaim, ruling: Ruling, evidence: str | None, other_way: Ruling | None = None) -> Verdict:
    return Verdict(
        id=claim.id,
        statement=claim.statement,
        source=claim.source,
        word=ruling.word,
        reason=ruling.reason,
        compatibility=ruling.compatibility,
        rows=ruling.rows,
        evidence=evidence,
        reading=claim.reading,
        other_way=other_way,
    )


def _compare(claim: Comparison, results: Results) -> Ruling:
    rows = claim.better, claim.worse
    better, worse = (results.get(row, ()) for row in rows)
    seeds = min(len(better), len(worse))
    if seeds < LEAST_SEEDS:
        return Ruling(word="can't be told", reason=_too_few(seeds), rows=rows)
    difference = compared(claim, results)
    if difference is None:
        return Ruling(
            word="can't be told", reason=f"No seed of either reached {LEARNED:.0%} on the frozen suite.", rows=rows
        )
    word, reason = _word(SCALES[claim.measure], difference, seeds)
    papers = ROW_BY_ID[claim.better].paper, ROW_BY_ID[claim.worse].paper
    found = compatibility(claim.measure, difference, (better, worse), papers)
    return Ruling(word=word, reason=reason, compatibility=found, rows=rows)


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


def _safety(row: str, seeds: Sequence[SeedResult]) -> Ruling:
    if len(seeds) < LEAST_SEEDS:
        return Ruling(word="can't be told", reason=_too_few(len(seeds)), rows=(row,))
    rates = rate_spread([seed.measured.collisions or 0.0 for seed in seeds], [seed.attempts for seed in seeds])
    assert rates.low is not None
    assert rates.high is not None
    figures = (
        f"{100 * rates.mean:.1f} % of its attempts end in a collision, "
        f"95 % interval [{100 * rates.low:.1f}, {100 * rates.high:.1f}]"
    )
    if rates.high <= SAFE:
        return Ruling(word="holds", reason=f"{figures}: at most one in a hundred.", rows=(row,))
    if rates.low > SAFE:
        return Ruling(word="does not hold", reason=f"{figures}: more than one in a hundred.", rows=(row,))
    return Ruling(word="can't be told", reason=f"{figures}: on both sides of one in a hundred.", rows=(row,))


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

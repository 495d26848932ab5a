"""What a campaign says of the paper's claims: one of three words, the figures behind it, and the paper's own evidence."""

from collections.abc import Callable, Sequence
from typing import Literal

from sim.config import Frozen
from workers.reproduction.claims import CLAIMS, AnyClaim, Comparison, Measure, Safety, Untested
from workers.reproduction.results import LEARNED, Results, SeedResult, spread
from workers.reproduction.rows import EVALUATE_EVERY, ROW_BY_ID
from workers.statistics import difference_interval, fisher_exact

LEAST_SEEDS = 5
"""No method beats another with fewer seeds than this."""

SAFE = 0.01
"""A row of fewer collisions than this per attempt drives without them, for what a drive can tell."""

Word = Literal["holds", "does not hold", "can't be told"]


class Verdict(Frozen):
    """A claim, judged.

    Attributes:
        id, statement, source: of the claim.
        word: holds, does not hold, or can't be told.
        reason: why, with figures, as a sentence.
        evidence: what the paper's own figures can carry, as a sentence; None where it gives none.
        reading: what of our reading may explain a difference; None where nothing is known.
        rows: that were looked at.
    """

    id: str
    statement: str
    source: str
    word: Word
    reason: str
    evidence: str | None
    reading: str | None
    rows: tuple[str, ...]


class _Scale(Frozen):
    """How a measure is compared and written."""

    unit: str
    factor: float
    decimals: int
    # Smaller differences than this are none that anybody drives by.
    matters: float
    more_is_better: bool


_SCALES: dict[Measure, _Scale] = {
    "success": _Scale(unit="points", factor=100.0, decimals=1, matters=0.01, more_is_better=True),
    "reward": _Scale(unit="reward per step", factor=1.0, decimals=2, matters=0.1, more_is_better=True),
    "steps": _Scale(unit="steps per episode", factor=1.0, decimals=1, matters=1.0, more_is_better=False),
    "learned_at": _Scale(unit="training steps", factor=1.0, decimals=0, matters=float(EVALUATE_EVERY), more_is_better=False),
}


def judge(claim: AnyClaim, results: Results) -> Verdict:
    """A claim against what a campaign has measured so far."""
    match claim:
        case Comparison():
            word, reason = _compare(claim, results)
            return _verdict(claim, word, reason, _evidence(claim), (claim.better, claim.worse))
        case Safety():
            word, reason = _safety(results.get(claim.row, ()))
            return _verdict(claim, word, reason, "The paper gives no collision rate.", (claim.row,))
        case Untested():
            reason = f"{claim.reason[0].upper()}{claim.reason[1:]}."
            return _verdict(claim, "can't be told", reason, None, ())


def judge_all(results: Results) -> tuple[Verdict, ...]:
    """Every claim of the paper."""
    return tuple(judge(claim, results) for claim in CLAIMS)


def _verdict(claim: AnyClaim, word: Word, reason: str, evidence: str | None, rows: tuple[str, ...]) -> Verdict:
    return Verdict(
        id=claim.id,
        statement=claim.statement,
        source=claim.source,
        word=word,
        reason=reason,
        evidence=evidence,
        reading=claim.reading,
        rows=rows,
    )


def _compare(claim: Comparison, results: Results) -> tuple[Word, str]:
    better, worse = results.get(claim.better, ()), results.get(claim.worse, ())
    if min(len(better), len(worse)) < LEAST_SEEDS:
        return "can't be told", _too_few(min(len(better), len(worse)))
    horizon = min(seed.steps for seed in (*better, *worse))
    values = _values(claim.measure, horizon)
    firsts, seconds = values(better), values(worse)
    if claim.measure == "learned_at" and {*firsts, *seconds} == {float(horizon)}:
        return "can't be told", f"No seed of either reached {LEARNED:.0%} on the frozen suite."
    scale = _SCALES[claim.measure]
    difference, low, high = difference_interval(firsts, seconds)
    if not scale.more_is_better:
        # From here on a positive number speaks for the claim.
        difference, low, high = -difference, -high, -low
    figures = _figures(scale, difference, low, high)
    if max(-low, high) <= scale.matters:
        return "does not hold", f"The two differ by less than {_number(scale, scale.matters)} {scale.unit}: {figures}."
    if low > 0.0:
        return "holds", f"{figures}, all of it in favour of the claim."
    if high < 0.0:
        return "does not hold", f"{figures}, all of it against the claim."
    return "can't be told", f"{figures}, on both sides of zero."


def _safety(seeds: Sequence[SeedResult]) -> tuple[Word, str]:
    if len(seeds) < LEAST_SEEDS:
        return "can't be told", _too_few(len(seeds))
    rates = spread([seed.measured.collisions or 0.0 for seed in seeds], most=1.0)
    assert rates.low is not None
    assert rates.high is not None
    figures = (
        f"{100 * rates.mean:.1f} % of its attempts end in a collision, "
        f"95 % interval [{100 * rates.low:.1f}, {100 * rates.high:.1f}]"
    )
    if rates.high <= SAFE:
        return "holds", f"{figures}: at most one in a hundred."
    if rates.low > SAFE:
        return "does not hold", f"{figures}: more than one in a hundred."
    return "can't be told", f"{figures}: on both sides of one in a hundred."


def _too_few(seeds: int) -> str:
    done = "No seed" if seeds == 0 else "1 seed" if seeds == 1 else f"{seeds} seeds"
    return f"{done} of {LEAST_SEEDS} done."


def _values(measure: Measure, horizon: int) -> Callable[[Sequence[SeedResult]], list[float]]:
    """The measure of each seed; who had not learned by the horizon counts as having learned there, which favours it."""

    def value(seed: SeedResult) -> float:
        match measure:
            case "success":
                return seed.measured.success
            case "reward":
                return seed.measured.reward or 0.0
            case "steps":
                return seed.measured.steps
            case "learned_at":
                return float(min(horizon, horizon if seed.learned_at is None else seed.learned_at))

    return lambda seeds: [value(seed) for seed in seeds]


def _figures(scale: _Scale, difference: float, low: float, high: float) -> str:
    way = ("more", "less") if scale.more_is_better else ("fewer", "more")
    word = way[0] if difference >= 0.0 else way[1]
    return (
        f"{_number(scale, abs(difference))} {scale.unit} {word}, 95 % interval "
        f"[{_number(scale, low, signed=True)}, {_number(scale, high, signed=True)}]"
    )


def _number(scale: _Scale, value: float, *, signed: bool = False) -> str:
    # "-0.0" would be a sign without a meaning.
    rounded = round(value * scale.factor, scale.decimals) + 0.0
    return f"{rounded:{'+' if signed else ''},.{scale.decimals}f}"


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

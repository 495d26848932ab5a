"""The tables of a comparison, before they are LaTeX, Markdown, HTML or CSV."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from server.comparison.schemas import Comparison, ComparisonVerdict
from server.printing.names import setting_words
from server.printing.values import NOTHING, setting_text
from server.schemas import Estimate

TableName = Literal["figures", "verdicts", "improvements", "differences"]

MEASURES = {"success": "Success", "steps_per_target": "Steps to target"}
# A p that is less is written so.
_SMALL_P = 0.001
_DIGITS = 3


@dataclass(frozen=True)
class PrintedTable:
    """A table in plain text.

    Attributes:
        name: of the table.
        title: what a heading says.
        caption: how its numbers were made.
        heading: of each column.
        rows: a cell for each column.
        texts: the columns of words, by place; all others are of numbers.
    """

    name: str
    title: str
    caption: str
    heading: tuple[str, ...]
    rows: list[tuple[str, ...]]
    texts: frozenset[int] = frozenset({0})


def printed(comparison: Comparison, name: TableName) -> PrintedTable:
    """One of the tables of a comparison."""
    makers: dict[TableName, Callable[[Comparison], PrintedTable]] = {
        "figures": _figures,
        "verdicts": _verdicts,
        "improvements": _improvements,
        "differences": _differences,
    }
    return makers[name](comparison)


def _figures(comparison: Comparison) -> PrintedTable:
    suites = sorted({f"{one.suite} ({(one.suite_hash or '')[:8]})" for one in comparison.experiments if one.suite})
    return PrintedTable(
        name="figures",
        title="Final figures",
        caption=f"Mean over seeds with 95 % intervals (Student's t over seeds, of success on the scale of the logit; of one "
        f"seed over its episodes). Last checkpoint of each seed on {', '.join(suites) or 'no suite yet'}.",
        heading=(
            "Training",
            "Seeds",
            "N (episodes)",
            "Success (%)",
            "Steps to target",
            "Reward per episode",
            "Seeds failed",
        ),
        rows=[
            (
                one.name,
                str(one.seeds),
                str(one.episodes),
                percentage(one.success),
                number(one.steps_per_target),
                number(one.reward),
                _failed(one.success),
            )
            for one in comparison.experiments
        ],
        texts=frozenset({0, 6}),
    )


def _verdicts(comparison: Comparison) -> PrintedTable:
    names = {one.id: one for one in comparison.experiments}
    margins = {verdict.margin for verdict in comparison.verdicts if verdict.measure == "success"}
    within = f"{100 * min(margins):.3g} points of success" if margins else "the margin"
    return PrintedTable(
        name="verdicts",
        title="Verdicts",
        caption="Differences of means over seeds with 95 % intervals (Welch; of success with each rate's own interval), in "
        "points of success and in steps. Better or worse where the interval leaves out zero, equivalent where the 90 % "
        f"interval lies within {within} or 5 % of the steps, refused below five seeds. p adjusted for "
        f"{comparison.comparisons} comparisons (Holm). Paired: scenarios better and worse, exact randomisation test of "
        "success or signed ranks of steps.",
        heading=("Training", "Beside", "Measure", "Seeds", "Difference", "p (Holm)", "Verdict", "Paired", "Paired p (Holm)"),
        rows=[
            (
                names[verdict.other].name,
                names[verdict.base].name,
                MEASURES[verdict.measure],
                f"{names[verdict.other].seeds}, {names[verdict.base].seeds}",
                _difference(verdict),
                _p(verdict.p_holm),
                verdict.word,
                NOTHING
                if verdict.paired is None
                else f"{verdict.paired.better} : {verdict.paired.worse} of {verdict.paired.scenarios}",
                _p(None if verdict.paired is None else verdict.paired.p_holm),
            )
            for verdict in comparison.verdicts
        ],
        texts=frozenset({0, 1, 2, 6}),
    )


def _improvements(comparison: Comparison) -> PrintedTable:
    names = {one.id: one for one in comparison.experiments}
    return PrintedTable(
        name="improvements",
        title="Probability of improvement",
        caption="How likely a seed of the training scores higher than a seed of the one beside it in a scenario (Agarwal et "
        "al. 2021), equal scores counting half, with 95 % intervals over seeds. The score is path efficiency of an arrival, "
        "else 0.",
        heading=("Training", "Beside", "Seeds", "Probability (%)"),
        rows=[
            (
                names[one.other].name,
                names[one.base].name,
                f"{names[one.other].seeds}, {names[one.base].seeds}",
                _interval(100 * one.value, 100 * one.low, 100 * one.high, "{:.1f}"),
            )
            for one in comparison.improvements
        ],
        texts=frozenset({0, 1}),
    )


def _differences(comparison: Comparison) -> PrintedTable:
    return PrintedTable(
        name="differences",
        title="What differs in their settings",
        caption="Settings that are not the same in all trainings.",
        heading=("Setting", *(one.name for one in comparison.experiments)),
        rows=[
            (
                setting_words(row.path),
                *("left out" if out else setting_text(value) for value, out in zip(row.values, row.left_out, strict=True)),
            )
            for row in comparison.differences
        ],
        texts=frozenset(range(1 + len(comparison.experiments))),
    )


def percentage(estimate: Estimate | None) -> str:
    """A share as 96.3 [92.2, 98.2], in per cent."""
    if estimate is None:
        return NOTHING
    return _interval(100 * estimate.value, 100 * estimate.low, 100 * estimate.high, "{:.1f}")


def number(estimate: Estimate | None, digits: int = 1) -> str:
    """A mean as 61.4 [58.9, 63.8], with so many digits behind the point."""
    return (
        NOTHING if estimate is None else _interval(estimate.value, estimate.low, estimate.high, f"{{:.{digits}f}}", digits)
    )


def _failed(estimate: Estimate | None) -> str:
    if estimate is None or estimate.failed is None:
        return NOTHING
    failed = estimate.failed
    if not failed.told:
        return f"not told of {failed.seeds}"
    return f"{failed.failed} of {failed.seeds}, up to {100 * failed.at_most:.0f} % may"


def _difference(verdict: ComparisonVerdict) -> str:
    if verdict.difference is None or verdict.low is None or verdict.high is None:
        return NOTHING
    factor = 100.0 if verdict.measure == "success" else 1.0
    return _interval(verdict.difference * factor, verdict.low * factor, verdict.high * factor, "{:+.1f}")


def _interval(value: float, low: float, high: float, form: str, digits: int = 1) -> str:
    """As 96.3 [92.2, 98.2]."""
    # "-0.0" would be a sign without a meaning.
    shown, start, end = (form.format(round(each, digits) + 0.0) for each in (value, low, high))
    return f"{shown} [{start}, {end}]"


def _p(p: float | None) -> str:
    if p is None:
        return NOTHING
    return f"< {_SMALL_P}" if p < _SMALL_P else f"{p:.2g}"

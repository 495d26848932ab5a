"""A campaign's result as a page of Markdown: the paper and ours side by side, and a sentence for each claim."""

from collections.abc import Mapping, Sequence
from itertools import groupby
from statistics import fmean

from workers.reproduction.rows import ROWS, Row, TableRow
from workers.reproduction.verdict import Verdict, judge_all

_HEAD = "| method | | reward per step | episodes | success % | steps per episode |\n|---|---|---|---|---|---|"


def report(results: Mapping[str, Sequence[TableRow]], command: str, date: str) -> str:
    """The page.

    Args:
        results: one for each seed, by row.
        command: that made them.
        date: when, as ISO 8601.
    """
    lines = [
        "# The paper, reproduced",
        "",
        f"Made by `{command}` on {date}. Ours: the mean over seeds, and in brackets the least and the greatest seed.",
        "Each seed is measured by ten deterministic drives of 10,000 steps, target after target, as in the paper's tables.",
    ]
    for table, rows in groupby(ROWS, key=lambda row: row.table):
        lines += ["", f"## {table}", "", _HEAD]
        for row in rows:
            lines += [_paper(row), _ours(row, results.get(row.id, ()))]
    lines += ["", "## The claims", "", *(_sentence(verdict) for verdict in judge_all(results)), ""]
    return "\n".join(lines)


def _paper(row: Row) -> str:
    figures = row.paper
    reward = "not given" if figures.reward is None else f"{figures.reward:.2f}"
    return (
        f"| {row.method} | paper | {reward} | {figures.episodes:.0f} | {100 * figures.success:.2f} | {figures.steps:.2f} |"
    )


def _ours(row: Row, seeds: Sequence[TableRow]) -> str:
    if not seeds:
        return "| | ours | not run | | | |"
    cells = (
        _spread([seed.reward or 0.0 for seed in seeds], 2),
        _spread([seed.episodes for seed in seeds], 0),
        _spread([100 * seed.success for seed in seeds], 2),
        _spread([seed.steps for seed in seeds], 1),
    )
    return f"| | ours, {len(seeds)} seeds | {' | '.join(cells)} |"


def _spread(values: Sequence[float], decimals: int) -> str:
    return f"{fmean(values):.{decimals}f} [{min(values):.{decimals}f}, {max(values):.{decimals}f}]"


def _sentence(verdict: Verdict) -> str:
    figures = ""
    if verdict.difference is not None and verdict.low is not None and verdict.high is not None:
        figures = (
            f" Difference {100 * verdict.difference:+.1f} points, 95 % interval "
            f"[{100 * verdict.low:+.1f}, {100 * verdict.high:+.1f}]."
        )
    return f"- {verdict.claim.statement} **{verdict.word.capitalize()}**: {verdict.reason}.{figures}"

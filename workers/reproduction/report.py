"""A campaign's result as a page of Markdown: the paper and ours side by side, curves, and a sentence for each claim."""

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from workers.reproduction.drawing import draw_curves
from workers.reproduction.outcome import Outcome
from workers.reproduction.results import LEARNED, SeedResult, Spread, row_spread
from workers.reproduction.rows import LOGIT_PENALTY, OTHER_WAY, ROW_BY_ID, ROWS, STEPS, TABLES, Row, Table
from workers.reproduction.verdict import Ruling, Verdict, Word, judge_all
from workers.statistics.differences import LEAST_SEEDS

_HEAD = (
    "| method | | avg. reward | episodes | success % | steps per episode | collisions % | success % of each seed |\n"
    "|---|---|---|---|---|---|---|---|"
)
_PICTURE = Path("images") / "reproduction.svg"

_MEASURED = f"""\
Ours: the mean over seeds and its 95 % interval ([how](statistics.md)). Every training has {STEPS:,} environment
steps. A seed is its last policy, driven deterministically: ten robots, 10,000 steps each, target after target, as in
the paper's tables; an episode is one target attempt, and a figure is that of one drive. The paper gives none of DDPG's
settings: it is trained as it was published, and the other way with a penalty of {LOGIT_PENALTY:g} on its squared logits
([why](recipes.md#why-ddpg-failed))."""

_CURVES = f"""\
![Reward of a target attempt over training steps, in the paper's arrangement]({_PICTURE.as_posix()})

Reward summed over a target attempt while training, exploration included, by environment steps. Thin: seeds. Bold:
their mean. Band: its 95 % interval. The paper's own curves have no numbers that could be laid beside them."""

_JUDGED = f"""\
A comparison is judged by the difference of two means over seeds ([how](statistics.md)), and not at all below
{LEAST_SEEDS} seeds. It *holds* or *does not hold* where the whole 95 % interval lies on one side of zero; it *does not hold*
either where the two are equivalent: the 90 % interval within a margin (1 point of success, 0.1 of reward, 1 step per
episode). Otherwise it *can't be told*. Convergence is the first evaluation on the frozen suite with {LEARNED:.0%} success.
The paper's effect is *compatible* inside our interval; outside, it may be *one seed's luck*, since the paper trained
one of each, or is *not compatible*. What is said of DDPG is judged a second time with its penalty. With so many
comparisons at 95 %, about one interval in twenty misses the truth."""

_PLURALS: dict[Word, str] = {"holds": "hold", "does not hold": "do not hold", "can't be told": "can't be told"}


def write_report(page: Path, outcome: Outcome, command: str, date: str, machine: str) -> None:
    """Writes the page, and its picture into `images/` beside it.

    Args:
        page: a Markdown file.
        outcome: of the campaign.
        command: that made it.
        date: when, as ISO 8601.
        machine: on what, in a few words.
    """
    picture = page.parent / _PICTURE
    picture.parent.mkdir(parents=True, exist_ok=True)
    picture.write_text(draw_curves({row.id: outcome.of_row(row.id) for row in ROWS}))
    page.write_text(report(outcome, command, date, machine))


def report(outcome: Outcome, command: str, date: str, machine: str) -> str:
    """The page; see `write_report`."""
    results = {row.id: [trained.result for trained in outcome.of_row(row.id)] for row in ROWS}
    verdicts = judge_all(results)
    summary = f"**Of the paper's {len(verdicts)} claims: {_told(verdicts)}.**"
    other = [verdict.other_way or verdict for verdict in verdicts]
    lines = [
        "# The paper, reproduced",
        "",
        f"Made by `{command}` on {date}: {len(outcome.done)} trainings in {_duration(outcome.seconds)} on {machine}.",
        "The same campaign is a button of the service's *Paper* page.",
        "",
        f"{summary} With DDPG's logit penalty: {_told(other)}.",
        *_warnings(outcome),
        "",
        "## Tables",
        "",
        _MEASURED,
    ]
    for table in TABLES:
        lines += ["", f"### {table.title}", "", _HEAD, *_rows(table, results)]
    lines += [
        "",
        "## Learning curves",
        "",
        _CURVES,
        "",
        "## Claims",
        "",
        _JUDGED,
        "",
        *(_sentence(verdict) for verdict in verdicts),
        "",
    ]
    return "\n".join(lines)


def _told(rulings: Sequence[Ruling]) -> str:
    words = Counter(ruling.word for ruling in rulings)
    return ", ".join(f"{words[word]} {plural}" for word, plural in _PLURALS.items())


def _warnings(outcome: Outcome) -> list[str]:
    failed = [
        f"- {ROW_BY_ID[one.row].id} with seed {one.seed} failed and is left out: {one.error}"
        for one in outcome.done
        if one.error is not None
    ]
    trial = [
        "",
        f"A trial with {outcome.effort:.3g} of the training steps: its figures say nothing of the paper's.",
    ]
    return [*(trial if outcome.effort < 1.0 else []), *(["", *failed] if failed else [])]


def _rows(table: Table, results: dict[str, list[SeedResult]]) -> list[str]:
    lines = []
    for row, label in zip(table.rows, table.labels, strict=True):
        lines += [_paper(ROW_BY_ID[row], label), _ours("ours", results[row])]
        if row in OTHER_WAY:
            lines.append(_ours("ours, logit penalty", results[OTHER_WAY[row]]))
    return lines


def _paper(row: Row, label: str) -> str:
    figures = row.paper
    reward = "–" if figures.reward is None else f"{figures.reward:.2f}"
    success = f"{100 * figures.success:.2f}"
    return f"| {label} | paper | {reward} | {figures.episodes:.0f} | {success} | {figures.steps:.2f} | – | {success} |"


def _ours(which: str, seeds: Sequence[SeedResult]) -> str:
    spread = row_spread(seeds)
    if spread is None:
        return f"| | {which} | not trained | | | | | |"
    cells = (
        _spread(spread.reward, 2),
        _spread(spread.episodes, 1),
        _spread(spread.success, 1, 100.0),
        _spread(spread.steps, 1),
        _spread(spread.collisions, 1, 100.0),
        f"{', '.join(f'{100 * seed.measured.success:.1f}' for seed in seeds)}. {spread.failed.sentence}",
    )
    return f"| | {which}, {'1 seed' if len(seeds) == 1 else f'{len(seeds)} seeds'} | {' | '.join(cells)} |"


def _spread(spread: Spread, decimals: int, factor: float = 1.0) -> str:
    mean = f"**{factor * spread.mean:.{decimals}f}**"
    if spread.low is None or spread.high is None:
        return mean
    return f"{mean} [{factor * spread.low:.{decimals}f}, {factor * spread.high:.{decimals}f}]"


def _sentence(verdict: Verdict) -> str:
    first = f"- **{verdict.word.capitalize()}:** {verdict.statement} *({verdict.source})* {_why(verdict)}"
    other = verdict.other_way
    again = None if other is None else f"With DDPG's logit penalty: **{other.word}.** {_why(other)}"
    return " ".join(filter(None, (first, again, verdict.evidence, verdict.reading)))


def _why(ruling: Ruling) -> str:
    return f"{ruling.reason} {ruling.compatibility.sentence}" if ruling.compatibility else ruling.reason


def _duration(seconds: float) -> str:
    minutes = round(seconds / 60)
    return f"{seconds:.0f} s" if minutes < 1 else f"{minutes} min"

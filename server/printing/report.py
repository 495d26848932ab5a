"""The whole comparison as one HTML file: no script, nothing to load, opens offline."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from server.comparison.schemas import Comparison, Curves, Profiles
from server.estimates import is_rate
from server.printing.axes import ACROSS, Horizontal, alike, compact
from server.printing.look import Look
from server.printing.metric_words import words_of
from server.printing.palette import STYLE, looks_of
from server.printing.svg import Line, can_be_logarithmic, line_chart
from server.printing.tables import MEASURES, PrintedTable, TableName, printed

_STYLE = """
:root { color-scheme: light dark; }
body { max-width: 1180px; margin: 2rem auto; padding: 0 1rem; font: 15px/1.45 system-ui, sans-serif; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .3rem .8rem .3rem 0; text-align: left; vertical-align: top; border-bottom: 1px solid #8885; }
.wide { overflow-x: auto; }
.charts { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 440px), 1fr)); gap: 1.5rem; }
figure { margin: 0; }
h3 code { font-weight: 400; font-size: .8em; opacity: .75; }
p.note, figcaption.note { max-width: 90ch; font-size: .87em; opacity: .85; overflow-wrap: anywhere; }
"""
_TABLES: tuple[TableName, ...] = ("figures", "verdicts", "improvements", "differences")


@dataclass(frozen=True)
class Report:
    """What a report holds.

    Attributes:
        comparison, profiles: of the experiments.
        curves: of each metric.
        look: how they are drawn.
        link: the address of the page that shows the same.
        made: when and by what, as a sentence.
    """

    comparison: Comparison
    profiles: Profiles
    curves: Sequence[Curves]
    look: Look
    link: str
    made: str

    def html(self) -> str:
        """The file."""
        names = ", ".join(one.name for one in self.comparison.experiments)
        charts = [self._profile(), *(self._curves(each) for each in self.curves)]
        said = " ".join([_BANDS, *self._of_the_page()])
        return "\n".join(
            [
                '<!doctype html><html lang="en"><head><meta charset="utf-8">',
                '<meta name="viewport" content="width=device-width, initial-scale=1">',
                f"<title>Comparison: {escape(names)}</title><style>{_STYLE}{STYLE}</style></head><body>",
                f"<h1>Comparison</h1><p>{escape(names)}</p>",
                f'<p class="note">{escape(self.made)} <a href="{escape(self.link)}">{escape(self.link)}</a></p>',
                *self._warnings(),
                *(_table(table) for name in _TABLES if (table := printed(self.comparison, name)).rows),
                *self._reasons(),
                f'<h2>Charts</h2><p class="note">{escape(said)}</p><div class="charts">{"".join(charts)}</div>',
                "</body></html>",
            ]
        )

    def _warnings(self) -> list[str]:
        warnings = self.comparison.warnings
        if not warnings:
            return []
        items = "".join(f"<li>{escape(warning)}</li>" for warning in warnings)
        return [f"<h2>Before reading too much into this</h2><ul>{items}</ul>"]

    def _reasons(self) -> list[str]:
        names = {one.id: one.name for one in self.comparison.experiments}
        items = [
            f"{names[each.other]} beside {names[each.base]}, {MEASURES[each.measure].lower()}: {each.word}. {each.reason}"
            for each in self.comparison.verdicts
        ]
        if not items:
            return []
        return ["<h2>Reasons of the verdicts</h2>", f"<ul>{''.join(f'<li>{escape(item)}</li>' for item in items)}</ul>"]

    def _of_the_page(self) -> list[str]:
        """What is not drawn because the page did not show it."""
        look = self.look
        hidden = [one.name for one in self.comparison.experiments if one.id in look.hidden]
        notes = []
        if look.zoom is not None:
            horizontal = ACROSS[look.across]
            start, end = map(horizontal.text, look.zoom)
            notes.append(f"{horizontal.title} from {start} to {end} alone, as the page showed its curves.")
        if hidden:
            notes.append(f"Curves that were hidden on the page are left out: {', '.join(hidden)}.")
        return notes

    def _profile(self) -> str:
        looks = looks_of(one.id for one in self.profiles.experiments)
        lines = [
            Line(_label(one.name, one.seeds), looks[one.id], one.mean, one.low, one.high)
            for one in self.profiles.experiments
            if one.mean
        ]
        title = "Performance profile: share of attempts that score more"
        return _figure(
            title, line_chart(title, _SCORE, self.profiles.thresholds, lines, rate=True, vertical="Share of attempts")
        )

    def _curves(self, curves: Curves) -> str:
        looks = looks_of(one.id for one in curves.experiments)
        all_lines = [
            Line(_label(one.name, max(one.count, default=0)), looks[one.id], one.mean, one.low, one.high)
            for one in curves.experiments
            if one.id not in self.look.hidden
        ]
        x, lines = self.look.shown(curves.steps if curves.x is None else curves.x, all_lines, curves.name)
        log_y = curves.name in self.look.log_y
        words = words_of(curves.name)
        chart = line_chart(
            curves.name,
            ACROSS[curves.across],
            x,
            lines,
            rate=is_rate(curves.name),
            share=words.share,
            log_x=self.look.log_x,
            log_y=log_y,
            vertical=words.axis,
            nothing="No value yet" if all(value is None for one in curves.experiments for value in one.mean) else _NOT_SHOWN,
        )
        notes = _notes(curves, linear=log_y and not can_be_logarithmic(lines), strength=self.look.smooth.get(curves.name))
        title = f"{words.title}, {words.note}" if words.note else words.title
        return _figure(title, chart, " ".join(notes), raw="" if title == curves.name else curves.name)


def _notes(curves: Curves, *, linear: bool, strength: float | None) -> list[str]:
    """What has to be known to read the curves."""
    left_out = sum(one.unplaced for one in curves.experiments)
    notes = []
    if curves.across != "steps":
        notes.append("Means end where the first seed is through.")
    if strength is not None:
        notes.append(f"Smoothed, {strength:.2f}; thin: what was reported.")
    if left_out:
        notes.append(f"Runs left out, of which x was not counted when they trained: {left_out}.")
    if linear:
        notes.append("Drawn linearly: a logarithmic axis has no place for values of 0 or below.")
    return notes


_SCORE = Horizontal("Score: path efficiency of an arrival, else 0", compact, alike)
_NOT_SHOWN = "Nothing of it was shown on the page"
_BANDS = "Means over seeds; bands are 95 % intervals over seeds (Student's t, of rates on the scale of the logit)."


def _figure(title: str, chart: str, note: str = "", raw: str = "") -> str:
    below = f'<figcaption class="note">{escape(note)}</figcaption>' if note else ""
    name = f" <code>{escape(raw)}</code>" if raw else ""
    return f"<figure><h3>{escape(title)}{name}</h3>{chart}{below}</figure>"


def _label(name: str, seeds: int) -> str:
    return f"{name}, {seeds} {'seed' if seeds == 1 else 'seeds'}"


def _table(table: PrintedTable) -> str:
    head = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in table.heading)
    rows = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in table.rows)
    body = f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
    caption = f'<p class="note">{escape(table.caption)}</p>'
    return f'<h2>{escape(table.title)}</h2><div class="wide">{body}</div>{caption}'

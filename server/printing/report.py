"""The whole comparison as one HTML file: no script, nothing to load, opens offline."""

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape

from server.comparison.schemas import Comparison, Curves, Profiles
from server.estimates import is_rate
from server.printing.svg import Line, line_chart
from server.printing.tables import PrintedTable, TableName, printed

_STYLE = """
:root { color-scheme: light dark; }
body { max-width: 1180px; margin: 2rem auto; padding: 0 1rem; font: 15px/1.45 system-ui, sans-serif; }
table { border-collapse: collapse; font-variant-numeric: tabular-nums; }
th, td { padding: .3rem .8rem .3rem 0; text-align: left; vertical-align: top; border-bottom: 1px solid #8885; }
.wide { overflow-x: auto; }
.charts { display: grid; grid-template-columns: repeat(auto-fit, minmax(min(100%, 440px), 1fr)); gap: 1.5rem; }
figure { margin: 0; }
p.note { max-width: 90ch; font-size: .87em; opacity: .85; }
"""
_TABLES: tuple[TableName, ...] = ("figures", "verdicts", "improvements", "differences")


@dataclass(frozen=True)
class Report:
    """What a report holds.

    Attributes:
        comparison, profiles: of the experiments.
        curves: of each metric.
        link: the address of the page that shows the same.
        made: when and by what, as a sentence.
    """

    comparison: Comparison
    profiles: Profiles
    curves: Sequence[Curves]
    link: str
    made: str

    def html(self) -> str:
        """The file."""
        names = ", ".join(one.name for one in self.comparison.experiments)
        charts = [self._profile(), *(self._curves(each) for each in self.curves)]
        return "\n".join(
            [
                '<!doctype html><html lang="en"><head><meta charset="utf-8">',
                '<meta name="viewport" content="width=device-width, initial-scale=1">',
                f"<title>Comparison: {escape(names)}</title><style>{_STYLE}</style></head><body>",
                f"<h1>Comparison</h1><p>{escape(names)}</p>",
                f'<p class="note">{escape(self.made)} <a href="{escape(self.link)}">{escape(self.link)}</a></p>',
                *self._warnings(),
                *(_table(table) for name in _TABLES if (table := printed(self.comparison, name)).rows),
                f'<h2>Charts</h2><p class="note">{_BANDS}</p><div class="charts">{"".join(charts)}</div>',
                "</body></html>",
            ]
        )

    def _warnings(self) -> list[str]:
        warnings = self.comparison.warnings
        if not warnings:
            return []
        items = "".join(f"<li>{escape(warning)}</li>" for warning in warnings)
        return [f"<h2>Before reading too much into this</h2><ul>{items}</ul>"]

    def _profile(self) -> str:
        lines = [
            Line(_label(one.name, one.seeds), color, one.mean, one.low, one.high)
            for color, one in enumerate(self.profiles.experiments)
            if one.mean
        ]
        title = "Performance profile: share of attempts that score more"
        x_title = "Score: path efficiency of an arrival, else 0"
        return _figure(title, line_chart(title, x_title, self.profiles.thresholds, lines, rate=True))

    def _curves(self, curves: Curves) -> str:
        lines = [
            Line(_label(one.name, max(one.count, default=0)), color, one.mean, one.low, one.high)
            for color, one in enumerate(curves.experiments)
        ]
        return _figure(curves.name, line_chart(curves.name, "Steps", curves.steps, lines, rate=is_rate(curves.name)))


_BANDS = "Means over seeds; bands are 95 % intervals over seeds (Student's t, of rates on the scale of the logit)."


def _figure(title: str, chart: str) -> str:
    return f"<figure><h3>{escape(title)}</h3>{chart}</figure>"


def _label(name: str, seeds: int) -> str:
    return f"{name}, {seeds} {'seed' if seeds == 1 else 'seeds'}"


def _table(table: PrintedTable) -> str:
    head = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in table.heading)
    rows = "".join(f"<tr>{''.join(f'<td>{escape(cell)}</td>' for cell in row)}</tr>" for row in table.rows)
    body = f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>"
    caption = f'<p class="note">{escape(table.caption)}</p>'
    return f'<h2>{escape(table.title)}</h2><div class="wide">{body}</div>{caption}'

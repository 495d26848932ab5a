"""Printed tables as LaTeX, Markdown and CSV."""

import re

from server.printing.tables import PrintedTable
from server.spreadsheets import csv_rows
from workers.wording import MINUS, NARROW_SPACE

_LATEX = {
    "\\": r"\textbackslash{}",
    "{": r"\{",
    "}": r"\}",
    "%": r"\%",
    "&": r"\&",
    "$": r"\$",
    "#": r"\#",
    "_": r"\_",
    "~": r"\textasciitilde{}",
    "^": r"\textasciicircum{}",
    "<": r"$<$",
    ">": r"$>$",
    "–": "--",
    "×": r"$\times$",
    MINUS: "$-$",
    NARROW_SPACE: r"\,",
}
# For programs: no space within a number, and the minus of ASCII.
_PLAIN = str.maketrans({NARROW_SPACE: "", MINUS: "-"})
# What Markdown would take for its own.
_MARKS = re.compile(r"([\\`*_{}<>|#])")
# A sign before a number is a minus, not a hyphen.
_MINUS = re.compile(r"(?<![\w.)])-(?=\d)")


def latex(table: PrintedTable) -> str:
    """A `table` with booktabs; every text is escaped."""
    columns = "".join("l" if place in table.texts else "r" for place in range(len(table.heading)))
    lines = [
        r"% \usepackage{booktabs}",
        r"\begin{table}",
        r"  \centering",
        rf"  \caption{{{_escaped(table.title)}. {_escaped(table.caption)}}}",
        rf"  \label{{tab:{table.name}}}",
        rf"  \begin{{tabular}}{{{columns}}}",
        r"    \toprule",
        f"    {_latex_row(table.heading)}",
        r"    \midrule",
        *(f"    {_latex_row(row)}" for row in table.rows),
        r"    \bottomrule",
        r"  \end{tabular}",
        r"\end{table}",
    ]
    return "\n".join(lines) + "\n"


def markdown(table: PrintedTable) -> str:
    """A table as GitHub and pandoc read it, its caption below."""
    rule = ["---" if place in table.texts else "---:" for place in range(len(table.heading))]
    rows = [_markdown_row(table.heading), f"| {' | '.join(rule)} |", *(_markdown_row(row) for row in table.rows)]
    return "\n".join([f"**{table.title}**", "", *rows, "", table.caption]) + "\n"


def comma_separated(table: PrintedTable) -> str:
    """The same cells as CSV, with numbers that programs read."""
    return csv_rows([table.heading, *(tuple(cell.translate(_PLAIN) for cell in row) for row in table.rows)]).decode()


def _latex_row(cells: tuple[str, ...]) -> str:
    # A bracket behind a line's end would be its optional argument.
    return " & ".join(f"{{{text}}}" if (text := _escaped(cell)).startswith("[") else text for cell in cells) + r" \\"


def _escaped(text: str) -> str:
    escaped = "".join(_LATEX.get(character, character) for character in text)
    return _MINUS.sub("$-$", escaped)


def _markdown_row(cells: tuple[str, ...]) -> str:
    texts = [_MARKS.sub(r"\\\1", _one_line(cell)) for cell in cells]
    return f"| {' | '.join(texts)} |"


def _one_line(cell: str) -> str:
    # The narrow spaces of numbers stay.
    return NARROW_SPACE.join(" ".join(part.split()) for part in cell.split(NARROW_SPACE))

"""A line chart as SVG: means with their bands, axes with titles, a legend. Needs no script and no font of its own."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape

from server.printing.axes import Horizontal, alike, compact, percent, scale, ticks
from server.printing.palette import Look

_WIDTH, _HEIGHT = 570, 280
_LEFT, _RIGHT, _TOP, _BOTTOM = 64, 22, 12, 48
# Pixels of a row of the legend.
_ROW = 18
# Of the title of y: as long as its axis is.
_MOST_LETTERS = 36
# Of a line in the legend: as long as shows its dashes.
_SAMPLE = 28

Values = Sequence[float | None]


@dataclass(frozen=True)
class Line:
    """A curve, each value None where there is none.

    Attributes:
        label: in the legend.
        look: its colour and dashes.
        mean: what is drawn.
        low, high: the ends of its interval.
        beneath: drawn thin beneath it: what was reported, where the mean is smoothed.
    """

    label: str
    look: Look
    mean: Values
    low: Values
    high: Values
    beneath: Values = ()


def line_chart(
    title: str,
    horizontal: Horizontal,
    x: Sequence[float],
    lines: Sequence[Line],
    *,
    rate: bool,
    share: bool | None = None,
    log_x: bool = False,
    log_y: bool = False,
    vertical: str = "",
    nothing: str = "No value yet",
) -> str:
    """The chart as an `svg` element.

    Args:
        title: for those who can't see it.
        horizontal: what x is.
        x: of every value, ascending.
        lines: each as long as `x`.
        rate: whether y is from 0 to 1.
        share: whether it is written in per cent; as `rate` if not given.
        log_x: whether x is logarithmic; every one is above 0 then.
        log_y: whether y is, where every mean is above 0.
        vertical: what y is.
        nothing: what stands in place of a chart without a value.
    """
    drawn = [line for line in lines if any(value is not None for value in line.mean)]
    log_y = log_y and can_be_logarithmic(drawn)
    sides = [(line.mean, line.beneath) if log_y else (line.mean, line.beneath, line.low, line.high) for line in drawn]
    values = [value for line in sides for side in line for value in side if value is not None]
    height = _HEIGHT + _ROW * len(drawn)
    box = f'viewBox="0 0 {_WIDTH} {height}" role="img" aria-label="{escape(title)}"'
    parts = [f'<svg xmlns="http://www.w3.org/2000/svg" {box} font-family="system-ui, sans-serif" font-size="11">']
    if values:
        low, high = (0.0, 1.0) if rate and not log_y else _padded(min(values), max(values), log=log_y)
        across = scale(x[0], x[-1], _LEFT, _WIDTH - _RIGHT, logarithmic=log_x)
        up = scale(low, high, _HEIGHT - _BOTTOM, _TOP, logarithmic=log_y)
        parts += _levels(ticks(low, high, logarithmic=log_y), up, share=rate if share is None else share, logarithmic=log_y)
        parts += _upright(vertical) if vertical else []
        parts += _places(horizontal, ticks(x[0], x[-1], horizontal.rounds, logarithmic=log_x), across)
        for line in drawn:
            # An interval that reaches below what a logarithmic axis shows ends at its edge.
            parts += _line(x, line, across, lambda value: up(max(value, low)) if log_y else up(value))
        parts += [_entry(row, line) for row, line in enumerate(drawn)]
    else:
        parts.append(
            f'<text x="{_WIDTH / 2}" y="{_HEIGHT / 2}" text-anchor="middle" fill="currentColor">{escape(nothing)}</text>'
        )
    return "\n".join([*parts, "</svg>"])


def can_be_logarithmic(lines: Sequence[Line]) -> bool:
    """Whether a logarithmic axis has a place for every mean."""
    return all(value is None or value > 0.0 for line in lines for value in (*line.mean, *line.beneath))


def _levels(levels: Sequence[float], up: Callable[[float], float], *, share: bool, logarithmic: bool) -> list[str]:
    # Of a logarithmic axis each is written as it is.
    text = percent if share else compact
    texts = [text(level) for level in levels] if logarithmic else alike(levels, share=share)
    parts = []
    for tick, written in zip(levels, texts, strict=True):
        level = f"{up(tick):.1f}"
        ends = f'x1="{_LEFT}" x2="{_WIDTH - _RIGHT}" y1="{level}" y2="{level}"'
        parts.append(f'<line {ends} stroke="currentColor" stroke-opacity="0.15"/>')
        parts.append(_text(_LEFT - 6, up(tick) + 4, "end", written))
    return parts


def _places(horizontal: Horizontal, places: Sequence[float], across: Callable[[float], float]) -> list[str]:
    below = _HEIGHT - _BOTTOM
    texts = zip(places, horizontal.texts(places), strict=True)
    parts = [_text(across(tick), below + 16, "middle", written) for tick, written in texts]
    return [*parts, _text((_LEFT + _WIDTH - _RIGHT) / 2, below + 34, "middle", horizontal.title)]


def _upright(title: str) -> list[str]:
    # A metric without words is called by its name, which may be longer; the chart's heading has all of it.
    title = title if len(title) <= _MOST_LETTERS else f"{title[: _MOST_LETTERS - 1]}…"
    middle = (_TOP + _HEIGHT - _BOTTOM) / 2
    place = f'transform="translate(12 {middle:.1f}) rotate(-90)" text-anchor="middle"'
    return [f'<text {place} fill="currentColor">{escape(title)}</text>']


def _text(left: float, top: float, anchor: str, text: str) -> str:
    return f'<text x="{left:.1f}" y="{top:.1f}" text-anchor="{anchor}" fill="currentColor">{escape(text)}</text>'


def _line(x: Sequence[float], line: Line, across: Callable[[float], float], up: Callable[[float], float]) -> list[str]:
    color = line.look.ink

    def points(values: Values) -> list[str]:
        return [f"{across(at):.1f},{up(value):.1f}" for at, value in zip(x, values, strict=True) if value is not None]

    parts = []
    edge = points(line.high) + points(line.low)[::-1]
    if edge:
        parts.append(f'<polygon points="{" ".join(edge)}" fill="{color}" fill-opacity="0.15"/>')
    if line.beneath and len(beneath := points(line.beneath)) > 1:
        look = f'stroke="{color}" stroke-width="1" stroke-opacity="0.4"{line.look.dashes(1)}'
        parts.append(f'<polyline points="{" ".join(beneath)}" fill="none" {look}/>')
    mean = points(line.mean)
    if len(mean) == 1:
        left, top = mean[0].split(",")
        parts.append(f'<circle cx="{left}" cy="{top}" r="3" fill="{color}"/>')
    else:
        parts.append(
            f'<polyline points="{" ".join(mean)}" fill="none" stroke="{color}" stroke-width="2"{line.look.dashes(2)}/>'
        )
    return parts


def _entry(row: int, line: Line) -> str:
    top = _HEIGHT + _ROW * row
    ends = f'x1="{_LEFT}" x2="{_LEFT + _SAMPLE}" y1="{top + 5}" y2="{top + 5}"'
    sample = f'<line {ends} stroke="{line.look.ink}" stroke-width="3"{line.look.dashes(2)}/>'
    return sample + _text(_LEFT + _SAMPLE + 8, top + 9, "start", line.label)


def _padded(low: float, high: float, *, log: bool = False) -> tuple[float, float]:
    if log:
        room = max((high / low) ** 0.05, 1.01)
        return low / room, high * room
    room = (high - low) * 0.05 or abs(high) * 0.05 or 1.0
    return low - room, high + room

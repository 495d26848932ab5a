"""The learning curves as a picture: SVG on a ground of its own, light or dark as the reader's system is."""

import math
from collections.abc import Mapping, Sequence
from xml.sax.saxutils import escape

import numpy as np

from workers.reproduction.curves import CURVE_BINS, Floats, band, binned
from workers.reproduction.results import Trained
from workers.reproduction.rows import FIGURES, ROW_BY_ID, Figure

_COLUMNS = 2
_WIDTH, _HEIGHT = 460, 300
_LEFT, _RIGHT, _TOP, _BOTTOM = 58, 14, 62, 40
_TICKS = 5
_LEGEND_MARK, _LEGEND_LETTER, _LEGEND_TOP, _LEGEND_LINE = 44, 7, 40, 16

# After Okabe and Ito (2008): told apart with any colour vision, and dark enough for white, light enough for black.
_COLORS = {"ResBlock PPO": "a", "DDPG": "b", "Vanilla PPO": "c", "DDPG, logit penalty": "d"}

_STYLE = """
  .ground { fill: #ffffff } text { font: 12px system-ui, sans-serif; fill: #5d6870 }
  .title { font-size: 13px; font-weight: 600; fill: #1c2327 } .grid { stroke: #e4e8ea } .seed, .mean { fill: none }
  .seed { stroke-width: 0.7; opacity: 0.35 } .mean { stroke-width: 2 } .band { stroke: none; opacity: 0.16 }
  .a { stroke: #0072b2 } .b { stroke: #d55e00 } .c { stroke: #00895e } .d { stroke: #a2497f }
  .band.a { fill: #0072b2 } .band.b { fill: #d55e00 } .band.c { fill: #00895e } .band.d { fill: #a2497f }
  @media (prefers-color-scheme: dark) {
    .ground { fill: #171b1f } text { fill: #97a1a9 } .title { fill: #dbe0e4 } .grid { stroke: #2a3036 }
    .a { stroke: #56a9e8 } .b { stroke: #ff8b4d } .c { stroke: #2fc796 } .d { stroke: #e08fc4 }
    .band.a { fill: #56a9e8 } .band.b { fill: #ff8b4d } .band.c { fill: #2fc796 } .band.d { fill: #e08fc4 }
  }"""


def draw_curves(trained: Mapping[str, Sequence[Trained]]) -> str:
    """The paper's figures in its order: each seed thin, their mean bold, its 95 % interval as a band.

    Args:
        trained: finished trainings, by row; a row without any is left out of its figure.
    """
    rows = math.ceil(len(FIGURES) / _COLUMNS)
    width, height = _COLUMNS * _WIDTH, rows * _HEIGHT
    panels = []
    for index, figure in enumerate(FIGURES):
        down, across = divmod(index, _COLUMNS)
        panel = _panel(figure, trained)
        panels.append(f'<g transform="translate({across * _WIDTH} {down * _HEIGHT})">\n{panel}\n</g>')
    return "\n".join(
        (
            f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {height}" width="{width}" height="{height}">',
            f"<title>Reward of a target attempt while training</title>\n<style>{_STYLE}\n</style>",
            f'<rect class="ground" width="{width}" height="{height}" rx="8"/>',
            *panels,
            "</svg>\n",
        )
    )


def _panel(figure: Figure, trained: Mapping[str, Sequence[Trained]]) -> str:
    present = [row for row in figure.rows if trained.get(row)]
    title = f'<text class="title" x="{_LEFT}" y="22">{escape(figure.title)}</text>'
    if not present:
        return f'{title}\n<text x="{_LEFT}" y="{_HEIGHT / 2:.0f}">not trained</text>'
    last = max(one.result.steps for row in present for one in trained[row])
    edges = np.linspace(0.0, last, CURVE_BINS + 1)
    curves = {
        row: np.array([binned(one.curve_steps, one.curve, edges) for one in trained[row]], np.float64) for row in present
    }
    scale = _Scale(last, np.concatenate([values.ravel() for values in curves.values()]))
    centres = (edges[1:] + edges[:-1]) / 2
    parts = [title, _axes(scale)]
    for row, values in curves.items():
        parts += _curve(_COLORS[ROW_BY_ID[row].method], centres, values, scale)
    return "\n".join((*parts, *_legend([ROW_BY_ID[row].method for row in present])))


def _legend(methods: Sequence[str]) -> list[str]:
    """In one line, or in two."""
    parts, x, y = [], _LEFT, _LEGEND_TOP
    for method in methods:
        width = _LEGEND_MARK + _LEGEND_LETTER * len(method)
        if x > _LEFT and x + width > _WIDTH - _RIGHT:
            x, y = _LEFT, y + _LEGEND_LINE
        parts.append(f'<path class="mean {_COLORS[method]}" d="M{x} {y - 4}h18"/>')
        parts.append(f'<text x="{x + 24}" y="{y}">{escape(method)}</text>')
        x += width
    return parts


class _Scale:
    """From steps and rewards to the panel's pixels."""

    def __init__(self, last: float, values: Floats) -> None:
        finite = values[np.isfinite(values)]
        self.ticks = _round_ticks(float(finite.min()), float(finite.max())) if finite.size else [0.0, 1.0]
        self.steps = _round_ticks(0.0, last)
        self._last, self._low, self._high = last, self.ticks[0], self.ticks[-1]

    def x(self, step: float) -> float:
        return _LEFT + step / self._last * (_WIDTH - _LEFT - _RIGHT)

    def y(self, value: float) -> float:
        part = (value - self._low) / (self._high - self._low)
        return _HEIGHT - _BOTTOM - part * (_HEIGHT - _TOP - _BOTTOM)

    def reaches(self, step: float) -> bool:
        return step <= self._last


def _round_ticks(low: float, high: float) -> list[float]:
    """Round numbers from at most `low` to at least `high`."""
    rough = max(high - low, 1e-9) / _TICKS
    power = 10.0 ** math.floor(math.log10(rough))
    step = next(power * factor for factor in (1, 2, 5, 10) if power * factor >= rough * (1 - 1e-9))
    first, last = math.floor(low / step), math.ceil(high / step)
    return [step * number for number in range(first, max(last, first + 1) + 1)]


def _axes(scale: _Scale) -> str:
    parts = []
    for tick in scale.ticks:
        y = scale.y(tick)
        parts.append(f'<path class="grid" d="M{_LEFT} {y:.1f}H{_WIDTH - _RIGHT}"/>')
        parts.append(f'<text x="{_LEFT - 8}" y="{y + 4:.1f}" text-anchor="end">{_short(tick)}</text>')
    foot = _HEIGHT - _BOTTOM + 18
    parts += [
        f'<text x="{scale.x(tick):.1f}" y="{foot}" text-anchor="middle">{_short(tick)}</text>'
        for tick in filter(scale.reaches, scale.steps)
    ]
    return "\n".join(parts)


def _curve(color: str, steps: Floats, values: Floats, scale: _Scale) -> list[str]:
    mean, low, high = band(values)
    # An interval over a few seeds may reach far beyond what any of them did: the panel ends where the seeds end.
    low, high = low.clip(scale.ticks[0], scale.ticks[-1]), high.clip(scale.ticks[0], scale.ticks[-1])
    there = np.flatnonzero(np.isfinite(mean))
    there_and_back = np.concatenate([there, there[::-1]])
    edge = np.concatenate([high[there], low[there[::-1]]])
    parts = [f'<path class="band {color}" d="{_path(steps[there_and_back], edge, scale)}Z"/>'] if there.size else []
    if len(values) > 1:
        for one in values:
            seen = np.isfinite(one)
            if seen.any():
                parts.append(f'<path class="seed {color}" d="{_path(steps[seen], one[seen], scale)}"/>')
    if there.size:
        parts.append(f'<path class="mean {color}" d="{_path(steps[there], mean[there], scale)}"/>')
    return parts


def _path(steps: Floats, values: Floats, scale: _Scale) -> str:
    points = (f"{scale.x(x):.1f} {scale.y(y):.1f}" for x, y in zip(steps.tolist(), values.tolist(), strict=True))
    return "M" + "L".join(points)


def _short(value: float) -> str:
    if abs(value) >= 1e6:
        return f"{value / 1e6:g}M"
    return f"{value / 1e3:g}k" if abs(value) >= 1e3 else f"{value:g}"

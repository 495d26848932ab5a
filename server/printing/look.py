"""How curves are looked at, as a page's address says it, and what it makes of them (web/src/charts/view.ts, series.ts)."""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from server.comparison.grid import Across
from server.printing.svg import Line, Values

# Between a chart's smoothing and its metric, and between the ends of a zoom.
_BETWEEN = "~"
_MOST_SMOOTHING = 0.99


@dataclass(frozen=True)
class Look:
    """How the curves are looked at.

    Attributes:
        metrics: whose curves there are, in order; empty for those that a page shows at first.
        across: what x is.
        log_x: whether it is logarithmic.
        log_y: the metrics whose values are.
        smooth: how much of the past is in a metric's curves, more than 0 and less than 1.
        hidden: ids of the experiments whose lines are not drawn.
        zoom: what is shown of x; None for all of it.
    """

    metrics: Sequence[str] = ()
    across: Across = "steps"
    log_x: bool = False
    log_y: Collection[str] = ()
    smooth: Mapping[str, float] = field(default_factory=dict)
    hidden: Collection[str] = ()
    zoom: tuple[float, float] | None = None

    def address(self) -> list[tuple[str, str]]:
        """As a page's address says it."""
        across = [] if self.across == "steps" else [("x", str(self.across))]
        log_x = [("xlog", "1")] if self.log_x else []
        zoom = [] if self.zoom is None else [("zoom", _BETWEEN.join(f"{end:.6g}" for end in self.zoom))]
        return [
            *across,
            *log_x,
            *(("ylog", name) for name in self.log_y),
            *(("panel", name) for name in self.metrics),
            *(("smooth", f"{strength:g}{_BETWEEN}{name}") for name, strength in self.smooth.items()),
            *(("hide", each) for each in self.hidden),
            *zoom,
        ]

    def shown(self, x: Sequence[float], lines: Sequence[Line], metric: str) -> tuple[list[float], list[Line]]:
        """What is drawn of a metric's lines: smoothed, then cut at the ends of the zoom."""
        strength = self.smooth.get(metric, 0.0)
        drawn = [smoothed(line, strength) for line in lines] if strength else list(lines)
        return (list(x), drawn) if self.zoom is None else _within(x, drawn, self.zoom, logarithmic=self.log_x)


def zoom_of(text: str | None) -> tuple[float, float] | None:
    """What "19000~36000" says; None where it says nothing, or what cannot be."""
    ends = tuple(map(float, text.split(_BETWEEN))) if text else ()
    if len(ends) != 2 or not all(map(math.isfinite, ends)) or ends[0] >= ends[1]:
        return None
    return ends[0], ends[1]


def smoothing_of(texts: Sequence[str]) -> dict[str, float]:
    """What "0.8~train/return" says of each metric."""
    pairs = [text.split(_BETWEEN, 1) for text in texts]
    return {name: strength for part, name in pairs if 0.0 < (strength := float(part)) <= _MOST_SMOOTHING}


def smoothed(line: Line, strength: float) -> Line:
    """A line's exponential moving average, the start-up bias removed as in Adam; what was reported lies beneath it.

    An interval over seeds is none of a smoothed mean.
    """
    average = norm = 0.0
    soft: list[float | None] = []
    for value in line.mean:
        if value is None:
            soft.append(None)
            continue
        average = strength * average + (1.0 - strength) * value
        norm = strength * norm + (1.0 - strength)
        soft.append(average / norm)
    nothing: Values = [None] * len(soft)
    return replace(line, mean=soft, low=nothing, high=nothing, beneath=line.mean)


def _within(
    x: Sequence[float], lines: Sequence[Line], zoom: tuple[float, float], *, logarithmic: bool
) -> tuple[list[float], list[Line]]:
    """What lies within the ends of a zoom, and where the lines cross these: they have no value where they do not reach."""
    start, end = zoom
    if logarithmic and start <= 0.0:
        start = min(x, default=0.0)
    if not x or start >= end:
        return [], [replace(line, mean=[], low=[], high=[], beneath=[]) for line in lines]
    inside = [place for place, at in enumerate(x) if start < at < end]
    bend: Callable[[float], float] = math.log10 if logarithmic else float
    places = [bend(at) for at in x]

    def cut(values: Values) -> list[float | None]:
        known = [(place, value) for place, value in zip(places, values, strict=True) if value is not None]
        if not known:
            return [None] * (len(inside) + 2)
        at, of = zip(*known, strict=True)
        ends = [float(each) for each in np.interp([bend(start), bend(end)], at, of, left=np.nan, right=np.nan)]
        first, last = (None if math.isnan(each) else each for each in ends)
        return [first, *(values[place] for place in inside), last]

    cuts = [
        replace(
            line,
            mean=cut(line.mean),
            low=cut(line.low),
            high=cut(line.high),
            beneath=cut(line.beneath) if line.beneath else (),
        )
        for line in lines
    ]
    return [start, *(x[place] for place in inside), end], cuts

"""Axes of printed charts: what x is, where a value lies, and which ticks there are; as on the pages."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from server.comparison.grid import Across

_TICKS = 5
_MINUTE, _HOUR, _DAY = 60.0, 3_600.0, 86_400.0
_ROUND_TIMES = (
    *(0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0, 15.0, 30.0),
    *(minutes * _MINUTE for minutes in (1, 2, 5, 10, 15, 30)),
    *(hours * _HOUR for hours in (1, 2, 3, 6, 12)),
    *(days * _DAY for days in (1, 2, 5, 10, 20, 50, 100)),
)


@dataclass(frozen=True)
class Horizontal:
    """What x is, and how it is written.

    Attributes:
        title: of the axis.
        text: of a value.
        rounds: what may lie between two ticks, ascending; empty for any round number.
    """

    title: str
    text: Callable[[float], str]
    rounds: Sequence[float] = ()


def elapsed(seconds: float) -> str:
    """As "0.5 s", "45 s", "3 min 20 s", "2 h 5 min", "3 d 4 h"."""
    if seconds < _MINUTE:
        return f"{seconds:.3g} s"
    for unit, name, part, small in ((_DAY, "d", _HOUR, "h"), (_HOUR, "h", _MINUTE, "min"), (_MINUTE, "min", 1.0, "s")):
        if seconds >= unit:
            whole, rest = divmod(round(seconds / part), round(unit / part))
            return f"{whole} {name} {rest} {small}" if rest else f"{whole} {name}"
    raise AssertionError("a minute is the least of the units")


def _counted(value: float) -> str:
    # As on the pages: a narrow space between thousands.
    return (f"{value:,.0f}" if value == round(value) else f"{value:,g}").replace(",", "\N{NARROW NO-BREAK SPACE}")


STEPS = Horizontal("Steps", _counted)
ACROSS: Mapping[Across, Horizontal] = {
    "steps": STEPS,
    "wall": Horizontal("Time under way", elapsed, _ROUND_TIMES),
    "cpu": Horizontal("CPU time of the trainer", elapsed, _ROUND_TIMES),
    "episodes": Horizontal("Episodes", _counted),
}


def scale(low: float, high: float, start: float, end: float, *, logarithmic: bool = False) -> Callable[[float], float]:
    """Where a value from `low` to `high` lies between `start` and `end`; a logarithmic one knows values above 0 alone."""
    bend: Callable[[float], float] = math.log10 if logarithmic else float
    span = bend(high) - bend(low)
    return lambda value: (start + end) / 2 if span == 0 else start + (bend(value) - bend(low)) / span * (end - start)


def ticks(low: float, high: float, rounds: Sequence[float] = (), *, logarithmic: bool = False) -> list[float]:
    """Round numbers from low to high, about five; on a logarithmic axis powers of ten, or what lies between them."""
    if high <= low:
        return [low]
    if logarithmic:
        return _factors(low, high)
    rough = (high - low) / _TICKS
    power = 10.0 ** math.floor(math.log10(rough))
    of_any = next(power * factor for factor in (1, 2, 2.5, 5, 10) if power * factor >= rough)
    step = next((each for each in rounds if each >= rough), of_any)
    first = math.ceil(low / step - 1e-9)
    return [round(index * step, 12) + 0.0 for index in range(first, math.floor(high / step + 1e-9) + 1)]


def _factors(low: float, high: float) -> list[float]:
    powers = range(math.floor(math.log10(low)), math.ceil(math.log10(high)) + 1)
    inside = [(power, times) for power in powers for times in (1, 2, 5) if low <= times * 10.0**power <= high]
    tens = [10.0**power for power, times in inside if times == 1]
    if len(tens) < 2:
        return [times * 10.0**power for power, times in inside] if len(inside) > 1 else ticks(low, high)
    return tens[:: math.ceil(len(tens) / (_TICKS + 1))]

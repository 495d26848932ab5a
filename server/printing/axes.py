"""Axes of printed charts: what x is, where a value lies, and which ticks there are; as on the pages."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

from server.comparison.grid import Across
from server.printing.values import significant
from workers.wording import MINUS, NARROW_SPACE, counted

_TICKS = 5
_AXIS_DIGITS = 3
_MOST_DECIMALS = 12
# What is less is written with a power of ten.
_SMALL = 1e-4
_LETTERS = ((1e9, "G"), (1e6, "M"), (1e3, "k"))
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
        texts: of ticks.
        rounds: what may lie between two ticks, ascending; empty for any round number.
    """

    title: str
    text: Callable[[float], str]
    texts: Callable[[Sequence[float]], list[str]]
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


def compact(value: float) -> str:
    """A number in few characters: "1.23M", "0.0123", "2e−05"."""
    factor, unit = _letter(abs(value))
    return significant(value / factor, _AXIS_DIGITS) + unit


def percent(share: float) -> str:
    """A share of a logarithmic axis: "0.1 %"."""
    return f"{significant(100.0 * share, _AXIS_DIGITS)}{NARROW_SPACE}%"


def alike(levels: Sequence[float], *, share: bool = False) -> list[str]:
    """The ticks of a linear axis, all in the unit of the largest and with as many decimals: "0.00", "0.25"; "0", "0.5k"."""
    largest = max(map(abs, levels), default=0.0)
    if share:
        factor, unit = 0.01, f"{NARROW_SPACE}%"
    elif 0.0 < largest < _SMALL:
        power = math.floor(math.log10(largest) + 1e-9)
        factor, unit = 10.0**power, f"e{power}".replace("-", MINUS)
    else:
        factor, unit = _letter(largest)
    values = [level / factor for level in levels]
    near = 1e-6 * min((abs(b - a) for a, b in pairwise(values)), default=max(map(abs, values), default=1.0))
    decimals = next(
        (each for each in range(_MOST_DECIMALS) if all(abs(value - round(value, each)) <= near for value in values)),
        _MOST_DECIMALS,
    )
    return [_in_unit(value, decimals, unit, bare_zero=not share and factor != 1.0) for value in values]


def _in_unit(value: float, decimals: int, unit: str, *, bare_zero: bool) -> str:
    text = f"{abs(value):.{decimals}f}"
    if float(text) == 0.0:
        return "0" if bare_zero else text + unit
    return f"{MINUS if value < 0.0 else ''}{text}{unit}"


def _letter(size: float) -> tuple[float, str]:
    return next(((factor, letter) for factor, letter in _LETTERS if size >= factor), (1.0, ""))


def _whole(levels: Sequence[float]) -> list[str]:
    return [counted(level) if float(level).is_integer() else compact(level) for level in levels]


def _of_time(title: str) -> Horizontal:
    return Horizontal(title, elapsed, lambda seconds: [elapsed(each) for each in seconds], _ROUND_TIMES)


STEPS = Horizontal("Steps", counted, _whole)
ACROSS: Mapping[Across, Horizontal] = {
    "steps": STEPS,
    "wall": _of_time("Time under way"),
    "cpu": _of_time("CPU time of the trainer"),
    "episodes": Horizontal("Episodes", counted, _whole),
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

"""Differences in words: a measure's unit, its margin, and how figures are written."""

from sim.config import Frozen
from workers.statistics.differences import Difference
from workers.wording import NARROW_SPACE


class Scale(Frozen):
    """How a measure is compared and written.

    Attributes:
        unit: as a reader knows it.
        factor: from the measure to that unit.
        decimals: that are written.
        margin: smaller differences than this are none that anybody drives by, in the measure's own unit.
        more_is_better: whether a larger value speaks for what is judged.
    """

    unit: str
    factor: float
    decimals: int
    margin: float
    more_is_better: bool


def number(scale: Scale, value: float, *, signed: bool = False) -> str:
    """A value in its unit."""
    # "-0.0" would be a sign without a meaning.
    rounded = round(value * scale.factor, scale.decimals) + 0.0
    return f"{rounded:{'+' if signed else ''},.{scale.decimals}f}".replace(",", NARROW_SPACE)


def favourable(scale: Scale, difference: Difference) -> Difference:
    """The difference so that a positive number speaks for the first of the two."""
    return difference if scale.more_is_better else difference.mirrored


def effect(scale: Scale, difference: Difference) -> str:
    """First less second, such as 4.0 points more, 95 % interval [+1.2, +6.8]."""
    word = "more" if difference.value >= 0.0 else "less" if scale.more_is_better else "fewer"
    size = f"{number(scale, abs(difference.value))} {scale.unit} {word}"
    return f"{size}, 95 % interval {_ends(scale, difference.low, difference.high)}"


def equivalence(scale: Scale, difference: Difference) -> str:
    """That the two are equivalent, with both intervals."""
    inner = f"90 % interval {_ends(scale, difference.equivalent_low, difference.equivalent_high)}"
    return f"The two are equivalent within {margin(scale)}: {effect(scale, difference)}, {inner}."


def untold(scale: Scale, difference: Difference, seeds: int) -> str:
    """Why nothing can be told."""
    return f"{effect(scale, difference)}: {seeds} seeds show neither a direction nor equivalence within {margin(scale)}."


def margin(scale: Scale) -> str:
    """The margin in its unit."""
    return f"{number(scale, scale.margin)} {scale.unit}"


def _ends(scale: Scale, low: float, high: float) -> str:
    return f"[{number(scale, low, signed=True)}, {number(scale, high, signed=True)}]"

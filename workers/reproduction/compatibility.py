"""Whether the effect that we measure can be the one that the paper reports, which trained one seed of each method."""

import math
from collections.abc import Sequence
from typing import Literal

import numpy as np

from sim.config import Frozen
from workers.reproduction.claims import Measure
from workers.reproduction.measures import SCALES, paper_value, values_of
from workers.reproduction.results import SeedResult
from workers.statistics.differences import Difference, welch_error
from workers.statistics.intervals import student_t
from workers.statistics.wording import number
from workers.training.table import TableRow


class Compatibility(Frozen):
    """The paper's effect beside ours.

    Attributes:
        word: compatible: inside our interval. One seed's luck: outside, but two single seeds of ours may differ as much. Not
            compatible: neither.
        sentence: with figures.
    """

    word: Literal["compatible", "one seed's luck", "not compatible"]
    sentence: str


def compatibility(
    measure: Measure,
    ours: Difference,
    seeds: tuple[Sequence[SeedResult], Sequence[SeedResult]],
    paper: tuple[TableRow, TableRow],
) -> Compatibility | None:
    """The paper's effect beside ours; None where the paper gives no number.

    The interval says where the mean over seeds lies. The paper has one seed of each method, and fewer attempts: what such a
    pair would show is the prediction interval, the spread of single seeds and of the paper's attempts on top.

    Args:
        measure: that is compared.
        ours: better less worse.
        seeds: better and worse, two or more each.
        paper: its rows of the two.
    """
    scale = SCALES[measure]
    figures = [paper_value(measure, row) for row in paper]
    if figures[0] is None or figures[1] is None:
        return None
    effect = figures[0] - figures[1]
    told = f"The paper's effect, {number(scale, effect, signed=True)} {scale.unit},"
    if ours.low <= effect <= ours.high:
        return Compatibility(word="compatible", sentence=f"{told} lies inside our interval: compatible.")
    reach = _reach_of_single_seeds(measure, seeds, paper)
    low, high = (number(scale, ours.value + end, signed=True) for end in (-reach, reach))
    if abs(effect - ours.value) <= reach:
        return Compatibility(
            word="one seed's luck",
            sentence=f"{told} lies outside our interval, but one seed of each, as the paper has, may show {low} to {high}.",
        )
    return Compatibility(
        word="not compatible",
        sentence=f"{told} lies outside our interval, and outside the {low} to {high} that one seed of each may show: "
        "not compatible.",
    )


def _reach_of_single_seeds(
    measure: Measure, seeds: tuple[Sequence[SeedResult], Sequence[SeedResult]], paper: tuple[TableRow, TableRow]
) -> float:
    """Half of the 95 % prediction interval of one seed of each, as long driven as the paper's."""
    values = [values_of(measure, side) for side in seeds]
    counts = [len(side) for side in seeds]
    spread = [np.asarray(np.var(side, ddof=1) * (1 + 1 / count)) for side, count in zip(values, counts, strict=True)]
    freedom, error = welch_error(spread, counts)
    between = float(student_t(freedom) * error)
    if measure != "success":
        return between
    rates = [float(np.mean(side)) for side in values]
    # Of the paper's rate and ours the one that leaves more to chance: at the ceiling either may leave nothing.
    chances = [
        max(rate * (1 - rate), row.success * (1 - row.success)) / row.episodes
        for rate, row in zip(rates, paper, strict=True)
    ]
    return math.hypot(between, float(student_t(np.inf)) * math.sqrt(sum(chances)))

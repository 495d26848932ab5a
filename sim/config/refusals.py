"""What configurations are refused for, as people are told it."""

from collections.abc import Mapping, Sequence
from typing import Any

Problem = Mapping[str, Any]
"""A mistake as pydantic tells it: `loc`, `msg`, `type`, `input`, `ctx`."""


def to_tell(problems: Sequence[Problem]) -> list[Problem]:
    """The problems without those that only follow from others.

    pydantic counts what is left of a list once its wrong items are out: `parts` with one wrong part would be told to be
    empty, too. What was too short as it was sent still is.
    """
    places = [tuple(problem["loc"]) for problem in problems]
    return [problem for problem in problems if not (_only_counted(problem) and _has_below(tuple(problem["loc"]), places))]


def _only_counted(problem: Problem) -> bool:
    if problem["type"] != "too_short":
        return False
    least: int = problem["ctx"]["min_length"]
    return len(problem["input"]) >= least


def _has_below(place: tuple[int | str, ...], places: Sequence[tuple[int | str, ...]]) -> bool:
    return any(len(each) > len(place) and each[: len(place)] == place for each in places)

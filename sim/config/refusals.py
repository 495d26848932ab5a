"""What configurations are refused for, as people are told it."""

from collections.abc import Mapping, Sequence
from typing import Any

Problem = Mapping[str, Any]
"""A mistake as pydantic tells it: `loc`, `msg`, `type`, `input`, `ctx`."""


def to_tell(problems: Sequence[Problem]) -> list[Problem]:
    """The problems in words for whoever wrote the configuration, without those that only follow from others.

    pydantic counts what is left of a list once its wrong items are out: `parts` with one wrong part would be told to be
    empty, too. What was too short as it was sent still is.
    """
    places = [tuple(problem["loc"]) for problem in problems]
    told = [problem for problem in problems if not (_only_counted(problem) and _has_below(tuple(problem["loc"]), places))]
    return [_in_words(problem) for problem in told]


def _in_words(problem: Problem) -> Problem:
    """The same, but for what is one of several kinds and does not say which: pydantic speaks of tags and discriminators."""
    if problem["type"] == "union_tag_not_found":
        return {**problem, "msg": f"{problem['ctx']['discriminator']} is missing, which says of which kind it is"}
    if problem["type"] == "union_tag_invalid":
        which, found, known = (problem["ctx"][name] for name in ("discriminator", "tag", "expected_tags"))
        return {**problem, "msg": f"{which} is {found!r}, and has to be one of {known}"}
    return problem


def _only_counted(problem: Problem) -> bool:
    if problem["type"] != "too_short":
        return False
    least: int = problem["ctx"]["min_length"]
    return len(problem["input"]) >= least


def _has_below(place: tuple[int | str, ...], places: Sequence[tuple[int | str, ...]]) -> bool:
    return any(len(each) > len(place) and each[: len(place)] == place for each in places)

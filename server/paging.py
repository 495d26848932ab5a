"""Which part of a list is asked for: one pair of parameters for every list that may grow without an end."""

from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Query

MAX_PAGE = 200
_USUAL_PAGE = 50


@dataclass(frozen=True, slots=True)
class Window:
    """`limit` items from the one at `offset` on, counted from 0."""

    limit: int
    offset: int


def _window(
    limit: Annotated[int, Query(ge=1, le=MAX_PAGE, description="Items at most.")] = _USUAL_PAGE,
    offset: Annotated[int, Query(ge=0, le=2**31, description="Items to leave out before them.")] = 0,
) -> Window:
    return Window(limit, offset)


WindowDep = Annotated[Window, Depends(_window)]

"""Which part of a list is asked for: one pair of parameters for every list.

Lists that may grow without an end come in pages (`WindowDep`). Lists that something else keeps short come whole unless a
part is asked for (`PartDep`). How many there are stands in the `total` of an answer, or, if it has none, in `X-Total-Count`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, TypeVar

from fastapi import Depends, Query, Response

MAX_PAGE = 200
MAX_PART = 2_000
"""Items of a short list at most: more than any of them may have, so that it comes whole."""

TOTAL_HEADER = "X-Total-Count"

_USUAL_PAGE = 50
_MAX_OFFSET = 2**31

_Item = TypeVar("_Item")
Offset = Annotated[int, Query(ge=0, le=_MAX_OFFSET, description="Items to leave out before them.")]


@dataclass(frozen=True, slots=True)
class Window:
    """`limit` items from the one at `offset` on, counted from 0."""

    limit: int
    offset: int


@dataclass(frozen=True, slots=True)
class Part(Window):
    """A part of a list whose answer says its length in a header."""

    response: Response

    def of(self, items: Sequence[_Item]) -> list[_Item]:
        """The part that is asked for of all `items`, and into the header how many they are."""
        self.counted(len(items))
        return list(items[self.offset : self.offset + self.limit])

    def counted(self, total: int) -> None:
        """Say how many there are, whoever has cut the part out."""
        self.response.headers[TOTAL_HEADER] = str(total)


async def _window(
    limit: Annotated[int, Query(ge=1, le=MAX_PAGE, description="Items at most.")] = _USUAL_PAGE, offset: Offset = 0
) -> Window:
    return Window(limit, offset)


async def _part(
    response: Response,
    limit: Annotated[int, Query(ge=1, le=MAX_PART, description="Items at most.")] = MAX_PART,
    offset: Offset = 0,
) -> Part:
    return Part(limit, offset, response)


WindowDep = Annotated[Window, Depends(_window)]
PartDep = Annotated[Part, Depends(_part)]

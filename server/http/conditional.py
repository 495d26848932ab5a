"""Answers that need not be sent again: a tag of what they are made of is known before anything of them is computed.

A browser or a program that has kept an answer asks with its tag (`If-None-Match`), and hears that it is still true (304).
"""

import hashlib
import re
import secrets
from typing import Annotated

from fastapi import Depends, Header, HTTPException, Response

from server.http.problems import Responses

NOT_MODIFIED: Responses = {304: {"description": "What the tag in `If-None-Match` names is still true"}}

# Another start may bring other code, which makes something else of the same.
_START = secrets.token_hex(8)
# To be kept by whom it was sent to, who asks each time: whoever has signed out sees nothing any more.
_CACHING = "private, no-cache"
_OPAQUE = re.compile(r'"([^"]*)"')


class Kept:
    """What the client has kept of an answer, by tags.

    Args:
        tags: the header `If-None-Match`.
        response: whose headers become those of an answer that FastAPI makes.
    """

    def __init__(self, tags: str | None, response: Response) -> None:
        self._tags = frozenset(_OPAQUE.findall(tags or ""))
        self._response = response

    def unless(self, *made_of: object) -> dict[str, str]:
        """Go on unless the client has what is made of the same; headers for an answer that brings its own.

        Sets count as the same in any order.

        Raises:
            HTTPException: 304, it has.
        """
        digest = hashlib.sha256(repr((_START, *map(_ordered, made_of))).encode()).hexdigest()[:32]
        # Weak: compressed and not, it is the same answer.
        return self._unless(digest, f'W/"{digest}"')

    def unless_file(self, sha256: str) -> dict[str, str]:
        """`unless`, of a file with that SHA-256, which becomes its tag.

        Raises:
            HTTPException: 304, it has.
        """
        return self._unless(sha256, f'"{sha256}"')

    def _unless(self, opaque: str, tag: str) -> dict[str, str]:
        headers = {"ETag": tag, "Cache-Control": _CACHING}
        if opaque in self._tags:
            raise HTTPException(304, headers=headers)
        self._response.headers.update(headers)
        return headers


def _ordered(made_of: object) -> object:
    return sorted(made_of) if isinstance(made_of, frozenset) else made_of


async def _kept(
    response: Response,
    tags: Annotated[
        str | None, Header(alias="If-None-Match", max_length=1_000, description="Tags of answers that one has.")
    ] = None,
) -> Kept:
    return Kept(tags, response)


KeptDep = Annotated[Kept, Depends(_kept)]

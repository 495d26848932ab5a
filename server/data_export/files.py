"""A file on its way out."""

from collections.abc import Iterator
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class OutgoingFile:
    """What somebody downloads.

    Attributes:
        name: that a browser gives it; ASCII.
        media_type: of its content.
        blocks: the content, made while it is sent.
    """

    name: str
    media_type: str
    blocks: Iterator[bytes]

"""Robots' recordings in JSON; what is in them is as the worker tells it (`workers.bags.results`)."""

from pydantic import Field

from server.schemas import Page, Schema

MAX_BAG_BYTES = 32 * 2**20
"""Of a recording's file."""


class Bag(Schema):
    """A robot's recording that was uploaded."""

    id: str
    name: str
    project_id: str
    sha256: str
    size: int = Field(description="Bytes of its file.")
    created_at: float


class BagPage(Page[Bag]):
    """Some of the recordings, the newest first."""

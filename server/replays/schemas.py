"""Replays in JSON."""

from pydantic import Field

from server.schemas import Schema
from workers.reporting import Outcome


class Replay(Schema):
    """An episode that was driven once more, ready to be played."""

    episode: int = Field(description="Its place in the suite, from 0.")
    suite: str
    outcome: Outcome
    steps: int
    seconds: float = Field(description="Of simulated time.")
    faithful: bool = Field(
        description="Whether it ended as recorded. Another processor than the one it was recorded on may round otherwise."
    )
    page: str = Field(description="Path of the player; append `light/` or `dark/`, and `?download` to take it away.")

"""A run's log in JSON."""

from typing import Literal

from pydantic import Field

from server.schemas import Schema
from workers.reporting import EventLevel


class LogLine(Schema):
    """A line of a run's log."""

    at: float
    kind: Literal["output", "event", "left out"] = Field(
        description="Printed by the trainer; of the event log; or in place of printed lines that were not kept."
    )
    attempt: int | None = Field(description="That printed it; null for an event.")
    step: int | None = Field(description="Environment step of an event; null for the others.")
    level: EventLevel
    text: str


class RunLog(Schema):
    """The end of a run's log."""

    lines: list[LogLine] = Field(description="The oldest first.")
    total: int = Field(description="Lines that there are, or that hold what was searched for.")

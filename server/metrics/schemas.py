"""Curves in JSON."""

from pydantic import Field

from server.schemas import Schema


class Series(Schema):
    """One metric over a run's environment steps; a null is a value that was not finite.

    A series with more points than asked for is cut into buckets of neighbours: `values` are their means, `min` and `max`
    their extremes, `steps` the last step of each. The newest point always stands alone.
    """

    name: str
    steps: list[int]
    values: list[float | None]
    min: list[float | None] | None = Field(description="Null where nothing was cut.")
    max: list[float | None] | None = Field(description="Null where nothing was cut.")


class Metrics(Schema):
    """The series of a run, by name."""

    series: list[Series]
    attempt: int = Field(description="Whose points they are: the next attempt drops what lies beyond its checkpoint.")
    since: int | None = Field(
        description="From which step on; null where the series are whole, whatever was asked for: what is known is old then."
    )

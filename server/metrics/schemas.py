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


class Thinned(Schema):
    """What was done to the curves of a run that ended long ago: neighbouring points were put together.

    What is left of each bucket of neighbours is its smallest value, its mean and its largest. Evaluations stay, and so do a
    curve's newest point and whatever a run that is resumed adds.
    """

    since: float = Field(description="When it was done last.")
    points: int = Field(description="That there were of the metrics that had too many, all together.")
    kept: int = Field(description="Buckets in their place.")


class Metrics(Schema):
    """The series of a run, by name."""

    series: list[Series]
    attempt: int = Field(description="Whose points they are: the next attempt drops what lies beyond its checkpoint.")
    thinned: Thinned | None = Field(None, description="Null where every point is kept.")
    since: int | None = Field(
        description="From which step on; null where the series are whole, whatever was asked for: what is known is old then."
    )

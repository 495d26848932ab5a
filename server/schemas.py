"""What several domains say in JSON: the base of every message, and a number with its uncertainty."""

from typing import Annotated, Generic, TypeVar

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from workers.statistics.seeds import FailedSeeds, Unit

Line = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, pattern=r"^[^\x00-\x1f\x7f]*$")]
"""Text of one line that a person types and the database keeps: PostgreSQL holds no NUL."""


Item = TypeVar("Item")


class Schema(BaseModel):
    """Base of the API's messages: immutable, unknown keys refused, complete when read."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", allow_inf_nan=False, json_schema_serialization_defaults_required=True
    )


class Page(Schema, Generic[Item]):
    """Some of a list's items, in its order; `server.http.paging` says which."""

    items: list[Item]
    total: int = Field(description="How many there are on all pages.")


LACKING = "Extensions for want of which settings can't be read here."
UNREADABLE = "Settings that another version stored and this one can't read, dotted: the defaults are shown in their place."


class Estimate(Schema):
    """A measured number, its 95 % interval, and what stands behind it."""

    value: float
    low: float = Field(description="Lower end of the 95 % interval.")
    high: float = Field(description="Upper end of the 95 % interval.")
    unit: Unit = Field(description="What the interval is over: all seeds that one could train, or one policy's episodes.")
    seeds: int = Field(ge=1, description="Runs that it is measured over.")
    episodes: int = Field(ge=1, description="Episodes of all those runs together.")
    per_seed: list[float] = Field(description="The value of each of those runs.")
    failed: FailedSeeds | None = Field(description="What so few seeds leave open; null unless it is a success rate.")


class SeedMean(Schema):
    """A number over runs, in short."""

    value: float = Field(description="Mean over the runs.")
    low: float | None = Field(description="Lower end of the mean's 95 % interval over seeds; null for one run.")
    high: float | None = Field(description="Upper end; null for one run.")
    runs: int = Field(ge=1, description="Behind it.")

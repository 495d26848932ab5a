"""How fine curves stay. Its own imports are light: the settings have a rule."""

from pydantic import BaseModel, ConfigDict, Field


class CurveRule(BaseModel):
    """How fine the curves of a run stay once it has ended; as they are, where `points` is null."""

    model_config = ConfigDict(frozen=True, extra="forbid", json_schema_serialization_defaults_required=True)

    points: int | None = Field(
        None,
        ge=100,
        le=2_000,
        description="So many of each metric at most, each with the smallest, mean and largest value of those that it stands "
        "for; null for all, and then nothing is thinned.",
    )
    after_days: float = Field(30.0, ge=0.0, le=3_650.0, description="Days after the run's end from which on this holds.")


CURVES_STAY = CurveRule()

"""What every configuration model is built on (pydantic only)."""

from pydantic import BaseModel, ConfigDict
from pydantic.config import JsonDict

ADVANCED: JsonDict = {"x-advanced": True}
"""Moves a field of the launch form under *Advanced*."""

HIDDEN: JsonDict = {"x-hidden": True}
"""Keeps a field out of the launch form: a program fills it in."""


def needs(field: str) -> JsonDict:
    """Leaves a field out of the launch form while the number beside it called `field` is 0: it would change nothing."""
    return {"x-needs": field}


class Frozen(BaseModel):
    """Base of every configuration model: immutable, and an unknown key is an error rather than ignored."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        validate_default=True,
        allow_inf_nan=False,
        # What is read back is always complete, and the generated types say so.
        json_schema_serialization_defaults_required=True,
    )

"""Suites of one's own in JSON."""

from typing import Annotated

from pydantic import Field

from server.schemas import Line, Schema

MAX_SUITES = 200
"""Of an installation; more than anybody finds again."""

Sha256 = Annotated[str, Field(pattern="^[0-9a-f]{64}$", description="Of an arena of the gallery.")]


class OwnSuiteName(Schema):
    """What a suite is to be called."""

    name: Annotated[Line, Field(max_length=40)]


class OwnScenario(Schema):
    """An arena of the gallery: its start and its target."""

    sha256: Sha256
    name: str


class NewScenario(Schema):
    """An arena of the gallery that a suite is to have."""

    sha256: Sha256


class OwnSuite(Schema):
    """A list of scenarios; what is measured on it stays with the scenarios that it had then."""

    id: str
    name: str
    created_at: float
    scenarios: list[OwnScenario]

"""Families by policies in JSON."""

from pydantic import Field

from server.schemas import Estimate, Schema


class FieldCell(Schema):
    """One driver in one family."""

    success: Estimate
    collision: float = Field(description="Share of the episodes that ended in one.")
    worst_tenth_spl: float = Field(
        description="Success weighted by path length over the tenth of the episodes that did worst; a mean over seeds."
    )
    evaluation: str | None = Field(description="Of which asked evaluation, that of the first seed; null for what ships.")
    suite_hash: str | None = Field(None, description="Of the suite of what was asked for; null for what ships.")


class FieldDriver(Schema):
    """A policy or a baseline in every family."""

    title: str
    policy: str | None = Field(description="Name of the shipped policy; null for others.")
    trained: bool = Field(description="Whether it was; baselines are not.")
    cells: list[FieldCell | None] = Field(description="In the order of the families; null where it was not measured.")


class FieldSight(Schema):
    """Drivers that see equally much."""

    rays: int
    field_of_view: float = Field(description="Degrees.")
    drivers: list[FieldDriver] = Field(description="Policies first, then baselines; of each the best first.")


class FieldMatrix(Schema):
    """Success in families at difficulty 1."""

    families: list[str] = Field(description="The hardest for the best shipped policy first.")
    sights: list[FieldSight] = Field(description="What was measured with the project, the narrowest sight first.")
    asked: list[FieldDriver] = Field(
        description="What was asked for here at difficulty 1: 20 maps, 200 scenarios, attempts as long as the policy's own. "
        "A training's seeds are one driver. First what was measured in most families, of these the best."
    )
    command: str = Field(description="What measured that which ships.")
    date: str = Field(description="When, ISO 8601.")

"""What moves in an arena besides the robots, as a configuration says it (pydantic only)."""

from typing import Annotated, Literal

from pydantic import Field

from sim.config.base import ADVANCED, Frozen, needs

MoverKind = Literal["patrol", "walker", "pedestrian"]

MAX_MOVERS = 16
"""Movers of one arena."""

MAX_MOVER_SPEED = 1.5
"""Metres per second: a brisk walk."""

MoverSpeed = Annotated[float, Field(ge=0.05, le=MAX_MOVER_SPEED, allow_inf_nan=False)]
MoverRadius = Annotated[float, Field(ge=0.1, le=0.5, allow_inf_nan=False)]


class MoversConfig(Frozen):
    """Movers that are put into every arena of a task."""

    count: int = Field(0, ge=0, le=MAX_MOVERS, title="Moving obstacles", description="In each arena.")
    kind: MoverKind = Field(
        "pedestrian",
        title="Movement",
        description="Pedestrians walk between places and avoid one another; walkers go straight on until something is in "
        "the way; patrols go to and fro on a line.",
        json_schema_extra=needs("count"),
    )
    speed: MoverSpeed = Field(
        1.0,
        title="Speed",
        description="Top speed, metres per second.",
        json_schema_extra=ADVANCED | needs("count"),
    )
    sees_robots: bool = Field(
        False,
        title="See robots",
        description="They give way to robots as to one another, and walk into none that stands; else they walk as if there "
        "were no robot.",
        json_schema_extra=needs("count"),
    )
    radius: MoverRadius = Field(
        0.25, title="Radius", description="Metres.", json_schema_extra=ADVANCED | needs("count")
    )  # fmt: skip

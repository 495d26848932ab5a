"""Playgrounds in JSON."""

from typing import Annotated, Literal

from pydantic import Field

from server.schemas import Line, Schema
from sim.config import AnyArenaConfig, ArenaFile, ImportedArenaConfig
from sim.config.arena_file import Coordinate, Degrees
from workers.job_protocol import PlayedPolicy
from workers.play_protocol import PlaySettings, Push, PutMover, PutRobot, PutTarget, Steps
from workers.reporting import Outcome

Thing = Literal["robot", "target", "mover", "circle", "box"]
"""What there is in a playground."""

Size = Annotated[float, Field(ge=0.05, le=20.0)]
"""Of an obstacle, metres."""


class PlaygroundRequest(Schema):
    """A policy, and where it is to drive."""

    policy: PlayedPolicy
    arena: AnyArenaConfig | None = Field(None, description="Of a family the first map; null for the policy's own.")


class PutCircle(Schema):
    """A round obstacle stands here now."""

    act: Literal["put circle"] = "put circle"
    index: int | None = Field(None, ge=0, description="Among the round ones; null for a new one.")
    x: Coordinate
    y: Coordinate
    radius: Size = 0.3


class PutBox(Schema):
    """A rectangular obstacle stands here now."""

    act: Literal["put box"] = "put box"
    index: int | None = Field(None, ge=0, description="Among the rectangular ones; null for a new one.")
    x: Coordinate
    y: Coordinate
    length: Size = 1.0
    width: Size = 0.4
    angle: Degrees = 0.0


class Remove(Schema):
    """An obstacle is gone; those after it move up."""

    act: Literal["remove"] = "remove"
    thing: Literal["circle", "box"]
    index: int = Field(ge=0)


class Choose(Schema):
    """What has handles in the 3D view; nothing where `thing` is null."""

    act: Literal["choose"] = "choose"
    thing: Thing | None = None
    index: int = Field(0, ge=0, description="Among those of its kind.")


AnyChange = Annotated[
    PutRobot | PutTarget | PutMover | Push | Steps | PutCircle | PutBox | Remove | Choose, Field(discriminator="act")
]


class PlaygroundSettings(PlaySettings):
    """How it drives, what it perceives and what is shown.

    Attributes:
        rays: whether LiDAR rays are drawn.
        follow: whether the camera stays with the robot.
    """

    rays: bool = True
    follow: bool = False


class Standing(Schema):
    """Where something is now; heading in degrees."""

    x: float
    y: float
    heading: float = 0.0
    radius: float = 0.0


class Moment(Schema):
    """What there is to say of a moment of a playground: of the one that the picture shows, while there is a picture."""

    sim_time: float = Field(description="Simulated seconds since it began.")
    robot: Standing | None = Field(description="Null until it drives.")
    target: Standing | None
    movers: list[Standing] = Field(description="Those that found room.")
    reward: float = Field(description="Since the last target.")
    arrivals: int
    collisions: int
    timeouts: int
    value: float | None = Field(description="Discounted sum of the rewards that it is about to collect, driven ahead.")
    outcome: Outcome | None = Field(description="How its attempt is about to end; null where that takes longer.")
    seconds: float | None = Field(description="Until then, simulated.")
    outdated: bool = Field(
        description="Whether value, outcome and seconds are of before the last change, or of an attempt that has ended; new "
        "ones follow within a second."
    )


class Playground(Moment):
    """One of a person's playgrounds, as it is at the moment."""

    id: str
    policy: str = Field(description="For people.")
    geometry: ArenaFile = Field(description="What stands in it now, and what moves.")
    settings: PlaygroundSettings
    chosen: Choose
    driving: bool = Field(description="Whether a worker drives; it does while somebody watches.")
    problem: str | None = Field(description="What could not be done.")


class KeptArenaName(Schema):
    """What an arena is to be called."""

    name: Annotated[Line, Field(max_length=80)]


class KeptArena(Schema):
    """An arena that is in the gallery now."""

    config: ImportedArenaConfig = Field(description="What a task's `arena` must be to train on it.")

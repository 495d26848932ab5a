"""What a playground's worker is told and tells: one robot in an arena that people change while it drives (pydantic only).

The server keeps the arena and the settings, checks every change, and sends all of it whenever its revision is newer than
the one that the worker has; what happens once (a robot put elsewhere, a push) has a number, and is done once.
"""

from typing import Annotated, Literal

from pydantic import Field

from sim.config import ArenaFile, Frozen
from sim.config.arena_file import Coordinate, Degrees
from sim.config.sensing import MAX_DELAY
from workers.reporting import Figure, Outcome

MAX_OBSTACLES = 300
"""Circles and boxes of a playground's arena together: each is a thing of its own in the picture."""
MAX_VALUES = 256
"""That are told ahead: of more steps than are driven between two looks, however fast time goes."""
MAX_WAY_POINTS = 64
"""Of the way that the robot is about to take."""
MAX_ARROWS = 400
"""Of the field of what it would do elsewhere."""
MAX_ACTS = 32
"""That are kept for a worker to hear of."""
MAX_PUSH = 1.0
"""Metres of one push."""

Place = tuple[Figure, Figure]
"""x and y, metres."""


class PutRobot(Frozen):
    """The robot stands somewhere else, at rest; its attempt begins anew."""

    act: Literal["put robot"] = "put robot"
    x: Coordinate
    y: Coordinate
    heading: Degrees


class PutTarget(Frozen):
    """The robot is to go somewhere else; its attempt begins anew."""

    act: Literal["put target"] = "put target"
    x: Coordinate
    y: Coordinate


class PutMover(Frozen):
    """Somebody who moves stands somewhere else, and goes on from there."""

    act: Literal["put mover"] = "put mover"
    index: int = Field(ge=0, lt=255, description="Among those that are there.")
    x: Coordinate
    y: Coordinate


class Push(Frozen):
    """The robot is shoved aside, as far as there is room."""

    act: Literal["push"] = "push"
    direction: Degrees = Field(90.0, description="Against its heading, to the left.")
    distance: float = Field(0.3, gt=0.0, le=MAX_PUSH, description="Metres.")


class Steps(Frozen):
    """While it is paused: the next control steps."""

    act: Literal["step"] = "step"
    count: int = Field(1, ge=1, le=50)


AnyAct = Annotated[PutRobot | PutTarget | PutMover | Push | Steps, Field(discriminator="act")]
PLACING = (PutRobot, PutTarget, PutMover)
"""Acts that say where something is: a worker that comes new to a playground does these, and no others, once more."""


class NumberedAct(Frozen):
    """An act, and its place among all that there were, from 1."""

    number: int = Field(ge=1)
    act: AnyAct


class PlaySettings(Frozen):
    """How it drives and what it perceives, beside what its task says.

    Attributes:
        paused: whether time stands still.
        speed: simulated seconds per wall second.
        noise: standard deviation of each range, metres.
        dropout: probability that a ray sees nothing.
        delay: control steps between an action and the robot following it.
        blind_width: degrees of the sector in which it sees nothing: what it is told of there is its LiDAR's full range.
        blind_direction: of the sector's middle against the heading, degrees to the left.
        field: whether to show what it would do elsewhere.
    """

    paused: bool = False
    speed: float = Field(1.0, ge=0.1, le=5.0)
    noise: float = Field(0.0, ge=0.0, le=0.5)
    dropout: float = Field(0.0, ge=0.0, le=0.9)
    delay: int = Field(0, ge=0, le=MAX_DELAY)
    blind_width: float = Field(0.0, ge=0.0, le=360.0)
    blind_direction: float = Field(0.0, ge=-180.0, le=180.0)
    field: bool = False


class PlayOrders(Frozen):
    """All that a playground's worker has to know.

    Attributes:
        revision: grows with every change.
        arena: what stands in it now, and what moves.
        settings: see there.
        acts: the last ones, in order.
    """

    revision: int = Field(ge=0)
    arena: ArenaFile
    settings: PlaySettings
    acts: tuple[NumberedAct, ...] = Field((), max_length=MAX_ACTS)


class PlaySeen(Frozen):
    """What a playground's worker makes of the moment, about once a second and soon after a change.

    Attributes:
        revision: of the orders that it knew.
        sim_time: of the moment that it is of, as in the frames: simulated seconds since the view started.
        value: discounted sum of the rewards that it is about to collect, until its attempt ends or the time looked ahead.
        values: the same at that moment and after each of the control steps that follow, as far as they are told.
        outcome: how that attempt ends; None where it goes on for longer.
        seconds: until then, simulated.
        way: where it goes meanwhile.
        arrows: what it would do elsewhere, facing the target: x, y of a place, and of where it would go from there.
        problem: what could not be done, for people; None where all could.
    """

    revision: int = Field(0, ge=0)
    sim_time: Figure = 0.0
    value: Figure
    values: tuple[Figure, ...] = Field((), max_length=MAX_VALUES)
    outcome: Outcome | None
    seconds: Figure
    way: tuple[Place, ...] = Field((), max_length=MAX_WAY_POINTS)
    arrows: tuple[tuple[Figure, Figure, Figure, Figure], ...] = Field((), max_length=MAX_ARROWS)
    problem: str | None = Field(None, max_length=500)

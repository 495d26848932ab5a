"""Our own arena format, version 1: what a person writes in YAML and what imported maps become (pydantic only).

The JSON schema of `ArenaFile` is `docs/arena.schema.json`; `docs/arenas.md` explains it with an example.
"""

import hashlib
import math
from itertools import pairwise
from typing import Annotated, Literal, Self

from pydantic import ConfigDict, Field, model_validator

from sim.config.base import Frozen
from sim.config.movers import MAX_MOVERS, MoverRadius, MoverSpeed

MAX_OBSTACLES = 2000
"""Circles and boxes of one arena: what a LiDAR step still copes with, and 100 kB in a checkpoint."""

MAX_SIDE = 100.0
"""Longest side of an imported arena, metres."""

MAX_KEYFRAMES = 512
"""Keyframes of one timed mover."""

MAX_TIME = 3600.0
"""Seconds that a timed mover's way may take."""

MAX_TIMED_SPEED = 5.0
"""Metres per second of a timed mover: a fast runner."""

MAX_WAYPOINTS = 32
"""Waypoints of one patrol."""

MIN_SIDE = 0.5
"""Shortest side of an imported arena, metres."""

MIN_EXTENT = 1e-6
"""Smallest size of an obstacle, metres: half of it is still more than nothing."""

Coordinate = Annotated[float, Field(ge=-MAX_SIDE, le=MAX_SIDE, allow_inf_nan=False)]
Extent = Annotated[float, Field(ge=MIN_EXTENT, le=MAX_SIDE, allow_inf_nan=False)]
Degrees = Annotated[float, Field(ge=-360.0, le=360.0, allow_inf_nan=False)]


class _Part(Frozen):
    # A number is a number here: "1" in quotes or `yes` is a mistake that the writer should hear of.
    model_config = ConfigDict(strict=True)


class Circle(_Part):
    """A round obstacle."""

    x: Coordinate
    y: Coordinate
    radius: Extent


class Box(_Part):
    """A rectangular obstacle; `angle` is that of its length against the x axis, degrees, anticlockwise."""

    x: Coordinate
    y: Coordinate
    length: Extent = Field(description="Along the box's own x axis, metres.")
    width: Extent = Field(description="Along the box's own y axis, metres.")
    angle: Degrees = 0.0


class Start(_Part):
    """Where a robot starts; heading in degrees against the x axis, anticlockwise."""

    x: Coordinate
    y: Coordinate
    heading: Degrees = 0.0


class Target(_Part):
    """Where it should go."""

    x: Coordinate
    y: Coordinate


def _default(value: object) -> bool:
    """Left out of files: arenas keep the hash that they had before a mover could be told."""
    return not value


class _MoverPart(_Part):
    sees_robots: bool = Field(
        False, exclude_if=_default, description="Whether it gives way to robots; else it goes as if there were none."
    )
    radius: MoverRadius = Field(0.25, description="Metres.")
    speed: MoverSpeed = Field(1.0, description="Top speed, metres per second.")


class Waypoint(_Part):
    """A corner of a patrol's way."""

    x: Coordinate
    y: Coordinate


class Patrol(_MoverPart):
    """Goes round its waypoints in straight lines, from the last one back to the first; it starts anywhere on its way."""

    kind: Literal["patrol"]
    waypoints: tuple[Waypoint, ...] = Field(
        (),
        max_length=MAX_WAYPOINTS,
        strict=False,
        description="Two or more; without any it goes to and fro on a line that is drawn when it starts.",
    )

    @model_validator(mode="after")
    def _goes_somewhere(self) -> Self:
        if len(self.waypoints) == 1:
            raise ValueError("a patrol needs two waypoints or more, or none")
        return self


class Walker(_MoverPart):
    """Goes straight on until something is in the way, then in another direction."""

    kind: Literal["walker"]


class Pedestrian(_MoverPart):
    """Walks from place to place, or along its route, and avoids the others."""

    kind: Literal["pedestrian"]
    waypoints: tuple[Waypoint, ...] = Field(
        (),
        max_length=MAX_WAYPOINTS,
        strict=False,
        exclude_if=_default,
        description="Its route from its start on; one alone is where it stands. Without any it goes where it likes.",
    )
    stays: bool = Field(
        False, exclude_if=_default, description="Whether it stays at the end of its route; it begins anew otherwise."
    )


class Keyframe(_Part):
    """Where a timed mover is at a time."""

    t: float = Field(ge=0.0, le=MAX_TIME, allow_inf_nan=False, description="Seconds after the start.")
    x: Coordinate
    y: Coordinate


class Timed(_Part):
    """Goes as its keyframes say, straight and evenly from each to the next, whatever is in its way."""

    kind: Literal["timed"]
    radius: MoverRadius = Field(0.25, description="Metres.")
    keyframes: tuple[Keyframe, ...] = Field(
        min_length=2, max_length=MAX_KEYFRAMES, strict=False, description="In order of time; the first at 0 s."
    )
    loops: bool = Field(True, description="Whether it begins anew after the last one; it stays there otherwise.")

    @model_validator(mode="after")
    def _goes_through_time(self) -> Self:
        if self.keyframes[0].t != 0.0:
            raise ValueError(f"the first keyframe is at {self.keyframes[0].t:g} s: it must be at 0")
        for one, other in pairwise(self.keyframes):
            if other.t <= one.t:
                raise ValueError(f"the keyframe at {other.t:g} s follows the one at {one.t:g} s: put them in order of time")
            speed = math.hypot(other.x - one.x, other.y - one.y) / (other.t - one.t)
            if speed > MAX_TIMED_SPEED:
                raise ValueError(f"{speed:.1f} m/s after {one.t:g} s: at most {MAX_TIMED_SPEED:g} are simulated")
        return self


AnyMover = Annotated[Patrol | Walker | Pedestrian | Timed, Field(discriminator="kind")]


class ArenaFile(_Part):
    """A walled rectangle with obstacles. Metres; the origin is the middle, x to the right, y up."""

    model_config = ConfigDict(title="Mapless arena")

    format: Literal["mapless-arena/1"] = Field("mapless-arena/1", description="This format and its version.")
    name: str = Field(min_length=1, max_length=80, description="What people call it.")
    width: float = Field(ge=MIN_SIDE, le=MAX_SIDE, allow_inf_nan=False, description="Between the walls along x, metres.")
    height: float = Field(ge=MIN_SIDE, le=MAX_SIDE, allow_inf_nan=False, description="Between the walls along y, metres.")
    circles: tuple[Circle, ...] = Field((), max_length=MAX_OBSTACLES, strict=False)
    boxes: tuple[Box, ...] = Field((), max_length=MAX_OBSTACLES, strict=False)
    movers: tuple[AnyMover, ...] = Field((), max_length=MAX_MOVERS, strict=False, description="What moves in it.")
    start: Start | None = Field(None, description="Where a scenario starts, if the arena comes with one.")
    target: Target | None = Field(None, description="Where that scenario leads.")

    @model_validator(mode="after")
    def _in_bounds(self) -> Self:
        count = len(self.circles) + len(self.boxes)
        if count > MAX_OBSTACLES:
            raise ValueError(f"{count} obstacles are too many: at most {MAX_OBSTACLES} circles and boxes together")
        for name, point in (("start", self.start), ("target", self.target)):
            if point is not None and (abs(point.x) > 0.5 * self.width or abs(point.y) > 0.5 * self.height):
                raise ValueError(f"the {name} ({point.x:g}, {point.y:g}) lies outside the walls")
        return self

    @property
    def sha256(self) -> str:
        """Hash of everything but the name, 64 hexadecimal digits: two files with the same hash are the same place."""
        # An arena in which nothing moves keeps the hash that it had before anything could.
        left_out = {"name"} if self.movers else {"name", "movers"}
        return hashlib.sha256(self.model_dump_json(exclude=left_out).encode()).hexdigest()

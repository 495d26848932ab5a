"""What a robot perceives, and how badly: LiDAR, odometry, and what is drawn anew for every episode (pydantic only)."""

import math
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from sim.config.base import ADVANCED, Frozen

MAX_DELAY = 5
"""Longest delay of a command, control steps."""


def _place(title: str, default: float = 0.0) -> Any:
    return Field(
        default,
        ge=-2.0,
        le=2.0,
        title=title,
        description="Metres from the body's middle, within the body.",
        json_schema_extra=ADVANCED,
    )


def _yaw(title: str, default: float = 0.0) -> Any:
    return Field(
        default,
        ge=-180.0,
        le=180.0,
        title=title,
        description="Degrees that its field of view is turned to the left.",
        json_schema_extra=ADVANCED,
    )


class CentredMount(Frozen):
    """One LiDAR in the body's middle, looking ahead."""

    name: Literal["centre"] = Field("centre", title="Middle")

    @property
    def places(self) -> tuple[tuple[float, float, float], ...]:
        """Of each LiDAR, in the order of the scan: x ahead and y to the left of the middle, metres; yaw, radians."""
        return ((0.0, 0.0, 0.0),)


class SingleMount(Frozen):
    """One LiDAR anywhere on the body."""

    name: Literal["single"] = Field("single", title="Elsewhere")
    x: float = _place("Ahead", 0.05)
    y: float = _place("To the left")
    yaw: float = _yaw("Turned by")

    @property
    def places(self) -> tuple[tuple[float, float, float], ...]:
        """See `CentredMount.places`."""
        return ((self.x, self.y, math.radians(self.yaw)),)


class DoubleMount(Frozen):
    """Two LiDARs of one kind; the scan is the first one's rays, then the second one's."""

    name: Literal["double"] = Field("double", title="Two")
    x: float = _place("First, ahead", 0.05)
    y: float = _place("First, to the left")
    yaw: float = _yaw("First, turned by")
    second_x: float = _place("Second, ahead", -0.05)
    second_y: float = _place("Second, to the left")
    second_yaw: float = _yaw("Second, turned by", 180.0)

    @property
    def places(self) -> tuple[tuple[float, float, float], ...]:
        """See `CentredMount.places`."""
        return (
            (self.x, self.y, math.radians(self.yaw)),
            (self.second_x, self.second_y, math.radians(self.second_yaw)),
        )


AnyMount = Annotated[CentredMount | SingleMount | DoubleMount, Field(discriminator="name")]


class LidarConfig(Frozen):
    """A planar scanner, or two alike, where they are mounted."""

    rays: int = Field(30, ge=3, le=360, title="Rays", description="Rays per scan.", json_schema_extra=ADVANCED)
    field_of_view: float = Field(
        180.0,
        gt=0.0,
        le=360.0,
        title="Field of view",
        description="Degrees, symmetric about where it looks.",
        json_schema_extra=ADVANCED,
    )
    range: float = Field(3.5, gt=0.2, le=30.0, title="Range", description="Metres.", json_schema_extra=ADVANCED)
    rate: float = Field(
        0.0,
        ge=0.0,
        le=100.0,
        title="Rate",
        description="Scans per second; in between the policy sees the last one. 0: a new scan for every action.",
        json_schema_extra=ADVANCED,
    )
    noise: float = Field(
        0.0,
        ge=0.0,
        le=0.5,
        title="Noise",
        description="Standard deviation of each range that hits something, metres.",
        json_schema_extra=ADVANCED,
    )
    dropout: float = Field(
        0.0,
        ge=0.0,
        le=0.9,
        title="Dropout",
        description="Probability that a ray sees nothing and reads the full range.",
        json_schema_extra=ADVANCED,
    )

    mount: AnyMount = Field(
        default_factory=CentredMount,
        title="Mount",
        description="Where it stands on the body, above what would hide anything from it.",
        json_schema_extra=ADVANCED,
    )

    @property
    def scan_size(self) -> int:
        """Rays of a whole scan: of both LiDARs where there are two."""
        return self.rays * len(self.mount.places)


class OdometryConfig(Frozen):
    """How the pose that the observation is made from drifts away from the true one, from zero at every new target.

    A random walk, so that the length of a step makes no difference: the variance grows with the way (Thrun, Burgard and
    Fox 2005, section 5.4).
    """

    distance_noise: float = Field(
        0.0,
        ge=0.0,
        le=0.5,
        title="Drift in distance",
        description="Standard deviation of the position, metres, after one metre driven.",
        json_schema_extra=ADVANCED,
    )
    heading_noise: float = Field(
        0.0,
        ge=0.0,
        le=0.5,
        title="Drift in heading",
        description="Standard deviation of the heading, radians, after one radian turned.",
        json_schema_extra=ADVANCED,
    )


def _span(title: str, what: str) -> Any:
    return Field(
        (),
        max_length=2,
        title=title,
        description=f"{what}: lowest and highest; empty keeps the value above.",
        json_schema_extra=ADVANCED,
    )


class RandomisationConfig(Frozen):
    """What every robot draws uniformly at the start of each episode: two numbers, or none for what stays as it is.

    Rays decide how many numbers an observation has, so they cannot be drawn.
    """

    range: tuple[Annotated[float, Field(gt=0.2, le=30.0)], ...] = _span(
        "LiDAR range", "Metres beyond which nothing is seen, at most the LiDAR's range"
    )
    field_of_view: tuple[Annotated[float, Field(gt=0.0, le=360.0)], ...] = _span(
        "LiDAR field of view", "Degrees that the rays truly cover, while the policy takes them for those of the LiDAR"
    )
    rate: tuple[Annotated[float, Field(gt=0.0, le=100.0)], ...] = _span("LiDAR rate", "Scans per second")
    noise: tuple[Annotated[float, Field(ge=0.0, le=0.5)], ...] = _span("LiDAR noise", "Metres")
    dropout: tuple[Annotated[float, Field(ge=0.0, le=0.9)], ...] = _span("LiDAR dropout", "Probability")
    distance_noise: tuple[Annotated[float, Field(ge=0.0, le=0.5)], ...] = _span(
        "Drift in distance", "Metres after one metre"
    )
    heading_noise: tuple[Annotated[float, Field(ge=0.0, le=0.5)], ...] = _span("Drift in heading", "Radians after one")
    command_delay: tuple[Annotated[int, Field(ge=0, le=MAX_DELAY)], ...] = _span("Command delay", "Control steps")
    max_linear_speed: tuple[Annotated[float, Field(gt=0.0, le=3.0)], ...] = _span(
        "Top speed", "Metres per second that a full command reaches"
    )
    max_angular_speed: tuple[Annotated[float, Field(gt=0.0, le=6.0)], ...] = _span(
        "Top turning rate", "Radians per second that a full command reaches"
    )

    @model_validator(mode="after")
    def _spans_are_two_numbers_in_order(self) -> Self:
        for name in type(self).model_fields:
            span = getattr(self, name)
            if len(span) == 1 or list(span) != sorted(span):
                raise ValueError(f"{name} needs two numbers, the lower one first, or none")
        return self

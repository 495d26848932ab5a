"""What a robot perceives, and how badly: LiDAR, odometry, and what is drawn anew for every episode (pydantic only)."""

from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from sim.config.base import ADVANCED, Frozen

MAX_DELAY = 5
"""Longest delay of a command, control steps."""


class LidarConfig(Frozen):
    """A planar scanner that looks ahead; the observation holds the minimum of each batch of neighbouring rays."""

    rays: int = Field(30, ge=3, le=360, title="Rays", description="Rays per scan.", json_schema_extra=ADVANCED)
    batches: int = Field(
        10,
        ge=1,
        le=120,
        title="Batches",
        description="Numbers of the scan that the policy sees; must divide the rays.",
        json_schema_extra=ADVANCED,
    )
    field_of_view: float = Field(
        180.0,
        gt=0.0,
        le=360.0,
        title="Field of view",
        description="Degrees, symmetric about the heading.",
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

    @model_validator(mode="after")
    def _batches_divide_rays(self) -> Self:
        if self.rays % self.batches:
            raise ValueError(f"batches must divide rays, and {self.batches} does not divide {self.rays}")
        return self


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

    Rays and batches decide how many numbers an observation has, so they cannot be drawn.
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

"""The robots that can be driven: their bodies and limits, and where these come from (pydantic only).

Sources are public repositories of the makers on GitHub, as `owner/repository: file`.
"""

import math
from typing import Annotated, Any, Literal

from pydantic import Field

from sim.config.base import ADVANCED, Frozen


def _top_speed(default: float) -> Any:
    return Field(
        default,
        gt=0.0,
        le=3.0,
        title="Top speed",
        description="Metres per second; the robot does not reverse.",
        json_schema_extra=ADVANCED,
    )


def _top_turning_rate(default: float) -> Any:
    return Field(
        default,
        gt=0.0,
        le=6.0,
        title="Top turning rate",
        description="Radians per second, both ways.",
        json_schema_extra=ADVANCED,
    )


def _radius(default: float) -> Any:
    return Field(
        default, gt=0.02, le=1.0, title="Radius", description="Of the body, metres.", json_schema_extra=ADVANCED
    )  # fmt: skip


def _length(default: float) -> Any:
    return Field(
        default,
        gt=0.04,
        le=2.0,
        title="Length",
        description="Of the body, metres; it turns about its middle.",
        json_schema_extra=ADVANCED,
    )


def _width(default: float) -> Any:
    return Field(default, gt=0.04, le=2.0, title="Width", description="Of the body, metres.", json_schema_extra=ADVANCED)


class _Drive(Frozen):
    """Limits of a differential drive."""

    max_linear_speed: float = _top_speed(0.25)
    max_angular_speed: float = _top_turning_rate(1.0)
    max_linear_acceleration: float = Field(
        0.0,
        ge=0.0,
        le=100.0,
        title="Linear acceleration",
        description="Metres per second squared, also when braking; 0 is unlimited.",
        json_schema_extra=ADVANCED,
    )
    max_angular_acceleration: float = Field(
        0.0,
        ge=0.0,
        le=100.0,
        title="Angular acceleration",
        description="Radians per second squared, both ways; 0 is unlimited.",
        json_schema_extra=ADVANCED,
    )


class DiscRobot(_Drive):
    """A round body."""

    radius: float = _radius(0.105)

    @property
    def half_extents(self) -> None:
        """Half length and half width of a rectangular body, metres: this one is none."""
        return None

    @property
    def inscribed_radius(self) -> float:
        """Radius of the largest disc within the body, metres."""
        return self.radius

    @property
    def circumscribed_radius(self) -> float:
        """Radius of the smallest disc around the body, metres: what it needs to turn anywhere."""
        return self.radius


class RectangularRobot(_Drive):
    """A rectangular body that turns about its middle."""

    length: float = _length(0.5)
    width: float = _width(0.4)

    @property
    def half_extents(self) -> tuple[float, float]:
        """Half length and half width of the body, metres."""
        return 0.5 * self.length, 0.5 * self.width

    @property
    def inscribed_radius(self) -> float:
        """Radius of the largest disc within the body, metres."""
        return 0.5 * min(self.length, self.width)

    @property
    def circumscribed_radius(self) -> float:
        """Radius of the smallest disc around the body, metres: what it needs to turn anywhere."""
        return 0.5 * math.hypot(self.length, self.width)


class BurgerConfig(DiscRobot):
    """TurtleBot3 Burger as the paper drives it: at most 0.25 m/s and 1 rad/s.

    Its manual says 138 x 178 mm, 0.22 m/s and 2.84 rad/s (ROBOTIS-GIT/emanual:
    docs/en/platform/turtlebot3/features/features.md, *Hardware Specifications*). 0.105 m is the radius with which its
    navigation plans (ROBOTIS-GIT/turtlebot3: turtlebot3_navigation2/param/burger.yaml): a disc about its axle, while its
    LiDAR sits 32 mm behind that (turtlebot3_description/urdf/turtlebot3_burger.urdf.xacro), and here above it.
    """

    name: Literal["burger"] = Field("burger", title="TurtleBot3 Burger")


class WaffleConfig(RectangularRobot):
    """TurtleBot3 Waffle Pi: 281 x 306 mm, 0.26 m/s, 1.82 rad/s.

    All from its manual (ROBOTIS-GIT/emanual: docs/en/platform/turtlebot3/features/features.md, *Hardware Specifications*).
    Its LiDAR sits above its middle, and its axle 64 mm ahead of that (ROBOTIS-GIT/turtlebot3:
    turtlebot3_description/urdf/turtlebot3_waffle_pi.urdf.xacro), while here it turns about its middle.
    """

    name: Literal["waffle"] = Field("waffle", title="TurtleBot3 Waffle")
    length: float = _length(0.281)
    width: float = _width(0.306)
    max_linear_speed: float = _top_speed(0.26)
    max_angular_speed: float = _top_turning_rate(1.82)


class JackalConfig(RectangularRobot):
    """A robot like Clearpath's Jackal: 508 x 430 mm, 2 m/s, 4 rad/s.

    The speeds are the limits of its controller (jackal/jackal: jackal_control/config/control.yaml), which also allows 20
    m/s² and 25 rad/s². The size is the one that is quoted as the maker's specification; the data sheet itself was not at
    hand. The robot's own description (jackal_description/urdf/jackal.urdf.xacro) is in keeping with it: a mount on the
    front fender is 256 mm ahead of the middle, and the outer sides of the wheels are 416 mm apart.
    """

    name: Literal["jackal"] = Field("jackal", title="Jackal-like")
    length: float = _length(0.508)
    width: float = _width(0.43)
    max_linear_speed: float = _top_speed(2.0)
    max_angular_speed: float = _top_turning_rate(4.0)


class RoundConfig(DiscRobot):
    """Any robot with a round body."""

    name: Literal["round"] = Field("round", title="Other, round")
    radius: float = _radius(0.2)
    max_linear_speed: float = _top_speed(0.5)
    max_angular_speed: float = _top_turning_rate(1.5)


class RectangularConfig(RectangularRobot):
    """Any robot with a rectangular body."""

    name: Literal["rectangular"] = Field("rectangular", title="Other, rectangular")
    max_linear_speed: float = _top_speed(0.5)
    max_angular_speed: float = _top_turning_rate(1.5)


AnyRobotConfig = Annotated[
    BurgerConfig | WaffleConfig | JackalConfig | RoundConfig | RectangularConfig, Field(discriminator="name")
]

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
        description="Metres per second forwards.",
        json_schema_extra=ADVANCED,
    )


def _top_turning_rate(default: float) -> Any:
    return Field(
        default,
        gt=0.0,
        le=6.0,
        title="Top turning rate",
        description="Radians per second, both ways; an Ackermann drive steers less where it would turn faster.",
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


def _reverse(default: float) -> Any:
    return Field(
        default,
        ge=0.0,
        le=1.0,
        title="Reverse",
        description="Fastest backwards, as a share of the top speed; 0 never reverses.",
        json_schema_extra=ADVANCED,
    )


class DifferentialDrive(Frozen):
    """Two driven wheels: it drives forwards or backwards, and turns about its middle."""

    name: Literal["differential"] = Field("differential", title="Differential")
    reverse: float = _reverse(0.0)


class OmnidirectionalDrive(Frozen):
    """Wheels that also roll sideways: it drives any way while it turns about its middle; speeds hold for each axis."""

    name: Literal["omnidirectional"] = Field("omnidirectional", title="Omni")
    reverse: float = _reverse(1.0)
    sideways: float = Field(
        1.0,
        gt=0.0,
        le=1.0,
        title="Sideways",
        description="Fastest to either side, as a share of the top speed.",
        json_schema_extra=ADVANCED,
    )


class AckermannDrive(Frozen):
    """Steered front wheels, as a car's: it drives on circles about points abeam of its rear axle, and never on the spot.

    The body's middle is half-way between the axles. Speeds are those of the rear axle's middle, which turns on a circle of
    radius wheel base / tan(steering angle).
    """

    name: Literal["ackermann"] = Field("ackermann", title="Ackermann")
    wheel_base: float = Field(
        0.16,
        ge=0.02,
        le=2.0,
        title="Wheel base",
        description="Metres between the axles.",
        json_schema_extra=ADVANCED,
    )
    steering_limit: float = Field(
        30.0,
        ge=1.0,
        le=80.0,
        title="Steering limit",
        description="Degrees to either side.",
        json_schema_extra=ADVANCED,
    )
    steering_rate: float = Field(
        0.0,
        ge=0.0,
        le=10_000.0,
        title="Steering rate",
        description="Degrees per second that the steering angle changes at most; 0 is unlimited.",
        json_schema_extra=ADVANCED,
    )
    reverse: float = _reverse(1.0)


AnyDrive = Annotated[DifferentialDrive | OmnidirectionalDrive | AckermannDrive, Field(discriminator="name")]


def _drive(default: type[DifferentialDrive | OmnidirectionalDrive | AckermannDrive] = DifferentialDrive) -> Any:
    return Field(default_factory=default, title="Drive", description="How its wheels move it.", json_schema_extra=ADVANCED)


class _Limits(Frozen):
    """The drive, and how fast it may go."""

    drive: AnyDrive = _drive()
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
        description="Radians per second squared, both ways; 0 is unlimited. An Ackermann drive has a steering rate instead.",
        json_schema_extra=ADVANCED,
    )


class DiscRobot(_Limits):
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


class RectangularRobot(_Limits):
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


class RacecarConfig(RectangularRobot):
    """A car like F1TENTH's: 0.58 x 0.31 m, axles 0.33 m apart, steering up to 24 degrees at 183 degrees a second.

    From the vehicle parameters of its simulator (f1tenth/f1tenth_gym: gym/f110_gym/envs/f110_env.py: length, width, lf + lr,
    s_max, sv_max), whose middle of mass is within 7 mm of half-way between the axles. The real one drives 20 m/s; here it
    goes at 1 m/s.
    """

    name: Literal["racecar"] = Field("racecar", title="F1TENTH-like car")
    length: float = _length(0.58)
    width: float = _width(0.31)
    max_linear_speed: float = _top_speed(1.0)
    max_angular_speed: float = _top_turning_rate(3.0)
    drive: AnyDrive = Field(
        default_factory=lambda: AckermannDrive(wheel_base=0.3302, steering_limit=24.0, steering_rate=183.0),
        title="Drive",
        description="How its wheels move it.",
        json_schema_extra=ADVANCED,
    )


class RidgebackConfig(RectangularRobot):
    """A robot like Clearpath's Ridgeback: 0.96 x 0.793 m on mecanum wheels, 1 m/s along each axis and 4 rad/s.

    The speeds are the limits of its controller (ridgeback/ridgeback: ridgeback_control/config/control.yaml), which also
    allows 1 m/s² and 25 rad/s². The size is the
    one that is quoted as the maker's specification; the data sheet itself was not at hand.
    """

    name: Literal["ridgeback"] = Field("ridgeback", title="Ridgeback-like")
    length: float = _length(0.96)
    width: float = _width(0.793)
    max_linear_speed: float = _top_speed(1.0)
    max_angular_speed: float = _top_turning_rate(4.0)
    drive: AnyDrive = _drive(OmnidirectionalDrive)


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
    BurgerConfig | WaffleConfig | JackalConfig | RacecarConfig | RidgebackConfig | RoundConfig | RectangularConfig,
    Field(discriminator="name"),
]

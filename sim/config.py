"""What an environment is: the task configuration, from the form to the file inside a checkpoint.

Everything here is pydantic only, so that the server can read it without numba, pymunk or torch. The schema that pydantic
derives from these models is the launch form: `title` and `description` are what a person reads there, `x-advanced` moves a
field under *Advanced*.
"""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field, model_validator
from pydantic.config import JsonDict

ADVANCED: JsonDict = {"x-advanced": True}

ArenaName = Literal["simple", "complex"]
ObservationName = Literal["paper", "improved"]


class Frozen(BaseModel):
    """Base of every configuration model: immutable, and an unknown key is an error rather than ignored."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        validate_default=True,
        allow_inf_nan=False,
        # What is read back is always complete, and the generated types say so.
        json_schema_serialization_defaults_required=True,
    )


class ArenaConfig(Frozen):
    """The place in which the robots drive."""

    name: ArenaName = Field(
        "simple",
        title="Arena",
        description="Simple: 10 x 10 m with nothing but walls. Complex: the same with 17 obstacles.",
    )


class RobotConfig(Frozen):
    """A differential-drive robot with a disc as its footprint; the default is the TurtleBot3 Burger."""

    radius: float = Field(0.105, gt=0.02, le=0.4, title="Radius", description="Metres.", json_schema_extra=ADVANCED)
    max_linear_speed: float = Field(
        0.25,
        gt=0.0,
        le=3.0,
        title="Top speed",
        description="Metres per second; the robot does not reverse.",
        json_schema_extra=ADVANCED,
    )
    max_angular_speed: float = Field(
        1.0,
        gt=0.0,
        le=6.0,
        title="Top turning rate",
        description="Radians per second, both ways.",
        json_schema_extra=ADVANCED,
    )


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

    @model_validator(mode="after")
    def _batches_divide_rays(self) -> "LidarConfig":
        if self.rays % self.batches:
            raise ValueError(f"batches must divide rays, and {self.batches} does not divide {self.rays}")
        return self


class RewardConfig(Frozen):
    """The paper's rewards: on arrival, on collision, and in between progress c_r * (d_before - d_after).

    The advanced ones multiply the progress by 2^(d_before / d_after) and subtract penalty * (1 - hd). The paper leaves hd
    open; here it is the free distance ahead over the LiDAR's range (`clearance`) or 1 - |bearing of the target| / pi
    (`alignment`).
    """

    name: Literal["basic", "clearance", "alignment"] = Field(
        "basic",
        title="Reward",
        description=(
            "Basic: arrival, collision, progress. Clearance and alignment are readings of the advanced reward: "
            "exponential progress, less a penalty for little room ahead or for facing away from the target."
        ),
    )
    arrival: float = Field(120.0, title="Arrival reward", json_schema_extra=ADVANCED)
    collision: float = Field(-100.0, title="Collision reward", json_schema_extra=ADVANCED)
    progress: float = Field(
        500.0, title="Progress coefficient", description="Reward per metre gained.", json_schema_extra=ADVANCED
    )
    penalty: float = Field(
        5.0,
        ge=0.0,
        title="Penalty coefficient",
        description="Largest penalty per step; the basic reward has none.",
        json_schema_extra=ADVANCED,
    )


class TaskConfig(Frozen):
    """Everything that defines the environment: arena, robot, LiDAR, observation, reward, limits."""

    arena: ArenaConfig = Field(default_factory=ArenaConfig, title="Arena")
    robot: RobotConfig = Field(default_factory=RobotConfig, title="Robot")
    lidar: LidarConfig = Field(default_factory=LidarConfig, title="LiDAR")
    observation: ObservationName = Field(
        "improved",
        title="Observation",
        description="Improved: inverse ranges and a signed bearing. Paper: ranges and angles as published.",
    )
    reward: RewardConfig = Field(default_factory=RewardConfig, title="Reward")
    control_period: float = Field(
        0.2,
        ge=0.02,
        le=1.0,
        title="Control period",
        description="Seconds between two actions.",
        json_schema_extra=ADVANCED,
    )
    arrival_distance: float = Field(
        0.2,
        gt=0.0,
        le=1.0,
        title="Arrival distance",
        description="Metres between robot and target that count as arrived.",
        json_schema_extra=ADVANCED,
    )
    collision_distance: float = Field(
        0.2,
        ge=0.0,
        le=1.0,
        title="Collision distance",
        description="A ray shorter than this is a collision; touching the body always is. Metres.",
        json_schema_extra=ADVANCED,
    )
    step_limit: int = Field(
        500,
        ge=10,
        le=10_000,
        title="Step limit",
        description="Steps per target before the attempt times out.",
        json_schema_extra=ADVANCED,
    )

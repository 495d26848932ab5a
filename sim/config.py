"""What an environment is: the task configuration, from the form to the file inside a checkpoint.

Everything here is pydantic only, so that the server can read it without numba, pymunk or torch. The schema that pydantic
derives from these models is the launch form: `title` and `description` are what a person reads there, `x-advanced` moves a
field under *Advanced*.
"""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from sim.arena_file import ArenaFile
from sim.schema import ADVANCED as ADVANCED
from sim.schema import HIDDEN
from sim.schema import Frozen as Frozen

ArenaName = Literal["simple", "complex"]
FamilyName = Literal["clutter", "corridors", "rooms", "warehouse", "maze", "passages"]
ObservationName = Literal["paper", "improved"]


class ArenaConfig(Frozen):
    """The place in which the robots drive."""

    name: ArenaName = Field(
        "simple",
        title="Arena",
        description="Simple: 10 x 10 m with nothing but walls. Complex: the same with 17 obstacles.",
    )


MAX_MAPS = 4096
"""Maps of the largest pool; pools of different seeds never share a map."""


class GeneratedArenaConfig(Frozen):
    """A pool of arenas drawn from a seed; the robots are spread over all of them."""

    name: FamilyName = Field(
        "clutter",
        title="Arena",
        description="Drawn from a seed, 10 x 10 m, with a way to every target: random clutter, corridors, rooms with doors, "
        "warehouse aisles, a maze, or narrow passages.",
    )
    difficulty: float = Field(
        0.5,
        ge=0.0,
        le=1.0,
        title="Difficulty",
        description="More obstacles and narrower passages: at 1 they are 0.9 m wide for the default robot.",
    )
    maps: int = Field(
        64,
        ge=1,
        le=MAX_MAPS,
        title="Maps",
        description="Different arenas of the training; with few of them the policy learns them by heart.",
        json_schema_extra=ADVANCED,
    )
    seed: int = Field(
        0,
        ge=0,
        le=2**31 - 1,
        title="Map seed",
        description="Which maps; the suites' maps are never among them.",
        json_schema_extra=ADVANCED,
    )


class ImportedArenaConfig(Frozen):
    """An arena from a file. A worker and a checkpoint carry its geometry; the service may leave it to the hash."""

    name: Literal["imported"] = Field("imported", title="Imported", description="Read from a file; see the gallery.")
    sha256: str = Field(
        "", pattern="^([0-9a-f]{64})?$", title="Imported arena", description="The hash that the gallery shows."
    )
    arena: ArenaFile | None = Field(None, title="Geometry", json_schema_extra=HIDDEN)

    @model_validator(mode="after")
    def _geometry_is_the_hashed_one(self) -> Self:
        if self.arena is not None and self.arena.sha256 != self.sha256:
            raise ValueError(f"the geometry's hash is {self.arena.sha256}, not {self.sha256!r}")
        return self

    @classmethod
    def of(cls, arena: ArenaFile) -> Self:
        """The configuration that carries this arena."""
        return cls(sha256=arena.sha256, arena=arena)


AnyArenaConfig = Annotated[ArenaConfig | GeneratedArenaConfig | ImportedArenaConfig, Field(discriminator="name")]


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

    arena: AnyArenaConfig = Field(default_factory=ArenaConfig, title="Arena")
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

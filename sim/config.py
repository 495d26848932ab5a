"""What an environment is: the task configuration, from the form to the file inside a checkpoint.

Everything here is pydantic only, so that the server can read it without numba, pymunk or torch. The schema that pydantic
derives from these models is the launch form: `title` and `description` are what a person reads there, `x-advanced` moves a
field under *Advanced*.
"""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from sim.arena_file import ArenaFile
from sim.mover_config import MoversConfig as MoversConfig
from sim.robot_config import AnyRobotConfig as AnyRobotConfig
from sim.robot_config import BurgerConfig as BurgerConfig
from sim.robot_config import JackalConfig as JackalConfig
from sim.robot_config import RectangularConfig as RectangularConfig
from sim.robot_config import RoundConfig as RoundConfig
from sim.robot_config import WaffleConfig as WaffleConfig
from sim.schema import ADVANCED as ADVANCED
from sim.schema import HIDDEN
from sim.schema import Frozen as Frozen
from sim.sensing_config import MAX_DELAY as MAX_DELAY
from sim.sensing_config import LidarConfig as LidarConfig
from sim.sensing_config import OdometryConfig as OdometryConfig
from sim.sensing_config import RandomisationConfig as RandomisationConfig

ArenaName = Literal["simple", "complex"]
FamilyName = Literal["clutter", "corridors", "rooms", "warehouse", "maze", "passages", "thicket", "mixed"]
ObservationName = Literal["paper", "improved"]


class ArenaConfig(Frozen):
    """The place in which the robots drive."""

    name: ArenaName = Field(
        "simple",
        title="Arena",
        description="Simple: 10 x 10 m with nothing but walls. Complex: the same with 17 obstacles.",
    )
    movers: MoversConfig = Field(default_factory=MoversConfig, title="Movers")


MAX_MAPS = 4096
"""Maps of the largest pool; pools of different seeds never share a map."""


class GeneratedArenaConfig(Frozen):
    """A pool of arenas drawn from a seed; the robots are spread over all of them."""

    name: FamilyName = Field(
        "clutter",
        title="Arena",
        description="Drawn from a seed, 10 x 10 m, with a way to every target: random clutter, corridors, rooms with doors, "
        "warehouse aisles, a maze, narrow passages, a thicket of thin pillars, or clutter and thickets mixed.",
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
    movers: MoversConfig = Field(default_factory=MoversConfig, title="Movers")


class ImportedArenaConfig(Frozen):
    """An arena from a file. A worker and a checkpoint carry its geometry; the service may leave it to the hash."""

    name: Literal["imported"] = Field("imported", title="Imported", description="Read from a file; see the gallery.")
    sha256: str = Field(
        "", pattern="^([0-9a-f]{64})?$", title="Imported arena", description="The hash that the gallery shows."
    )
    arena: ArenaFile | None = Field(None, title="Geometry", json_schema_extra=HIDDEN)
    movers: MoversConfig = Field(default_factory=MoversConfig, title="Movers")

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
    robot: AnyRobotConfig = Field(
        default_factory=BurgerConfig,
        title="Robot",
        description="Its body and its limits; under Advanced each can be changed.",
    )
    lidar: LidarConfig = Field(default_factory=LidarConfig, title="LiDAR")
    odometry: OdometryConfig = Field(default_factory=OdometryConfig, title="Odometry")
    observation: ObservationName = Field(
        "improved",
        title="Observation",
        description="Improved: inverse ranges and a signed bearing. Paper: ranges and angles as published.",
    )
    frames: int = Field(
        1,
        ge=1,
        le=8,
        title="Stacked frames",
        description="Observations that the policy sees at once: the newest and those of the steps before it.",
        json_schema_extra=ADVANCED,
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

    command_delay: int = Field(
        0,
        ge=0,
        le=MAX_DELAY,
        title="Command delay",
        description="Control steps between an action and the robot following it.",
        json_schema_extra=ADVANCED,
    )
    randomisation: RandomisationConfig = Field(default_factory=RandomisationConfig, title="Domain randomisation")

    @model_validator(mode="after")
    def _drawn_ranges_are_within_the_lidars(self) -> Self:
        if self.randomisation.range and self.randomisation.range[1] > self.lidar.range:
            raise ValueError(f"randomisation.range goes beyond the LiDAR's range of {self.lidar.range:g} m")
        return self

    @field_validator("robot", mode="before")
    @classmethod
    def _first_robots_had_no_name(cls, robot: Any) -> Any:
        """Files written when there was no other robot than the Burger do not name it."""
        return {"name": "burger", **robot} if isinstance(robot, Mapping) else robot

    @property
    def passable_clearance(self) -> float:
        """Distance from obstacles that the robot's centre needs on its way, metres."""
        return max(self.robot.circumscribed_radius, self.collision_distance)

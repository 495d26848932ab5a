"""What an environment is: arena, robot, sensors, observation, reward and limits (pydantic only)."""

from collections.abc import Mapping
from typing import Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from sim.config.arena import AnyArenaConfig, ArenaConfig
from sim.config.base import ADVANCED, Frozen
from sim.config.reward import RewardConfig
from sim.config.robot import AnyRobotConfig, BurgerConfig
from sim.config.sensing import MAX_DELAY, LidarConfig, OdometryConfig, RandomisationConfig

ObservationName = Literal["paper", "improved"]


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

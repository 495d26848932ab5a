"""What an environment is: arena, robot, sensors, observation, reward and limits (pydantic only)."""

import math
from collections.abc import Mapping
from typing import Any, Self

from pydantic import Field, ValidationInfo, field_validator, model_validator

from sim.config.arena import AnyArenaConfig, ArenaConfig
from sim.config.base import ADVANCED, Frozen
from sim.config.observation import MAX_ACTIONS, MAX_NUMBERS, ObservationConfig, read_first_observations
from sim.config.reward import PathProgressTerm, RewardConfig
from sim.config.robot import AnyRobotConfig, BurgerConfig
from sim.config.sensing import MAX_DELAY, LidarConfig, OdometryConfig, RandomisationConfig

MAX_TOGETHER = 8
"""Robots that may see one another."""


class TaskConfig(Frozen):
    """Everything that defines the environment: arena, robot, LiDAR, observation, reward, limits."""

    arena: AnyArenaConfig = Field(default_factory=ArenaConfig, title="Arena")
    robot: AnyRobotConfig = Field(
        default_factory=BurgerConfig,
        title="Robot",
        description="Its body and its limits, each of which can be changed.",
    )
    lidar: LidarConfig = Field(default_factory=LidarConfig, title="LiDAR")
    odometry: OdometryConfig = Field(default_factory=OdometryConfig, title="Odometry")
    observation: ObservationConfig = Field(default_factory=ObservationConfig, title="Observation")
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
        description="Metres from the body's middle within which what a ray meets is a collision; touching it always is.",
        json_schema_extra=ADVANCED,
    )
    way_clearance: float | None = Field(
        None,
        gt=0.0,
        le=1.0,
        title="Clearance of ways",
        description="Metres that shortest paths and generated passages keep from obstacles; as a rule what the body needs "
        "to turn anywhere. Less for a long body that is to learn gaps which it fits through lengthwise.",
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
    arrival_ends: bool = Field(
        False,
        title="An arrival ends the episode",
        description="The robot then starts anew, in another map where there are more; else it goes on to its next target.",
        json_schema_extra=ADVANCED,
    )
    together: int = Field(
        1,
        ge=1,
        le=MAX_TOGETHER,
        title="Together in one arena",
        description="So many share an arena and see one another, each with a target of its own; 1 is a robot alone.",
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

    @model_validator(mode="after")
    def _lidars_stand_on_the_body(self) -> Self:
        length, width = self.robot.half_extents or (math.inf, math.inf)
        for x, y, _ in self.lidar.mount.places:
            beyond = abs(x) > length or abs(y) > width
            if beyond or (self.robot.half_extents is None and math.hypot(x, y) > self.robot.circumscribed_radius):
                raise ValueError(f"lidar.mount has a LiDAR at ({x:g}, {y:g}) m, which is not on the robot's body")
        return self

    @model_validator(mode="after")
    def _who_gives_way_meets_one_robot(self) -> Self:
        if self.together > 1 and self.arena.movers.count and self.arena.movers.sees_robots:
            raise ValueError("together must be 1 where movers see robots: they give way to one robot, not to several")
        return self

    @model_validator(mode="after")
    def _who_is_together_stays_in_a_map(self) -> Self:
        if self.together > 1 and getattr(self.arena, "map_sampling", "uniform") != "uniform":
            raise ValueError("together must be 1 where maps are sampled by learnability: a group stays in its map")
        return self

    @model_validator(mode="before")
    @classmethod
    def _first_observations_had_a_name(cls, data: Any) -> Any:
        return read_first_observations(data)

    @field_validator("observation")
    @classmethod
    def _can_be_seen(cls, observation: ObservationConfig, info: ValidationInfo) -> ObservationConfig:
        """An observation of this LiDAR, and of a size that fits."""
        lidar = info.data.get("lidar")
        if lidar and observation.batches and lidar.rays % observation.batches:
            raise ValueError(f"batches must divide the LiDAR's rays, and {observation.batches} does not divide {lidar.rays}")
        if (size := observation.size(MAX_ACTIONS, len(lidar.mount.places) if lidar else 1)) > MAX_NUMBERS:
            raise ValueError(f"these are {size:,} numbers, more than the {MAX_NUMBERS:,} that may be: take fewer frames")
        return observation

    @field_validator("robot", mode="before")
    @classmethod
    def _first_robots_had_no_name(cls, robot: Any) -> Any:
        """Files written when there was no other robot than the Burger do not name it."""
        return {"name": "burger", **robot} if isinstance(robot, Mapping) else robot

    @property
    def passable_clearance(self) -> float:
        """Distance from obstacles that the robot's centre needs on its way, metres."""
        if self.way_clearance is not None:
            return self.way_clearance
        return max(self.robot.circumscribed_radius, self.collision_distance)

    @property
    def path_clearance(self) -> float:
        """Metres that shortest paths keep from obstacles, which a critic may be told and a reward be paid for."""
        paid = (term.clearance for term in self.reward.terms if isinstance(term, PathProgressTerm))
        return min((clearance for clearance in paid if clearance is not None), default=self.passable_clearance)

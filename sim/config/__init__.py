"""The task configuration, from the form to the file inside a checkpoint; everybody else imports it from here.

Everything in this room is pydantic only, so that the server can read it without numba, pymunk or torch. The schema that
pydantic derives from these models is the launch form: `title` and `description` are what a person reads there, `x-advanced`
moves a field under *Advanced*.
"""

from sim.config.arena import (
    MAX_MAPS,
    AnyArenaConfig,
    ArenaConfig,
    ArenaName,
    FamilyName,
    GeneratedArenaConfig,
    ImportedArenaConfig,
)
from sim.config.arena_file import (
    MAX_OBSTACLES,
    MAX_SIDE,
    MIN_SIDE,
    AnyMover,
    ArenaFile,
    Box,
    Circle,
    Keyframe,
    Patrol,
    Pedestrian,
    Start,
    Target,
    Timed,
    Walker,
    Waypoint,
)
from sim.config.base import ADVANCED, HIDDEN, Frozen
from sim.config.movers import MAX_MOVERS, MoverKind, MoversConfig
from sim.config.reward import RewardConfig
from sim.config.robot import (
    AnyRobotConfig,
    BurgerConfig,
    JackalConfig,
    RectangularConfig,
    RectangularRobot,
    RoundConfig,
    WaffleConfig,
)
from sim.config.sensing import LidarConfig, OdometryConfig, RandomisationConfig
from sim.config.task import ObservationName, TaskConfig

__all__ = [
    "ADVANCED",
    "HIDDEN",
    "MAX_MAPS",
    "MAX_MOVERS",
    "MAX_OBSTACLES",
    "MAX_SIDE",
    "MIN_SIDE",
    "AnyArenaConfig",
    "AnyMover",
    "AnyRobotConfig",
    "ArenaConfig",
    "ArenaFile",
    "ArenaName",
    "Box",
    "BurgerConfig",
    "Circle",
    "FamilyName",
    "Frozen",
    "GeneratedArenaConfig",
    "ImportedArenaConfig",
    "JackalConfig",
    "Keyframe",
    "LidarConfig",
    "MoverKind",
    "MoversConfig",
    "ObservationName",
    "OdometryConfig",
    "Patrol",
    "Pedestrian",
    "RandomisationConfig",
    "RectangularConfig",
    "RectangularRobot",
    "RewardConfig",
    "RoundConfig",
    "Start",
    "Target",
    "TaskConfig",
    "Timed",
    "WaffleConfig",
    "Walker",
    "Waypoint",
]

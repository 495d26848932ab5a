"""A task as the kernels read it."""

import math

import numpy as np
from numpy.typing import NDArray

from sim.actions import fastest_way
from sim.arenas.freespace import SPAWN_MARGIN
from sim.config import AckermannDrive, OmnidirectionalDrive, TaskConfig
from sim.engine.disturbances import quantity_spans
from sim.engine.rewards import pack_terms
from sim.kernels.records import (
    ACKERMANN,
    DIFFERENTIAL,
    DISTANCE_NOISE,
    DROPOUT,
    FIELD_OF_VIEW,
    HEADING_NOISE,
    MAX_ANGULAR,
    MAX_LINEAR,
    NOISE,
    OMNIDIRECTIONAL,
    PARAMETERS,
    RANGE,
    RATE,
)
from sim.kernels.step import ARRIVAL_MARGIN, MIN_TARGET_DISTANCE
from sim.observations import pack_parts

_DRIVES = {"differential": DIFFERENTIAL, "omnidirectional": OMNIDIRECTIONAL, "ackermann": ACKERMANN}


def _path_samples(task: TaskConfig) -> int:
    """Times that the body is checked in one step: at least once in every radius that a part of it moves.

    A fast robot could jump through a wall otherwise, and a corner of a rectangular one sweep over a pole.
    """
    robot = task.robot
    _, (linear, turning) = quantity_spans(task)[[MAX_LINEAR, MAX_ANGULAR]].T.tolist()
    fastest = fastest_way(robot, linear, turning)
    if robot.half_extents:
        fastest += turning * robot.circumscribed_radius
    return math.ceil(fastest * task.control_period / robot.inscribed_radius)


def _pack_drive(task: TaskConfig) -> dict[str, object]:
    """The drive's fields of the parameters."""
    drive = task.robot.drive
    values: dict[str, object] = {"drive": _DRIVES[drive.name], "least_linear": 0.0 - drive.reverse}
    if isinstance(drive, OmnidirectionalDrive):
        values["sideways"] = drive.sideways
    if isinstance(drive, AckermannDrive):
        values["wheel_base"] = drive.wheel_base
        values["steering_limit"] = math.radians(drive.steering_limit)
        values["steering_rate"] = math.radians(drive.steering_rate)
    return values


def pack_parameters(task: TaskConfig, *, arrival_ends: bool, starts_anew: bool) -> NDArray[np.void]:
    """A task as the kernels read it: (1,) of `sim.kernels.records.PARAMETERS`.

    Args:
        task: robot, LiDAR, observation, reward and limits.
        arrival_ends: whether an arrival ends the episode.
        starts_anew: whether the next episode begins in the step that ended one.
    """
    parameters = np.zeros(1, dtype=PARAMETERS)
    spans = quantity_spans(task)
    half_length, half_width = task.robot.half_extents or (0.0, 0.0)
    values = {
        "period": task.control_period,
        "spans": spans,
        "perceives": bool(spans[[NOISE, DROPOUT, RATE]].any() or spans[RANGE, 0] < task.lidar.range),
        "drifts": bool(spans[[DISTANCE_NOISE, HEADING_NOISE]].any()),
        **_pack_drive(task),
        "max_linear_acceleration": task.robot.max_linear_acceleration,
        "max_angular_acceleration": task.robot.max_angular_acceleration,
        "radius": task.robot.inscribed_radius,
        "half_length": half_length,
        "half_width": half_width,
        "range": task.lidar.range,
        "field_of_view": task.lidar.field_of_view,
        "mounted": any(any(place) for place in task.lidar.mount.places) or len(task.lidar.mount.places) > 1,
        "lidars": len(task.lidar.mount.places),
        "mounts": np.resize(np.array(task.lidar.mount.places), (2, 3)),
        "looks_ahead": spans[FIELD_OF_VIEW, 1] <= 180.0 and not any(yaw for _, _, yaw in task.lidar.mount.places),
        "arrival_distance": task.arrival_distance,
        "collision_distance": task.collision_distance,
        "step_limit": task.step_limit,
        "arrival_ends": arrival_ends,
        "starts_anew": starts_anew,
        "spawn_clearance": task.passable_clearance + SPAWN_MARGIN,
        "min_target_distance": max(float(MIN_TARGET_DISTANCE), task.arrival_distance + ARRIVAL_MARGIN),
        "path_samples": _path_samples(task),
        "together": task.together,
        "body": task.robot.circumscribed_radius,
    }
    for name, value in (values | pack_parts(task) | pack_terms(task.reward)).items():
        parameters[name] = value
    return parameters

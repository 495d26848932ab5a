"""What a robot needs to know of a checkpoint: its manifest, boiled down to the numbers that the shipped code reads."""

import hashlib
import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from safetensors.numpy import save as save_safetensors

from sim.arenas import build_arena
from sim.observations import near_distance
from workers.errors import ExportError
from workers.export.ros2.mapless_navigator.policy import Specification
from workers.manifest import Manifest


def pack_weights(weights: Mapping[str, NDArray[np.float32]]) -> bytes:
    """The weights as a safetensors file; the same weights give the same bytes."""
    return save_safetensors({name: np.ascontiguousarray(weights[name]) for name in sorted(weights)})


def specify(manifest: Manifest, packed_weights: bytes) -> Specification:
    """The specification that ships with these weights.

    Raises:
        ExportError: the shipped code can't make this policy's observation.
    """
    task, observation = manifest.training.task, manifest.observation
    if (observation.name, observation.version) not in (("improved", 1), ("paper", 1)):
        raise ExportError(
            f"the observation {observation.name!r} version {observation.version} can't be made on a robot: "
            "export with the release that trained this policy"
        )
    arena = build_arena(task.arena, 0)
    half_length, half_width = task.robot.half_extents or (0.0, 0.0)
    return Specification(
        format="mapless-deployment",
        version=2,
        observation=observation.name,
        observation_version=observation.version,
        rays=task.lidar.rays,
        batches=task.lidar.batches,
        frames=task.frames,
        field_of_view=math.radians(task.lidar.field_of_view),
        range=task.lidar.range,
        near=near_distance(task),
        diagonal=2.0 * math.hypot(arena.half_width, arena.half_height),
        max_linear_speed=task.robot.max_linear_speed,
        max_angular_speed=task.robot.max_angular_speed,
        control_period=task.control_period,
        arrival_distance=task.arrival_distance,
        collision_distance=task.collision_distance,
        robot_radius=task.robot.inscribed_radius,
        robot_length=2.0 * half_length,
        robot_width=2.0 * half_width,
        network=manifest.network.name,
        layers=manifest.network.layers,
        activation=manifest.network.activation,
        weights_sha256=hashlib.sha256(packed_weights).hexdigest(),
    )

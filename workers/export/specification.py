"""What a robot needs to know of a checkpoint: its manifest, boiled down to the numbers that the shipped code reads."""

import hashlib
import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray
from safetensors.numpy import save as save_safetensors

from sim.actions import action_layout
from sim.arenas import build_arena
from sim.config import (
    AckermannDrive,
    BearingPart,
    DistancePart,
    HeadingPart,
    KnownPart,
    ObservationPart,
    OmnidirectionalDrive,
    RangesPart,
    ReachPart,
    TaskConfig,
    TrailPart,
)
from sim.config.observation import part_size
from sim.observations import near_distance, observation_layout
from workers.errors import ExportError
from workers.export.ros2.mapless_navigator.policy import Part, Specification
from workers.manifest import Manifest
from workers.networks.description import Description


def pack_weights(weights: Mapping[str, NDArray[np.float32]]) -> bytes:
    """The weights as a safetensors file; the same weights give the same bytes."""
    return save_safetensors({name: np.ascontiguousarray(weights[name]) for name in sorted(weights)})


def specify(manifest: Manifest, description: Description | None, packed_weights: bytes) -> Specification:
    """The specification that ships with these weights.

    Raises:
        ExportError: the shipped code can't make this policy's observation.
    """
    task, observation = manifest.training.task, manifest.observation
    if observation.version != 1:
        raise ExportError(
            f"the observation {observation.name!r} version {observation.version} can't be made on a robot: "
            "export with the release that trained this policy"
        )
    return specify_task(task, manifest.network.name, description, packed_weights)


def specify_task(task: TaskConfig, network: str, description: Description | None, packed_weights: bytes) -> Specification:
    """The specification of a policy that was made for a task.

    Args:
        task: robot, LiDAR, observation and limits.
        network: its name.
        description: of the network; None where only an ONNX file says what it computes.
        packed_weights: see `pack_weights`.
    """
    actions = action_layout(task.robot).size
    repeated, carried = earlier_places(task)
    arena = build_arena(task.arena, 0)
    drive = task.robot.drive
    half_length, half_width = task.robot.half_extents or (0.0, 0.0)
    return Specification(
        format="mapless-deployment",
        version=4,
        parts=tuple(
            Part(_kind(part), part_size(part, actions, len(task.lidar.mount.places))) for part in task.observation.parts
        ),
        repeated=repeated,
        carried=carried,
        rays=task.lidar.rays,
        mounts=task.lidar.mount.places,
        field_of_view=math.radians(task.lidar.field_of_view),
        range=task.lidar.range,
        near=near_distance(task),
        diagonal=2.0 * math.hypot(arena.half_width, arena.half_height),
        drive=drive.name,
        reverse=drive.reverse,
        sideways=drive.sideways if isinstance(drive, OmnidirectionalDrive) else 0.0,
        wheel_base=drive.wheel_base if isinstance(drive, AckermannDrive) else 0.0,
        steering_limit=math.radians(drive.steering_limit) if isinstance(drive, AckermannDrive) else 0.0,
        max_linear_speed=task.robot.max_linear_speed,
        max_angular_speed=task.robot.max_angular_speed,
        control_period=task.control_period,
        arrival_distance=task.arrival_distance,
        collision_distance=task.collision_distance,
        robot_radius=task.robot.inscribed_radius,
        robot_length=2.0 * half_length,
        robot_width=2.0 * half_width,
        network=network,
        formula=() if description is None else description.lines,
        memory=0 if description is None else description.memory,
        weights_sha256=hashlib.sha256(packed_weights).hexdigest(),
    )


def _kind(part: ObservationPart) -> str:
    """What the shipped code calls a part."""
    match part:
        case RangesPart(inverse=True):
            return "inverse_ranges"
        case DistancePart(scaling="diagonal"):
            return "distance_of_diagonal"
        case BearingPart(encoding="sine_cosine"):
            return "bearing_sine_cosine"
        case HeadingPart(scaling="turn"):
            return "heading_turn"
        case TrailPart(memory="long"):
            return "long_trail"
        case ReachPart(progress=True) | KnownPart(progress=True):
            return f"{part.name}_progress"
        case _:
            return part.name


def earlier_places(task: TaskConfig) -> tuple[tuple[int, ...], tuple[int, ...]]:
    """Where the numbers of earlier moments come from: places in the newest moment, and in the observation a step before."""
    blocks = observation_layout(task).blocks
    places = {(block.key, block.age): range(block.place.start, block.place.stop) for block in blocks}
    repeated = (place for block in blocks if block.age for place in places[block.key, 0])
    carried = (place for block in blocks if block.age for place in places[block.key, block.age - 1])
    return tuple(repeated), tuple(carried)

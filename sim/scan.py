"""Scans and clearances at any poses of an arena: for pictures and checks, by the same kernel as the training."""

from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.arenas import Arena
from sim.config import AnyRobotConfig, LidarConfig
from sim.engine.shapes import pack_shapes
from sim.kernels.footprint import rectangle_clearances
from sim.kernels.sensing import clearance_points, scan_poses
from sim.lidar import drawn_ray_angles, padded, ray_origins


def scan(
    arena: Arena,
    poses: ArrayLike,
    lidar: LidarConfig | None = None,
    *,
    movers: ArrayLike = (),
    fields_of_view: ArrayLike | None = None,
) -> NDArray[np.float32]:
    """Ranges from poses.

    Args:
        arena: the place.
        poses: (N, 3) x, y of bodies in metres, heading in radians.
        lidar: the scanner, mounted on them, by default the default one.
        movers: (K, 3) x, y, radius of what moves in it at that moment.
        fields_of_view: (N,) degrees that the rays cover from each pose, by default the scanner's.

    Returns:
        (N, scan) metres, at most the LiDAR's range; 0 from inside an obstacle.
    """
    lidar = lidar or LidarConfig()
    discs = np.asarray(movers, dtype=np.float64).reshape(-1, 3)
    scene = replace(arena, circles=np.vstack([arena.circles, discs])) if len(discs) else arena
    where = np.ascontiguousarray(poses, dtype=np.float32).reshape(-1, 3)
    fields = np.array([lidar.field_of_view]) if fields_of_view is None else np.asarray(fields_of_view, dtype=np.float64)
    scans = []
    for number, (_, _, yaw) in enumerate(lidar.mount.places):
        first = number * lidar.rays
        angles = drawn_ray_angles(lidar, fields)[:, first : first + lidar.rays]
        sensors = where.copy()
        sensors[:, :2] = ray_origins(lidar, where)[:, first] if lidar.mount.name != "centre" else where[:, :2]
        ranges = np.empty((len(where), lidar.rays), dtype=np.float32)
        scan_poses(
            sensors,
            np.zeros(len(where), dtype=np.int32),
            *pack_shapes((scene,)),
            padded(np.cos(angles)),
            padded(np.sin(angles)),
            np.float32(lidar.range),
            np.int32(fields.max(initial=0.0) <= 180.0 and yaw == 0.0),
            ranges,
        )
        scans.append(ranges)
    return np.concatenate(scans, axis=1)


def body_clearances(arena: Arena, poses: ArrayLike, robot: AnyRobotConfig) -> NDArray[np.float32]:
    """Signed distances (N,) from a robot's body at poses (N, 3) to the nearest surface, metres."""
    where = np.ascontiguousarray(poses, dtype=np.float32).reshape(-1, 3)
    if robot.half_extents is None:
        return clearances(arena, where[:, :2]) - np.float32(robot.inscribed_radius)
    half_length, half_width = (np.float32(extent) for extent in robot.half_extents)
    result = np.empty(len(where), dtype=np.float32)
    maps = np.zeros(len(where), dtype=np.int32)
    rectangle_clearances(where, maps, *pack_shapes((arena,)), half_length, half_width, result)
    return result


def clearances(arena: Arena, points: ArrayLike) -> NDArray[np.float32]:
    """Signed distances (N,) from points (N, 2) to the nearest surface, metres."""
    where = np.ascontiguousarray(points, dtype=np.float32).reshape(-1, 2)
    result = np.empty(len(where), dtype=np.float32)
    clearance_points(where, np.zeros(len(where), dtype=np.int32), *pack_shapes((arena,)), result)
    return result

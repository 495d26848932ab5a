"""Where the rays of a scan point."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.config import LidarConfig

LANES = 16
"""The kernels work on so many rays at a time; what was left over of others would go one by one."""


def ray_angles(lidar: LidarConfig) -> NDArray[np.float64]:
    """Angles of one LiDAR's rays against where it looks, (rays,) radians, from right to left.

    The first and last ray stand on the edges of the field of view (paper: 30 rays, uniform from -90 to +90 degrees); in a
    full circle, where both edges are the same direction, the last one is left out.
    """
    half = np.radians(lidar.field_of_view) / 2.0
    return np.linspace(-half, half, lidar.rays, endpoint=lidar.field_of_view < 360.0)


def padded(directions: NDArray[np.float64], scanners: int = 1) -> NDArray[np.float32]:
    """Cosines or sines of rays (n, scan) as the kernels want them: of each LiDAR up to a multiple of `LANES`, by zeros."""
    each = directions.reshape(len(directions), scanners, -1)
    return np.pad(each, ((0, 0), (0, 0), (0, -each.shape[2] % LANES))).reshape(len(directions), -1).astype(np.float32)


def drawn_ray_angles(lidar: LidarConfig, fields_of_view: ArrayLike) -> NDArray[np.float64]:
    """Angles of a scan's rays against the heading of the body, where they cover other fields of view (n,), degrees.

    The angles between their rays are as much larger or smaller as their fields (`sim.config.RandomisationConfig`).

    Returns:
        (n, scan) radians: of each LiDAR from right to left, turned as it is mounted.
    """
    spread = np.asarray(fields_of_view, dtype=np.float64) / lidar.field_of_view
    own = np.multiply.outer(spread, ray_angles(lidar))
    return np.concatenate([own + yaw for _, _, yaw in lidar.mount.places], axis=-1)


def ray_origins(lidar: LidarConfig, poses: ArrayLike) -> NDArray[np.float64]:
    """Where the rays of bodies at poses (n, 3) begin: (n, scan, 2) metres."""
    x, y, heading = np.asarray(poses, dtype=np.float64).T[:, :, None]
    ahead, aside, _ = np.repeat(np.array(lidar.mount.places), lidar.rays, axis=0).T
    cos, sin = np.cos(heading), np.sin(heading)
    return np.stack([x + cos * ahead - sin * aside, y + sin * ahead + cos * aside], axis=2)

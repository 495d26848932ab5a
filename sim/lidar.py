"""Where the rays of a scan point."""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.config import LidarConfig

LANES = 16
"""The kernels work on so many rays at a time; what was left over of others would go one by one."""


def ray_angles(lidar: LidarConfig) -> NDArray[np.float64]:
    """Angles of the rays against the heading, (rays,) radians, from right to left.

    The first and last ray stand on the edges of the field of view (paper: 30 rays, uniform from -90 to +90 degrees); in a
    full circle, where both edges are the same direction, the last one is left out.
    """
    half = np.radians(lidar.field_of_view) / 2.0
    return np.linspace(-half, half, lidar.rays, endpoint=lidar.field_of_view < 360.0)


def padded(directions: NDArray[np.float64]) -> NDArray[np.float32]:
    """Cosines or sines of rays (n, rays), with zeros up to a multiple of `LANES` behind them, as the kernels want them."""
    return np.pad(directions, ((0, 0), (0, -directions.shape[1] % LANES))).astype(np.float32)


def drawn_ray_angles(lidar: LidarConfig, fields_of_view: ArrayLike) -> NDArray[np.float64]:
    """The same for scanners that cover other fields of view (n,), degrees, with the same rays: (n, rays) radians.

    The angles between their rays are as much larger or smaller as their fields (`sim.config.RandomisationConfig`).
    """
    spread = np.asarray(fields_of_view, dtype=np.float64) / lidar.field_of_view
    return np.multiply.outer(spread, ray_angles(lidar))

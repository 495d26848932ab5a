"""Where the rays of a scan point."""

import numpy as np
from numpy.typing import NDArray

from sim.config import LidarConfig


def ray_angles(lidar: LidarConfig) -> NDArray[np.float64]:
    """Angles of the rays against the heading, (rays,) radians, from right to left.

    The first and last ray stand on the edges of the field of view (paper: 30 rays, uniform from -90 to +90 degrees); in a
    full circle, where both edges are the same direction, the last one is left out.
    """
    half = np.radians(lidar.field_of_view) / 2.0
    return np.linspace(-half, half, lidar.rays, endpoint=lidar.field_of_view < 360.0)

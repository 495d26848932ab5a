"""Since when one robot knows what it sees, in plain Python: the reference of `sim.kernels.known`."""

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sim.config import KnownPart, LidarConfig
from sim.engine.plain_views import PlainView, wrapped
from sim.kernels.known import SECTOR_EDGE
from sim.kernels.room import SHORT_OF, VIEW_ROOM
from sim.kernels.trail import SEEN_BEHIND
from sim.kernels.views import VIEW_DIRECTIONS
from sim.lidar import ray_angles


def seen_known(
    views: Sequence[PlainView],
    ranges: NDArray[np.float64],
    pose: Sequence[float],
    target: Sequence[float],
    part: KnownPart,
    lidar: LidarConfig,
) -> NDArray[np.float64]:
    """Since when a robot at a pose knows what it sees, given its views and its scan, metres: a part's numbers.

    Returns:
        (2 * sectors,), or (3 * sectors,) with progress.
    """
    age, nearness, progress = np.zeros((3, part.sectors))
    angles = wrapped(ray_angles(lidar) + lidar.mount.places[0][2])
    sectors = np.minimum((angles + math.pi) / math.tau * part.sectors + SECTOR_EDGE, part.sectors - 1).astype(int)
    views = views[-VIEW_ROOM:]
    for sector in range(part.sectors):
        rays = np.flatnonzero(sectors == sector)
        if not len(rays):
            continue
        ray = rays[ranges[rays].argmax()]
        ahead = max(ranges[ray] - SHORT_OF, 0.5 * ranges[ray])
        x, y = (pose[k] + ahead * turn(angles[ray] + pose[2]) for k, turn in enumerate((math.cos, math.sin)))
        distances = np.array([math.dist(view.place, (x, y)) for view in views])
        shown = [number for number, view in enumerate(views) if _shows(view, x, y, lidar.range)]
        followed = len(views) - 1 - shown[0] if shown else 0
        age[sector] = 1.0 - math.log(1.0 + followed) / math.log(1.0 + VIEW_ROOM)
        nearness[sector] = max(1.0 - distances.min(initial=math.inf) / lidar.range, 0.0)
        progress[sector] = (math.dist(pose[:2], target) - math.dist((x, y), target)) / lidar.range
    return np.concatenate([age, nearness, *[progress][: part.progress]])


def _shows(view: PlainView, x: float, y: float, limit: float) -> bool:
    """Whether a place was in sight in a view."""
    distance = math.dist(view.place, (x, y))
    direction = math.atan2(y - view.place[1], x - view.place[0])
    k = min(int((direction + math.pi) / math.tau * VIEW_DIRECTIONS), VIEW_DIRECTIONS - 1)
    return distance < limit and bool(distance < view.readings[k] + SEEN_BEHIND)

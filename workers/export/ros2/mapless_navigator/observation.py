"""Makes the policy's observation from a scan, a pose and a target: the numbers that the simulator gave it in training.

| part                   | its numbers, newest moment                                                 |
|------------------------|----------------------------------------------------------------------------|
| `ranges`               | nearest ray of each batch / range                                          |
| `inverse_ranges`       | near / max(nearest ray of each batch, near)                                |
| `speeds`               | each velocity, or the steering angle, in the last step / its limit         |
| `actions`              | the same as it was commanded last                                          |
| `distance`             | d / (d + 1), d the distance to the target                                  |
| `distance_of_diagonal` | d / diagonal of the arena                                                  |
| `direction`            | (direction mod 2 pi) / 2 pi                                                |
| `bearing`              | bearing / pi (target against heading, left +)                              |
| `bearing_sine_cosine`  | sine and cosine of the bearing                                             |
| `heading`              | heading / pi                                                               |
| `heading_turn`         | (heading mod 2 pi) / 2 pi                                                  |
| `deviation`            | |bearing| / pi                                                             |
| `trail`, `long_trail`  | where it has been, see `trail.py`: whoever calls brings them along         |
| `known`, `known_progress` | since when it knows what it sees, see `views.py`: likewise              |
| `openings`             | which openings it had better look into, see `openings.py`: likewise        |
| `dwell`                | how long it has stayed about where it is, see `dwell.py`: likewise         |
| `way`                  | how much of the straight way is free, and whether all of it is, see `free_way` |
| `reach`                | near / (near + how far it could go straight on), all around, see `reach`   |
| `reach_progress`       | the same, and how much nearer to the target / range that would bring it    |
| `extension.part`       | what an extension's code makes: whoever calls brings them along            |

Rays go from right to left, of one LiDAR after the other. Poses and targets stand in one fixed frame (the odometry's), whose
x axis is heading 0.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .policy import Floats, Part, PolicyFileError, Specification

Reals = NDArray[np.float64]

READ_OFF_SCAN = ("ranges", "inverse_ranges", "reach")
"""Kinds of parts that nothing else is needed for."""

_TURN = 2.0 * np.pi

DIRECTIONS = 4
"""Of each sector of what is seen of the reach."""


def wrap(angles: ArrayLike) -> Reals:
    """Angles in [-pi, pi)."""
    wrapped: Reals = (np.asarray(angles, np.float64) + np.pi) % _TURN - np.pi
    return wrapped


def ray_angles(specification: Specification) -> Reals:
    """Angles of the policy's rays against where a LiDAR looks, (rays,) radians, from right to left.

    The first and the last stand on the edges of the field of view; in a full circle, where both edges are one direction, the
    last is left out.
    """
    half = specification.field_of_view / 2.0
    full = specification.field_of_view >= _TURN - 1e-9
    return np.linspace(-half, half, specification.rays, endpoint=not full)


def observe(
    specification: Specification,
    ranges: ArrayLike,
    poses: ArrayLike,
    targets: ArrayLike,
    last_actions: ArrayLike,
    speeds: ArrayLike | None = None,
    *,
    added: Mapping[str, ArrayLike] | None = None,
) -> Floats:
    """What n robots see at one moment: the whole observation where nothing earlier is seen, else see `Frames`.

    Args:
        specification: the policy's.
        ranges: (n, scan) metres along `ray_angles` of each LiDAR, at most the policy's range.
        poses: (n, 3) x, y in metres and heading in radians.
        targets: (n, 2) x, y in metres, in the same frame.
        last_actions: (n, A) what was last commanded, as fractions of the limits.
        speeds: (n, A) velocities (or the steering angle) in the last step, likewise; those last commanded where not given.
        added: the numbers (n, size) of each part that an extension makes, by its kind, of its trail (`Trail.see`),
            of its views (`Views.see`), of its openings (`Openings.see`) and of its stay (`Dwell.see`);
            `manifest.json` explains them.

    Returns:
        (n, numbers of the newest moment).

    Raises:
        PolicyFileError: the policy remembers its way or sees a part of an extension, and the numbers are not given.
    """
    refuse_unknown(specification, () if added is None else tuple(added))
    pose, target = np.asarray(poses, np.float64), np.asarray(targets, np.float64)
    offset = target - pose[:, :2]
    distance = np.hypot(offset[:, 0], offset[:, 1])
    direction = np.arctan2(offset[:, 1], offset[:, 0])
    heading = wrap(pose[:, 2])
    bearing = wrap(direction - heading)
    told = {
        "speeds": np.asarray(last_actions if speeds is None else speeds, np.float64),
        "actions": np.asarray(last_actions, np.float64),
        "distance": distance / (distance + 1.0),
        "distance_of_diagonal": distance / specification.diagonal,
        "direction": direction % _TURN / _TURN,
        "bearing": bearing / np.pi,
        "bearing_sine_cosine": np.stack((np.sin(bearing), np.cos(bearing)), axis=1),
        "heading": heading / np.pi,
        "heading_turn": heading % _TURN / _TURN,
        "deviation": np.abs(bearing) / np.pi,
    }
    told |= {kind: np.asarray(numbers, np.float64) for kind, numbers in (added or {}).items()}
    scan = np.asarray(ranges, np.float64)
    if any(part.kind == "way" for part in specification.parts):
        told["way"] = free_way(specification, scan, bearing, distance)
    for part in specification.parts:
        if part.kind == "reach_progress":
            told[part.kind] = reach_and_progress(specification, scan, bearing, distance, part.size // 2)
    columns = [
        _seen(specification, part, scan) if part.kind in READ_OFF_SCAN else told[part.kind] for part in specification.parts
    ]
    return np.concatenate([column.reshape(len(pose), -1) for column in columns], axis=1).astype(np.float32)


def refuse_unknown(specification: Specification, known: tuple[str, ...] = ()) -> None:
    """Refuse a policy that sees what this program can't make.

    Args:
        specification: the policy's.
        known: kinds of the parts that the caller makes.

    Raises:
        PolicyFileError: there is such a part; says which.
    """
    for part in specification.parts:
        if part.remembered_by and part.kind not in known:
            name = part.remembered_by
            raise PolicyFileError(
                f"this policy remembers its way: give what {name.title()}.see of {name}.py tells to "
                f"observe(added={{{part.kind!r}: [numbers]}})"
            )
        if part.added and part.kind not in known:
            raise PolicyFileError(
                f"this policy sees {part.kind!r}, {part.size} number{'s'[: part.size != 1]} that code of the extension "
                f"{part.kind.partition('.')[0]!r} makes, which is not in this program (manifest.json "
                "explains extension and numbers): give them to observe(added=...), or to Navigator(make_added=...)"
            )


def free_way(specification: Specification, scan: Reals, bearing: Reals, distance: Reals) -> Reals:
    """How much of the straight way to where it has arrived a robot sees to be free, and whether all of it is.

    In the way is what a ray meets less than `near` aside of it; beyond the range nothing is known to be free.

    Args:
        specification: the policy's.
        scan: (n, scan) metres.
        bearing: (n,) radians, of the target against the heading.
        distance: (n,) metres.

    Returns:
        (n, 2) from 0 to 1, and 0 or 1.
    """
    x, y = _ends(specification, scan)
    cos, sin = np.cos(bearing)[:, None], np.sin(bearing)[:, None]
    along, across = x * cos + y * sin, y * cos - x * sin
    meets = (scan < specification.range) & (along >= 0.0) & (np.abs(across) < specification.near)
    length = np.maximum(distance - specification.arrival_distance, 0.0)
    free = np.minimum(np.where(meets, along, specification.range).min(axis=1), np.minimum(length, specification.range))
    share = np.divide(free, length, out=np.ones_like(length), where=length > 0.0)
    return np.stack((share, free >= length), axis=1)


def reach(specification: Specification, scan: Reals, sectors: int) -> Reals:
    """How far a robot could go straight on before a reading ends less than `near` from its middle.

    Args:
        specification: the policy's.
        scan: (n, scan) metres.
        sectors: of the full turn around it.

    Returns:
        (n, sectors, 4) metres in the directions of each sector, at most the LiDAR's range; from right to left, beginning
        behind it.
    """
    x, y = (values[:, None] for values in _ends(specification, scan))
    near, directions = specification.near, reach_directions(sectors)[:, None]
    along, across = x * np.cos(directions) + y * np.sin(directions), y * np.cos(directions) - x * np.sin(directions)
    until = np.maximum(along - np.sqrt(np.maximum(near**2 - across**2, 0.0)), 0.0)
    meets = (scan < specification.range)[:, None] & (along > 0.0) & (np.abs(across) < near)
    free: Reals = np.where(meets, until, specification.range).min(axis=2)
    return free.reshape(len(scan), sectors, DIRECTIONS)


def reach_and_progress(specification: Specification, scan: Reals, bearing: Reals, distance: Reals, sectors: int) -> Reals:
    """How far a robot could go, and how much nearer to its target that would bring it: what `reach_progress` tells.

    Args:
        specification: the policy's.
        scan: (n, scan) metres.
        bearing: (n,) radians, of the target against the heading.
        distance: (n,) metres.
        sectors: of the full turn around it.

    Returns:
        (n, 2 * sectors): from 0 to 1 of the farthest of four directions, from -1 to 1 of that which brings it nearest.
    """
    free = reach(specification, scan, sectors)
    directions = reach_directions(sectors).reshape(sectors, DIRECTIONS)
    to_x, to_y = (distance * np.cos(bearing))[:, None, None], (distance * np.sin(bearing))[:, None, None]
    left = np.hypot(to_x - free * np.cos(directions), to_y - free * np.sin(directions))
    progress = (distance[:, None] - left.min(axis=2)) / specification.range
    return np.concatenate((specification.near / (specification.near + free.max(axis=2)), progress), axis=1)


def reach_directions(sectors: int) -> Reals:
    """Directions of which the reach is told, (4 * sectors,) radians against the heading, from right to left."""
    count = sectors * DIRECTIONS
    directions: Reals = ((np.arange(count) + 0.5) / count - 0.5) * _TURN
    return directions


def _ends(specification: Specification, scan: Reals) -> tuple[Reals, Reals]:
    """Where readings end, x and y (n, scan) metres in the robot's frame."""
    mounts = np.repeat(np.asarray(specification.mounts, np.float64), specification.rays, axis=0)
    angles = np.tile(ray_angles(specification), len(specification.mounts)) + mounts[:, 2]
    return mounts[:, 0] + scan * np.cos(angles), mounts[:, 1] + scan * np.sin(angles)


def _seen(specification: Specification, part: Part, scan: Reals) -> Reals:
    """A scan (n, rays) as the policy sees it, (n, numbers of the part)."""
    if part.kind == "reach":
        farthest: Reals = reach(specification, scan, part.size).max(axis=2)
        return specification.near / (specification.near + farthest)
    nearest: Reals = scan.reshape(len(scan), part.size, -1).min(axis=2)
    if part.kind == "ranges":
        return nearest / specification.range
    return specification.near / np.maximum(nearest, specification.near)


class Frames:
    """Puts what was seen at earlier moments behind the newest; a way begins with its first moment repeated.

    Args:
        specification: the policy's.
    """

    def __init__(self, specification: Specification) -> None:
        self._repeated, self._carried = list(specification.repeated), list(specification.carried)
        self._last: Floats | None = None

    def push(self, newest: Floats) -> Floats:
        """The observation (n, size) after the newest moment (n, its numbers), one control period after the last."""
        earlier = newest[:, self._repeated] if self._last is None else self._last[:, self._carried]
        self._last = np.concatenate((newest, earlier), axis=1)
        return self._last

    def clear(self) -> None:
        """Forget what was seen: a new way begins."""
        self._last = None


@dataclass(frozen=True)
class Scan:
    """A sensor's scan as it comes, in the terms of ROS's `sensor_msgs/LaserScan`.

    Attributes:
        angle_min: of the first beam against the sensor's x axis, radians.
        angle_increment: between two beams, radians; negative for a sensor that turns to the right.
        range_min, range_max: what the sensor can measure, metres.
        ranges: (beams,) metres.
    """

    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: Reals

    def angles(self, sensor_yaw: float) -> Reals:
        """Angles of the beams against the heading, (beams,), wrapped, for a sensor mounted at this yaw."""
        return wrap(self.angle_min + self.angle_increment * np.arange(len(self.ranges)) + sensor_yaw)

    def distances(self) -> Reals:
        """Distances that can be relied on, (beams,): infinite where nothing was hit, nan where nothing is known.

        As REP 117 has it: -inf is an object too near to be measured, and becomes 0; +inf, and what is beyond `range_max`, is
        free; nan, and a finite number below `range_min` (many sensors write 0 for a beam that did not return), is unknown.
        """
        ranges = np.asarray(self.ranges, np.float64)
        distances = np.where(ranges > self.range_max, np.inf, ranges)
        distances = np.where(ranges < self.range_min, np.nan, distances)
        return np.where(np.isneginf(ranges), 0.0, distances)


def resample(scan: Scan, specification: Specification, sensor_yaw: float, max_gap: float, lidar: int = 0) -> Reals:
    """The policy's rays (rays,), each the known beam nearest to it in angle, cut at the policy's range.

    Args:
        scan: the sensor's.
        specification: the policy's.
        sensor_yaw: of the sensor against the heading, radians.
        max_gap: largest angle between a ray and its beam, radians; a ray without a beam that near is nan.
        lidar: which of the policy's LiDARs the sensor stands for.
    """
    angles, distances = scan.angles(sensor_yaw), scan.distances()
    known = ~np.isnan(distances)
    rays = ray_angles(specification) + specification.mounts[lidar][2]
    if not known.any():
        return np.full(len(rays), np.nan)
    order = np.argsort(angles[known], kind="stable")
    angles, distances = angles[known][order], distances[known][order]
    # One beam more on either side closes the circle.
    angles = np.concatenate(([angles[-1] - _TURN], angles, [angles[0] + _TURN]))
    distances = np.concatenate(([distances[-1]], distances, [distances[0]]))
    wrapped = wrap(rays)
    right = np.clip(np.searchsorted(angles, wrapped), 1, len(angles) - 1)
    left = right - 1
    nearest = np.where(wrapped - angles[left] <= angles[right] - wrapped, left, right)
    ranges = np.minimum(distances[nearest], specification.range)
    return np.where(np.abs(angles[nearest] - wrapped) <= max_gap, ranges, np.nan)

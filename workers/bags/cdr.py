"""Reads those ROS 2 messages that a robot's drive is told by, from CDR as every ROS 2 recording has them.

The layouts are those of common_interfaces and geometry2, which have been the same since ROS 2 Foxy. Whatever bytes come in,
nothing is read beyond their end.
"""

import math
import struct
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workers.errors import BagError

_HEADER_BYTES = 4
_LITTLE_ENDIAN = 1
_MOST_TRANSFORMS = 1_000


@dataclass(frozen=True)
class Stamp:
    """A message's header: seconds since its clock's epoch, and the frame."""

    seconds: float
    frame: str


@dataclass(frozen=True, eq=False)
class LaserScan:
    """`sensor_msgs/LaserScan`, without intensities."""

    stamp: Stamp
    angle_min: float
    angle_increment: float
    range_min: float
    range_max: float
    ranges: NDArray[np.float32]


@dataclass(frozen=True)
class Pose:
    """x, y, z, and a quaternion x, y, z, w."""

    position: tuple[float, float, float]
    rotation: tuple[float, float, float, float]

    @property
    def yaw(self) -> float:
        """Heading, radians."""
        x, y, z, w = self.rotation
        return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


@dataclass(frozen=True)
class Velocities:
    """Forwards and to the left, m/s, and turning, rad/s."""

    forwards: float
    left: float
    turning: float


@dataclass(frozen=True)
class Odometry:
    """`nav_msgs/Odometry`, without covariances."""

    stamp: Stamp
    child_frame: str
    pose: Pose
    velocities: Velocities


@dataclass(frozen=True)
class Command:
    """`geometry_msgs/Twist` or `TwistStamped`; `stamp` is None for the former."""

    stamp: Stamp | None
    velocities: Velocities


@dataclass(frozen=True)
class Goal:
    """`geometry_msgs/PoseStamped`."""

    stamp: Stamp
    pose: Pose


@dataclass(frozen=True)
class Transform:
    """One of a `tf2_msgs/TFMessage`: how `child` stands in the stamp's frame."""

    stamp: Stamp
    child: str
    pose: Pose


class _Reader:
    """The bytes of one message, from its beginning.

    Raises:
        BagError: they are not CDR, or end too early.
    """

    def __init__(self, data: bytes) -> None:
        if len(data) < _HEADER_BYTES or data[0] != 0 or data[1] not in (0, 1):
            raise BagError("a message is not written in plain CDR: record it with ROS 2")
        self._order = "<" if data[1] == _LITTLE_ENDIAN else ">"
        self._data = memoryview(data)[_HEADER_BYTES:]
        self._at = 0

    def _take(self, size: int, alignment: int) -> memoryview:
        start = -(-self._at // alignment) * alignment
        if size < 0 or start + size > len(self._data):
            raise BagError("a message ends too early: the recording is damaged")
        self._at = start + size
        return self._data[start : start + size]

    def _number(self, code: str, size: int) -> float:
        (found,) = struct.unpack(self._order + code, self._take(size, size))
        return found  # type: ignore[no-any-return]

    def count(self) -> int:
        """A uint32."""
        return int(self._number("I", 4))

    def text(self) -> str:
        """A string: its length with the zero at its end, then its bytes."""
        return bytes(self._take(self.count(), 1)).rstrip(b"\0").decode(errors="replace")

    def singles(self, count: int) -> NDArray[np.float32]:
        """float32 numbers."""
        return np.frombuffer(self._take(4 * count, 4), f"{self._order}f4").astype(np.float32)

    def doubles(self, count: int) -> tuple[float, ...]:
        """float64 numbers."""
        return struct.unpack(f"{self._order}{count}d", self._take(8 * count, 8))

    def stamp(self) -> Stamp:
        """A `std_msgs/Header`."""
        seconds, nanoseconds = self._number("i", 4), self.count()
        return Stamp(seconds + 1e-9 * nanoseconds, self.text())

    def pose(self) -> Pose:
        """A `geometry_msgs/Pose`, or a `Transform`, which is laid out likewise."""
        x, y, z, qx, qy, qz, qw = self.doubles(7)
        return Pose((x, y, z), (qx, qy, qz, qw))

    def velocities(self) -> Velocities:
        """A `geometry_msgs/Twist`."""
        forwards, left, _, _, _, turning = self.doubles(6)
        return Velocities(forwards, left, turning)


def laser_scan(data: bytes) -> LaserScan:
    """A `sensor_msgs/LaserScan`."""
    reader = _Reader(data)
    stamp = reader.stamp()
    angle_min, _, increment, _, _, range_min, range_max = reader.singles(7).tolist()
    return LaserScan(stamp, angle_min, increment, range_min, range_max, reader.singles(reader.count()))


def odometry(data: bytes) -> Odometry:
    """A `nav_msgs/Odometry`."""
    reader = _Reader(data)
    stamp, child, pose = reader.stamp(), reader.text(), reader.pose()
    reader.doubles(36)
    return Odometry(stamp, child, pose, reader.velocities())


def twist(data: bytes) -> Command:
    """A `geometry_msgs/Twist`."""
    return Command(None, _Reader(data).velocities())


def stamped_twist(data: bytes) -> Command:
    """A `geometry_msgs/TwistStamped`."""
    reader = _Reader(data)
    return Command(reader.stamp(), reader.velocities())


def stamped_pose(data: bytes) -> Goal:
    """A `geometry_msgs/PoseStamped`."""
    reader = _Reader(data)
    return Goal(reader.stamp(), reader.pose())


def transforms(data: bytes) -> list[Transform]:
    """A `tf2_msgs/TFMessage`."""
    reader = _Reader(data)
    count = reader.count()
    if count > _MOST_TRANSFORMS:
        raise BagError("a message of transforms is longer than any robot's: the recording is damaged")
    return [Transform(reader.stamp(), reader.text(), reader.pose()) for _ in range(count)]


COMMANDS: dict[str, Callable[[bytes], Command]] = {
    "geometry_msgs/msg/Twist": twist,
    "geometry_msgs/msg/TwistStamped": stamped_twist,
}
"""What tells a command, by the messages' type."""

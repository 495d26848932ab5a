"""An episode as ROS 2 messages in an MCAP file, as a robot would have recorded it: Foxglove opens it, ROS plays it.

| topic       | message                      | frames |
|-------------|------------------------------|--------|
| `/scan`     | sensor_msgs/LaserScan        | `base_scan`; a second LiDAR is `/scan2` in `base_scan2` |
| `/odom`     | nav_msgs/Odometry            | `odom`, which is the arena's own, to `base_link` |
| `/cmd_vel`  | geometry_msgs/TwistStamped   | `base_link`: what was asked for, when it was |
| `/goal_pose`| geometry_msgs/PoseStamped    | `odom`, once |
| `/tf`       | tf2_msgs/TFMessage           | `odom` to `base_link`, `base_link` to each LiDAR |

Of several policies each has its own, below `/policy1`, `/policy2`, and so on, its frames likewise.
"""

import io
import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from mcap_ros2.writer import Writer
from numpy.typing import NDArray

from sim.actions import action_layout
from sim.config import AckermannDrive, LidarConfig, TaskConfig
from sim.lidar import ray_angles
from workers.replays.recording import Track

# A stamp of zero asks TF for the newest transform: the first moment is a second after it.
_START_SECONDS = 1
_NANOSECONDS = 10**9
# What a ray that meets nothing measures, by REP 117.
_NOTHING = math.inf
_NOTHING_WITHIN = 1e-3

_SEPARATOR = "=" * 80
_HEADER = f"""{_SEPARATOR}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_SEPARATOR}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
_VECTOR = f"""{_SEPARATOR}
MSG: geometry_msgs/Vector3
float64 x
float64 y
float64 z
"""
_QUATERNION = f"""{_SEPARATOR}
MSG: geometry_msgs/Quaternion
float64 x
float64 y
float64 z
float64 w
"""
_POSE = f"""{_SEPARATOR}
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
{_SEPARATOR}
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
{_QUATERNION}"""
_TWIST = f"""{_SEPARATOR}
MSG: geometry_msgs/Twist
geometry_msgs/Vector3 linear
geometry_msgs/Vector3 angular
{_VECTOR}"""
_DEFINITIONS = {
    "sensor_msgs/msg/LaserScan": f"""std_msgs/Header header
float32 angle_min
float32 angle_max
float32 angle_increment
float32 time_increment
float32 scan_time
float32 range_min
float32 range_max
float32[] ranges
float32[] intensities
{_HEADER}""",
    "nav_msgs/msg/Odometry": f"""std_msgs/Header header
string child_frame_id
geometry_msgs/PoseWithCovariance pose
geometry_msgs/TwistWithCovariance twist
{_HEADER}{_SEPARATOR}
MSG: geometry_msgs/PoseWithCovariance
geometry_msgs/Pose pose
float64[36] covariance
{_POSE}{_SEPARATOR}
MSG: geometry_msgs/TwistWithCovariance
geometry_msgs/Twist twist
float64[36] covariance
{_TWIST}""",
    "geometry_msgs/msg/TwistStamped": f"""std_msgs/Header header
geometry_msgs/Twist twist
{_HEADER}{_TWIST}""",
    "geometry_msgs/msg/PoseStamped": f"""std_msgs/Header header
geometry_msgs/Pose pose
{_HEADER}{_POSE}""",
    "tf2_msgs/msg/TFMessage": f"""geometry_msgs/TransformStamped[] transforms
{_SEPARATOR}
MSG: geometry_msgs/TransformStamped
std_msgs/Header header
string child_frame_id
geometry_msgs/Transform transform
{_SEPARATOR}
MSG: geometry_msgs/Transform
geometry_msgs/Vector3 translation
geometry_msgs/Quaternion rotation
{_HEADER}{_VECTOR}{_QUATERNION}""",
}


@dataclass(frozen=True, eq=False)
class Driven:
    """Who drove, with which robot and LiDAR, and what it did."""

    title: str
    task: TaskConfig
    track: Track


def as_mcap(driven: Sequence[Driven], suite: str, episode: int, progress: Callable[[float], None]) -> bytes:
    """The file; takes about a millisecond for each moment.

    Args:
        driven: all who drove.
        suite: its name.
        episode: its place in the suite, from 0.
        progress: told the share of the work that is done, 0 to 1.
    """
    file = io.BytesIO()
    with Writer(file) as writer:
        schemas = {name: writer.register_msgdef(name, text) for name, text in _DEFINITIONS.items()}
        for number, each in enumerate(driven, 1):
            robot = _Robot(writer, schemas, each.task, f"policy{number}" if len(driven) > 1 else "")
            for share in robot.write(each.track):
                progress((number - 1 + share) / len(driven))
        writer.add_metadata(
            "mapless",
            {"suite": suite, "episode": str(episode + 1)}
            | {f"policy{number}": each.title for number, each in enumerate(driven, 1)},
        )
    return file.getvalue()


class _Robot:
    """Writes what one robot would have recorded.

    Args:
        writer: of the file.
        schemas: by name.
        task: robot and LiDAR.
        name: of its topics and frames; empty where it is alone.
    """

    def __init__(self, writer: Writer, schemas: dict[str, Any], task: TaskConfig, name: str) -> None:
        self._writer = writer
        self._schemas = schemas
        self._task = task
        self._below = f"/{name}" if name else ""
        self._prefix = f"{name}/" if name else ""

    def write(self, track: Track) -> Iterator[float]:
        """All of it, moment by moment; gives the share that is written."""
        period, last = self._task.control_period, len(track.poses) - 1
        self._send(
            "goal_pose",
            "geometry_msgs/msg/PoseStamped",
            0.0,
            "odom",
            pose=_pose(float(track.target[0]), float(track.target[1]), 0.0),
        )
        for moment in range(last + 1):
            seconds = moment * period
            x, y, heading = track.poses[moment].tolist()
            self._transforms(seconds, x, y, heading)
            self._scans(seconds, track.ranges[moment], float(track.fields_of_view[moment]))
            self._send(
                "odom",
                "nav_msgs/msg/Odometry",
                seconds,
                "odom",
                child_frame_id=f"{self._prefix}base_link",
                pose={"pose": _pose(x, y, heading), "covariance": [0.0] * 36},
                twist={"twist": _twist(*track.twists[moment].tolist()), "covariance": [0.0] * 36},
            )
            yield moment / (last + 1)
            if moment < last:
                # A moment's command is the one of the step that led there: it was given at the moment before.
                command = _twist(*self._commanded(track.commands[moment + 1]))
                self._send("cmd_vel", "geometry_msgs/msg/TwistStamped", seconds, "base_link", twist=command)

    def _scans(self, seconds: float, ranges: NDArray[np.float32], field_of_view: float) -> None:
        lidar = self._task.lidar
        angles = ray_angles(lidar) * (field_of_view / lidar.field_of_view)
        for number, own in enumerate(ranges.reshape(-1, lidar.rays), 1):
            measured = np.where(own < lidar.range - _NOTHING_WITHIN, own, _NOTHING)
            self._send(
                "scan" if number == 1 else f"scan{number}",
                "sensor_msgs/msg/LaserScan",
                seconds,
                _scan_frame(number),
                angle_min=float(angles[0]),
                angle_max=float(angles[-1]),
                angle_increment=float(angles[1] - angles[0]) if len(angles) > 1 else 0.0,
                time_increment=0.0,
                scan_time=self._task.control_period,
                range_min=0.0,
                range_max=lidar.range,
                ranges=measured.tolist(),
                intensities=[],
            )

    def _transforms(self, seconds: float, x: float, y: float, heading: float) -> None:
        mounts = _mounts(self._task.lidar)
        found = [("odom", "base_link", x, y, heading)]
        found += [("base_link", _scan_frame(number), *place) for number, place in enumerate(mounts, 1)]
        transforms = [
            {
                "header": self._header(seconds, parent),
                "child_frame_id": f"{self._prefix}{child}",
                "transform": {"translation": _vector(ahead, aside), "rotation": _rotation(turn)},
            }
            for parent, child, ahead, aside, turn in found
        ]
        self._write("/tf", "tf2_msgs/msg/TFMessage", seconds, {"transforms": transforms})

    def _commanded(self, command: NDArray[np.float32]) -> tuple[float, float, float]:
        """Speeds forwards and to the left, m/s, and turning rate, rad/s, that were asked for."""
        drive, names = self._task.robot.drive, action_layout(self._task.robot).names
        asked = dict(zip(names, command.tolist(), strict=True))
        if isinstance(drive, AckermannDrive):
            return asked["linear"], 0.0, asked["linear"] * math.tan(asked["steering"]) / drive.wheel_base
        return asked["linear"], asked.get("lateral", 0.0), asked["angular"]

    def _header(self, seconds: float, frame: str) -> dict[str, Any]:
        whole, nanoseconds = divmod(_stamp(seconds), _NANOSECONDS)
        return {"stamp": {"sec": whole, "nanosec": nanoseconds}, "frame_id": f"{self._prefix}{frame}"}

    def _send(self, topic: str, schema: str, seconds: float, frame: str, **fields: object) -> None:
        self._write(f"{self._below}/{topic}", schema, seconds, {"header": self._header(seconds, frame), **fields})

    def _write(self, topic: str, schema: str, seconds: float, message: dict[str, Any]) -> None:
        self._writer.write_message(topic, self._schemas[schema], message, log_time=_stamp(seconds))


def _stamp(seconds: float) -> int:
    """Nanoseconds, to a whole microsecond."""
    return (_START_SECONDS * 10**6 + round(seconds * 1e6)) * 1_000


def _scan_frame(number: int) -> str:
    return "base_scan" if number == 1 else f"base_scan{number}"


def _mounts(lidar: LidarConfig) -> list[tuple[float, float, float]]:
    return [(float(x), float(y), float(yaw)) for x, y, yaw in lidar.mount.places]


def _vector(x: float, y: float, z: float = 0.0) -> dict[str, float]:
    return {"x": float(x), "y": float(y), "z": z}


def _rotation(heading: float) -> dict[str, float]:
    return {"x": 0.0, "y": 0.0, "z": math.sin(heading / 2.0), "w": math.cos(heading / 2.0)}


def _pose(x: float, y: float, heading: float) -> dict[str, Any]:
    return {"position": _vector(x, y), "orientation": _rotation(heading)}


def _twist(forwards: float, left: float, turning: float) -> dict[str, Any]:
    return {"linear": _vector(forwards, left), "angular": _vector(0.0, 0.0, turning)}

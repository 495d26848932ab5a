"""Recordings of robots that our own simulator drives, of which everything is known."""

import io
import math
import sqlite3
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from mcap.reader import make_reader
from mcap.writer import CompressionType
from mcap_ros2.writer import Writer
from numpy.typing import NDArray

from sim.actions import action_layout
from sim.config import TaskConfig
from sim.envs.vector import NavigationVectorEnv
from sim.lidar import ray_angles
from workers.bags.read import Bag, Commands, Motion, Scans

Reals = NDArray[np.float64]

_COLLISION = 2
_STANDS, _DRIVES = 6.0, 8.0
"""Seconds that a robot stands at first, and between two pauses."""


@dataclass(frozen=True, eq=False)
class Drive:
    """What a robot did: moments a control period apart.

    Attributes:
        task: with which.
        times: (n,) seconds.
        poses: (n, 3).
        twists: (n, 3) in the step that led there.
        commands: (n - 1, 3) given at each moment but the last.
        scan_times: (s,) of its scans.
        ranges: (s, rays) inf where nothing was met.
        goals: (k, 3) time, x and y.
    """

    task: TaskConfig
    times: Reals
    poses: Reals
    twists: Reals
    commands: Reals
    scan_times: Reals
    ranges: NDArray[np.float32]
    goals: Reals

    def bag(self) -> Bag:
        """As it is read."""
        lidar = self.task.lidar
        return Bag(
            scans=Scans(self.scan_times, self.ranges, ray_angles(lidar), 0.0, lidar.range, (0.0, 0.0)),
            motion=Motion(self.times, np.column_stack((self.poses[:, :2], np.unwrap(self.poses[:, 2]))), self.twists),
            commands=Commands(self.times[:-1], self.commands),
            goals=self.goals,
            seconds=float(self.times[-1]),
            topics=(),
            notes=(),
        )


def simulated(
    *,
    seconds: float = 60.0,
    seed: int = 0,
    jitter: float = 0.0,
    speed_noise: float = 0.0,
    rests: bool = True,
    **task: Any,
) -> Drive:
    """Drive a robot by made-up commands, now and then standing.

    Args:
        seconds: that it lasts.
        seed: of commands and disturbances.
        jitter: standard deviation of a scan's stamp, seconds.
        speed_noise: of the measured velocities, as a share of the limits.
        rests: whether it stands at first, and now and then.
        task: in which it differs from the default one.
    """
    for attempt in range(100):
        found = _drive(TaskConfig.model_validate({"step_limit": 10_000, **task}), seconds, (seed, attempt), rests)
        if found is not None:
            break
    else:
        raise AssertionError("this robot collides whatever it does")
    generator = np.random.default_rng((seed, 1_000))
    limits = np.array([found.task.robot.max_linear_speed, 0.0, found.task.robot.max_angular_speed])
    return Drive(
        **{
            **vars(found),
            "twists": found.twists + speed_noise * limits * generator.standard_normal(found.twists.shape),
            "scan_times": found.scan_times + jitter * generator.standard_normal(len(found.scan_times)),
        }
    )


def recorded(
    env: NavigationVectorEnv, act: Callable[[], NDArray[np.float32]], step: Callable[[NDArray[np.float32]], None], steps: int
) -> Drive:
    """What the robot of an environment does by actions (1, A) of the limits; ends where it collides."""
    task = env.task
    period, limits = task.control_period, np.array(action_layout(task.robot).limits)
    poses, twists, commands, ranges = [], [], [], []
    goals: list[tuple[float, float, float]] = []
    for number in range(steps + 1):
        scan = env.ranges[0].copy()
        poses.append(env.poses[0].astype(float))
        twists.append(env._world.twists()[0].astype(float) if number else np.zeros(3))
        ranges.append(np.where(scan < task.lidar.range - 1e-3, scan, np.inf))
        x, y = env.targets[0].tolist()
        if not goals or goals[-1][1:] != (x, y):
            goals.append((number * period, x, y))
        if number == steps:
            break
        action = act()
        commands.append((action[0, 0] * limits[0], 0.0, action[0, 1] * limits[1]))
        step(action)
        assert env.outcomes[0] != _COLLISION
    times = period * np.arange(steps + 1, dtype=np.float64)
    scans = np.array(ranges, np.float32)
    return Drive(task, times, np.array(poses), np.array(twists), np.array(commands), times, scans, np.array(goals))


def _drive(task: TaskConfig, seconds: float, seed: tuple[int, int], rests: bool) -> Drive | None:
    """None where it collides."""
    generator = np.random.default_rng(seed)
    period, lidar = task.control_period, task.lidar
    env = NavigationVectorEnv(task, 1, seed=seed[0] * 1_000 + seed[1])
    env.reset()
    every = max(1, int(1.0 / (lidar.rate * period) + 0.5)) if lidar.rate else 1
    limits = np.array(action_layout(task.robot).limits)
    action, held = np.zeros(2, np.float32), 0.0
    poses, twists, commands, scan_times, ranges = [], [], [], [], []
    goals: list[tuple[float, float, float]] = []
    count = round(seconds / period)
    ahead = np.abs(ray_angles(lidar)) < 0.6
    for step in range(count + 1):
        at = step * period
        scan = env.ranges[0].copy()
        poses.append(env.poses[0].astype(float))
        twists.append(env._world.twists()[0].astype(float) if step else np.zeros(3))
        if step % every == 0:
            scan_times.append(at)
            ranges.append(np.where(scan < lidar.range - 1e-3, scan, np.inf))
        target = env.targets[0].tolist()
        if not goals or not np.allclose(goals[-1][1:], target):
            goals.append((at, float(target[0]), float(target[1])))
        if step == count:
            break
        held -= period
        if held <= 0.0:
            held = generator.uniform(0.4, 2.0)
            action = np.array([generator.choice([0.0, 0.3, 0.6, 1.0]), generator.uniform(-1.0, 1.0)], np.float32)
        if np.sort(scan[ahead])[1] < 0.7:
            action[0] = 0.0
            action[1] = 0.8 if abs(action[1]) < 0.2 else action[1]
        sent = np.zeros_like(action) if rests and at % (_STANDS + _DRIVES) < _STANDS else action
        commands.append((sent[0] * limits[0], 0.0, sent[1] * limits[1]))
        env.step(sent[None].copy())
        if env.outcomes[0] == _COLLISION:
            return None
    return Drive(
        task,
        period * np.arange(count + 1, dtype=np.float64),
        np.array(poses),
        np.array(twists),
        np.array(commands),
        np.array(scan_times),
        np.array(ranges, np.float32),
        np.array(goals),
    )


_SEPARATOR = "=" * 80
_STAMPED = f"""{_SEPARATOR}
MSG: std_msgs/Header
builtin_interfaces/Time stamp
string frame_id
{_SEPARATOR}
MSG: builtin_interfaces/Time
int32 sec
uint32 nanosec
"""
_VECTOR = f"{_SEPARATOR}\nMSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"
_ROTATION = f"{_SEPARATOR}\nMSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n"
_POSE = f"""{_SEPARATOR}
MSG: geometry_msgs/Pose
geometry_msgs/Point position
geometry_msgs/Quaternion orientation
{_SEPARATOR}
MSG: geometry_msgs/Point
float64 x
float64 y
float64 z
{_ROTATION}"""
_TWIST = f"{_SEPARATOR}\nMSG: geometry_msgs/Twist\ngeometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n{_VECTOR}"
DEFINITIONS = {
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
{_STAMPED}""",
    "nav_msgs/msg/Odometry": f"""std_msgs/Header header
string child_frame_id
geometry_msgs/PoseWithCovariance pose
geometry_msgs/TwistWithCovariance twist
{_STAMPED}{_SEPARATOR}
MSG: geometry_msgs/PoseWithCovariance
geometry_msgs/Pose pose
float64[36] covariance
{_POSE}{_SEPARATOR}
MSG: geometry_msgs/TwistWithCovariance
geometry_msgs/Twist twist
float64[36] covariance
{_TWIST}""",
    "geometry_msgs/msg/Twist": f"geometry_msgs/Vector3 linear\ngeometry_msgs/Vector3 angular\n{_VECTOR}",
    "geometry_msgs/msg/TwistStamped": f"std_msgs/Header header\ngeometry_msgs/Twist twist\n{_STAMPED}{_TWIST}",
    "geometry_msgs/msg/PoseStamped": f"std_msgs/Header header\ngeometry_msgs/Pose pose\n{_STAMPED}{_POSE}",
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
{_STAMPED}{_VECTOR}{_ROTATION}""",
    "std_msgs/msg/String": "string data\n",
}
EPOCH = 1_700_000_000.0
"""Of the recorder's clock where a drive begins."""

Sent = tuple[str, str, float, dict[str, Any]]
"""Topic, type, seconds and fields of a message."""


def header(at: float, frame: str) -> dict[str, Any]:
    """A `std_msgs/Header`."""
    nanoseconds = round((EPOCH + at) * 1e9)
    return {"stamp": {"sec": nanoseconds // 10**9, "nanosec": nanoseconds % 10**9}, "frame_id": frame}


def vector(x: float, y: float, z: float = 0.0) -> dict[str, float]:
    """A `geometry_msgs/Vector3` or a `Point`."""
    return {"x": float(x), "y": float(y), "z": float(z)}


def rotation(yaw: float, *, upside_down: bool = False) -> dict[str, float]:
    """A heading as a quaternion; upside down it is turned about its x axis before."""
    cos, sin = math.cos(yaw / 2.0), math.sin(yaw / 2.0)
    return {"x": cos, "y": sin, "z": 0.0, "w": 0.0} if upside_down else {"x": 0.0, "y": 0.0, "z": sin, "w": cos}


def messages(drive: Drive, *, stamped: bool = False, yaw: float = 0.0, upside_down: bool = False) -> Iterator[Sent]:
    """What a robot would have recorded of a drive.

    Args:
        drive: that is recorded.
        stamped: whether its commands are `TwistStamped`.
        yaw: of the LiDAR on the robot, by which its beams' own angles are turned back.
        upside_down: whether the LiDAR hangs, so that its beams go round the other way.
    """
    mount = {"translation": vector(0.0, 0.0, 0.2), "rotation": rotation(yaw, upside_down=upside_down)}
    edge = {"header": header(0.0, "base_link"), "child_frame_id": "laser", "transform": mount}
    yield "/tf_static", "tf2_msgs/msg/TFMessage", 0.0, {"transforms": [edge]}
    yield "/chatter", "std_msgs/msg/String", 0.0, {"data": "of no interest"}
    for at, x, y in drive.goals.tolist():
        pose = {"position": vector(x, y), "orientation": rotation(0.0)}
        yield "/goal_pose", "geometry_msgs/msg/PoseStamped", at, {"header": header(at, "odom"), "pose": pose}
    angles = ray_angles(drive.task.lidar) - yaw
    angles = -angles if upside_down else angles
    for at, ranges in zip(drive.scan_times.tolist(), drive.ranges, strict=True):
        fields: dict[str, Any] = {
            "header": header(at, "laser"),
            "angle_min": float(angles[0]),
            "angle_max": float(angles[-1]),
        }
        fields |= {"angle_increment": float(angles[1] - angles[0]), "time_increment": 0.0, "scan_time": 0.1}
        fields |= {"range_min": 0.0, "range_max": drive.task.lidar.range, "ranges": ranges.tolist(), "intensities": []}
        yield "/scan", "sensor_msgs/msg/LaserScan", at, fields
    for at, pose, twist in zip(drive.times.tolist(), drive.poses.tolist(), drive.twists.tolist(), strict=True):
        place = {"position": vector(pose[0], pose[1]), "orientation": rotation(pose[2])}
        speeds = {"linear": vector(twist[0], twist[1]), "angular": vector(0.0, 0.0, twist[2])}
        fields = {"header": header(at, "odom"), "child_frame_id": "base_link"}
        fields |= {"pose": {"pose": place, "covariance": [0.0] * 36}, "twist": {"twist": speeds, "covariance": [0.0] * 36}}
        yield "/odom", "nav_msgs/msg/Odometry", at, fields
    for at, asked in zip(drive.times.tolist(), drive.commands.tolist(), strict=False):
        speeds = {"linear": vector(asked[0], asked[1]), "angular": vector(0.0, 0.0, asked[2])}
        if stamped:
            yield "/cmd_vel", "geometry_msgs/msg/TwistStamped", at, {"header": header(at, "base_link"), "twist": speeds}
        else:
            yield "/cmd_vel", "geometry_msgs/msg/Twist", at, speeds


def as_mcap(sent: Iterator[Sent] | list[Sent], *, compression: CompressionType = CompressionType.ZSTD) -> bytes:
    """Messages as an MCAP file, in the order of their times."""
    file = io.BytesIO()
    with Writer(file, chunk_size=2**16, compression=compression) as writer:
        schemas = {name: writer.register_msgdef(name, text) for name, text in DEFINITIONS.items()}
        for topic, kind, at, fields in sorted(sent, key=lambda one: one[2]):
            writer.write_message(topic, schemas[kind], fields, log_time=round((EPOCH + at) * 1e9))
    return file.getvalue()


def as_db3(mcap: bytes, path: Path) -> None:
    """The same messages as rosbag2's storage plugin sqlite3 keeps them."""
    connection = sqlite3.connect(path)
    connection.executescript(
        "CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,"
        " serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);"
        "CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,"
        " data BLOB NOT NULL); CREATE INDEX timestamp_idx ON messages (timestamp ASC);"
    )
    for schema, channel, message in make_reader(io.BytesIO(mcap)).iter_messages():
        assert schema is not None
        topic = (channel.id, channel.topic, schema.name, "cdr", "")
        connection.execute("INSERT OR IGNORE INTO topics VALUES (?, ?, ?, ?, ?)", topic)
        row = (channel.id, message.log_time, message.data)
        connection.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)", row)
    connection.commit()
    connection.close()

"""A fake ROS 2 for machines without one."""

import math
import sys
from collections.abc import Callable, Iterator
from types import ModuleType, SimpleNamespace
from typing import Any

import pytest


class FakeClock:
    """A ROS clock that stands still until a test moves it."""

    seconds = 1000.0

    def now(self) -> Any:
        return SimpleNamespace(nanoseconds=round(self.seconds * 1e9), to_msg=lambda: FakeClock.stamp(self.seconds))

    @staticmethod
    def stamp(seconds: float) -> Any:
        return SimpleNamespace(sec=int(seconds), nanosec=round(seconds % 1 * 1e9))


class FakeNode:
    """What the navigator uses of `rclpy.node.Node`; keeps what was published and logged."""

    parameters: dict[str, Any] = {}  # noqa: RUF012 (a test sets it before a node exists)

    def __init__(self, name: str) -> None:
        self.name, self.clock = name, FakeClock()
        self.subscriptions: dict[str, tuple[type, Callable[[Any], None]]] = {}
        self.published: list[tuple[str, Any]] = []
        self.log: list[str] = []
        self.timers: list[tuple[float, Callable[[], None]]] = []

    def declare_parameter(self, name: str, default: Any) -> Any:
        return SimpleNamespace(value=self.parameters.get(name, default))

    def create_publisher(self, _kind: type, topic: str, _qos: Any) -> Any:
        return SimpleNamespace(publish=lambda message: self.published.append((topic, message)))

    def create_subscription(self, kind: type, topic: str, callback: Callable[[Any], None], _qos: Any) -> None:
        self.subscriptions[topic] = (kind, callback)

    def create_timer(self, period: float, callback: Callable[[], None]) -> None:
        self.timers.append((period, callback))

    def get_clock(self) -> FakeClock:
        return self.clock

    def get_logger(self) -> Any:
        return SimpleNamespace(info=self.log.append, error=self.log.append)

    def destroy_node(self) -> None:
        self.log.append("destroyed")


class FakeTransformError(Exception):
    """What `tf2_ros` raises where it knows no way from a frame to another."""


class FakeBuffer:
    """What the navigator uses of `tf2_ros.Buffer`: from (target, source) to when, x, y and heading, as a test sets them."""

    transforms: dict[tuple[str, str], tuple[float, float, float, float]] = {}  # noqa: RUF012 (a test fills it)

    def lookup_transform(self, target: str, source: str, _when: Any) -> Any:
        if (target, source) not in self.transforms:
            raise FakeTransformError(f"{source} is not connected with {target}")
        at, x, y, heading = self.transforms[target, source]
        turned = SimpleNamespace(x=0.0, y=0.0, z=math.sin(heading / 2.0), w=math.cos(heading / 2.0))
        return SimpleNamespace(
            header=SimpleNamespace(stamp=FakeClock.stamp(at), frame_id=target),
            transform=SimpleNamespace(translation=SimpleNamespace(x=x, y=y, z=0.0), rotation=turned),
        )


def _message(**fields: Callable[[], Any]) -> type:
    """A message class whose fields start at their default."""
    return type("Message", (), {"__init__": lambda self: self.__dict__.update({k: make() for k, make in fields.items()})})


def _module(name: str, **contents: Any) -> ModuleType:
    module = ModuleType(name)
    module.__dict__.update(contents)
    return module


@pytest.fixture
def ros(monkeypatch: pytest.MonkeyPatch) -> Iterator[SimpleNamespace]:
    """A `rclpy` and the messages that the node names, with the fields that it reads, as their definitions have them."""

    def vector() -> Any:
        return SimpleNamespace(x=0.0, y=0.0, z=0.0)

    def orientation() -> Any:
        return SimpleNamespace(x=0.0, y=0.0, z=0.0, w=1.0)

    def header() -> Any:
        return SimpleNamespace(frame_id="", stamp=FakeClock.stamp(0.0))

    def pose() -> Any:
        return SimpleNamespace(position=vector(), orientation=orientation())

    twist = _message(linear=vector, angular=vector)
    stamped = _message(header=header, twist=twist)
    steered = _message(header=header, drive=lambda: SimpleNamespace(speed=0.0, steering_angle=0.0))
    goal = _message(header=header, pose=pose)
    odometry = _message(
        header=header,
        child_frame_id=lambda: "base_footprint",
        pose=lambda: SimpleNamespace(pose=pose()),
        twist=lambda: SimpleNamespace(twist=twist()),
    )
    scan = _message(
        header=header,
        angle_min=float,
        angle_increment=float,
        range_min=float,
        range_max=float,
        ranges=list,
    )
    rclpy = _module("rclpy")
    modules = (
        rclpy,
        _module("rclpy.node", Node=FakeNode),
        _module("rclpy.qos", qos_profile_sensor_data="sensor data"),
        _module("rclpy.signals", SignalHandlerOptions=SimpleNamespace(NO="no handlers")),
        _module("rclpy.time", Time=lambda: "the newest"),
        _module(
            "tf2_ros",
            Buffer=FakeBuffer,
            TransformException=FakeTransformError,
            TransformListener=lambda _buffer, _node: None,
        ),
        _module("ackermann_msgs"),
        _module("ackermann_msgs.msg", AckermannDriveStamped=steered),
        _module("geometry_msgs"),
        _module("geometry_msgs.msg", PoseStamped=goal, Twist=twist, TwistStamped=stamped),
        _module("nav_msgs"),
        _module("nav_msgs.msg", Odometry=odometry),
        _module("sensor_msgs"),
        _module("sensor_msgs.msg", LaserScan=scan),
    )
    for module in modules:
        monkeypatch.setitem(sys.modules, module.__name__, module)
    name = "workers.export.ros2.mapless_navigator.node"
    monkeypatch.delitem(sys.modules, name, raising=False)
    monkeypatch.setattr(FakeNode, "parameters", {})
    monkeypatch.setattr(FakeBuffer, "transforms", {})
    yield SimpleNamespace(
        rclpy=rclpy,
        Node=FakeNode,
        LaserScan=scan,
        Odometry=odometry,
        PoseStamped=goal,
        Twist=twist,
        transforms=FakeBuffer.transforms,
    )
    sys.modules.pop(name, None)

"""The ROS 2 node, driven by fake messages: what comes in on its topics, and what goes out."""

import importlib
import io
import math
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest

from sim.config import AckermannDrive, BurgerConfig, TaskConfig
from workers.export.bundle import bundle, export_checkpoint

MODULE = "workers.export.ros2.mapless_navigator.node"


@pytest.fixture
def package(make_checkpoint: Callable[..., Path], tmp_path: Path) -> Path:
    """The ROS 2 package of an unpacked bundle."""
    with zipfile.ZipFile(io.BytesIO(bundle(export_checkpoint(make_checkpoint())))) as archive:
        archive.extractall(tmp_path)
    return tmp_path / "mapless-policy" / "ros2" / "mapless_navigator"


@pytest.fixture
def node(ros: SimpleNamespace, package: Path) -> Any:
    ros.Node.parameters = {"policy_directory": str(package / "policy")}
    return importlib.import_module(MODULE).NavigatorNode()


def receive(node: Any, ros: SimpleNamespace, *, age: float = 0.0, nearest: float = 3.0, frame: str = "odom") -> None:
    """A scan and an odometry message, both measured `age` seconds ago."""
    stamp = node.clock.stamp(node.clock.seconds - age)
    scan = ros.LaserScan()
    scan.header.stamp = stamp
    scan.angle_min, scan.angle_increment, scan.range_min, scan.range_max = 0.0, math.radians(1.0), 0.05, 3.5
    scan.ranges = np.full(360, 3.0, np.float32)
    scan.ranges[3] = nearest
    node.subscriptions["scan"][1](scan)
    odometry = ros.Odometry()
    odometry.header.stamp, odometry.header.frame_id = stamp, frame
    odometry.pose.pose.position.x = 0.5
    odometry.twist.twist.linear.x, odometry.twist.twist.angular.z = 0.2, -0.5
    odometry.pose.pose.orientation.z, odometry.pose.pose.orientation.w = math.sin(0.4), math.cos(0.4)
    node.subscriptions["odom"][1](odometry)


def send_goal(node: Any, ros: SimpleNamespace, x: float, y: float, frame: str = "odom") -> None:
    goal = ros.PoseStamped()
    goal.header.frame_id = frame
    goal.pose.position.x, goal.pose.position.y = x, y
    node.subscriptions["goal_pose"][1](goal)


def tick(node: Any) -> list[tuple[float, float]]:
    """What the timer's next call publishes: linear and angular velocities."""
    before = len(node.published)
    node.timers[0][1]()
    return [(message.twist.linear.x, message.twist.angular.z) for _, message in node.published[before:]]


def test_it_listens_and_speaks_as_documented(node: Any, ros: SimpleNamespace) -> None:
    assert {topic: kind for topic, (kind, _) in node.subscriptions.items()} == {
        "scan": ros.LaserScan,
        "odom": ros.Odometry,
        "goal_pose": ros.PoseStamped,
    }
    assert [period for period, _ in node.timers] == [0.2]


def test_it_drives_to_a_goal_and_stops_once_there(node: Any, ros: SimpleNamespace) -> None:
    receive(node, ros)
    assert tick(node) == [(0.0, 0.0)]
    assert tick(node) == []
    send_goal(node, ros, 2.0, 1.0)
    ((linear, angular),) = tick(node)
    assert 0.0 < linear <= 0.25
    assert abs(angular) <= 1.0
    assert node.published[-1][0] == "cmd_vel"
    send_goal(node, ros, 0.55, 0.0)
    assert tick(node) == [(0.0, 0.0)]
    assert tick(node) == []
    assert node.log == ["waiting for a goal", "driving", "arrived"]


def test_pose_and_goal_reach_the_policy_unchanged(node: Any, ros: SimpleNamespace) -> None:
    from workers.export.ros2.mapless_navigator.observation import observe
    from workers.export.ros2.mapless_navigator.policy import Policy

    receive(node, ros)
    send_goal(node, ros, 2.0, 1.0)
    policy = Policy.load(node.parameters["policy_directory"])
    observation = observe(policy.specification, [[3.0] * 30], [[0.5, 0.0, 0.8]], [[2.0, 1.0]], [[0.8, -0.5]])
    np.testing.assert_allclose(tick(node), policy.velocities(observation), rtol=0, atol=1e-6)


def test_it_keeps_sending_stops_while_something_is_wrong(node: Any, ros: SimpleNamespace) -> None:
    receive(node, ros)
    send_goal(node, ros, 2.0, 1.0)
    tick(node)
    node.clock.seconds += 0.6
    assert tick(node) == [(0.0, 0.0)]
    assert tick(node) == [(0.0, 0.0)]
    assert node.log[-1] == "stopped: odometry is stale"
    receive(node, ros)
    assert tick(node) != [(0.0, 0.0)]


def test_a_message_that_was_long_under_way_is_stale(node: Any, ros: SimpleNamespace) -> None:
    send_goal(node, ros, 2.0, 1.0)
    receive(node, ros, age=0.7)
    assert tick(node) == [(0.0, 0.0)]


def test_a_stamp_from_the_future_does_not_stay_fresh(node: Any, ros: SimpleNamespace) -> None:
    send_goal(node, ros, 2.0, 1.0)
    receive(node, ros, age=-100.0)
    assert tick(node) != [(0.0, 0.0)]
    node.clock.seconds += 0.6
    assert tick(node) == [(0.0, 0.0)]


def test_it_stops_before_an_obstacle(node: Any, ros: SimpleNamespace) -> None:
    send_goal(node, ros, 2.0, 1.0)
    receive(node, ros, nearest=0.15)
    assert tick(node) == [(0.0, 0.0)]
    assert node.log[-1] == "stopped: an obstacle is too near"


def test_a_goal_in_another_frame_is_driven_to_where_the_frame_lies_now(node: Any, ros: SimpleNamespace) -> None:
    """The map lies 1 m ahead of the odometry and is turned by a quarter: its (1, -1) is (2, 1) there."""
    receive(node, ros)
    send_goal(node, ros, 2.0, 1.0, frame="odom")
    straight = tick(node)
    node.published.clear()
    ros.transforms["odom", "map"] = (node.clock.seconds, 1.0, 0.0, math.pi / 2.0)
    send_goal(node, ros, 1.0, -1.0, frame="map")
    # The last action is seen, so the node is brought to a stand before it decides anew.
    receive(node, ros, nearest=0.15)
    tick(node)
    receive(node, ros)
    np.testing.assert_allclose(tick(node), straight, rtol=0, atol=1e-6)
    # Localisation corrects itself: now the goal is where the robot stands.
    ros.transforms["odom", "map"] = (node.clock.seconds, -0.5, -1.0, math.pi / 2.0)
    assert tick(node) == [(0.0, 0.0)]
    assert node.log[-1] == "arrived"


def test_a_goal_whose_frame_nobody_connects_is_waited_with_and_said_once(node: Any, ros: SimpleNamespace) -> None:
    receive(node, ros)
    send_goal(node, ros, 2.0, 1.0, frame="map")
    assert tick(node) == tick(node) == [(0.0, 0.0)]
    assert node.log == [
        "no transform from the goal's frame 'map' to the odometry's 'odom': map is not connected with odom",
        "stopped: the place of the goal's frame is not known yet",
    ]
    ros.transforms["odom", "map"] = (0.0, 0.0, 0.0, 0.0)
    assert tick(node) != [(0.0, 0.0)]


def test_a_frame_that_is_no_longer_placed_stops_the_robot_and_a_fixed_one_does_not(node: Any, ros: SimpleNamespace) -> None:
    ros.transforms["odom", "map"] = (node.clock.seconds, 0.0, 0.0, 0.0)
    send_goal(node, ros, 2.0, 1.0, frame="map")
    node.clock.seconds += 1.1
    receive(node, ros)
    assert tick(node) == [(0.0, 0.0)]
    assert node.log[-1] == "stopped: the place of the goal's frame is stale"
    ros.transforms["odom", "map"] = (0.0, 0.0, 0.0, 0.0)
    assert tick(node) != [(0.0, 0.0)]


def test_a_goal_without_a_frame_is_the_odometrys(node: Any, ros: SimpleNamespace) -> None:
    receive(node, ros)
    send_goal(node, ros, 2.0, 1.0, frame="")
    assert tick(node) != [(0.0, 0.0)]


def test_velocities_are_stamped_and_of_the_body(node: Any, ros: SimpleNamespace) -> None:
    receive(node, ros)
    send_goal(node, ros, 2.0, 1.0)
    tick(node)
    topic, message = node.published[-1]
    assert (topic, message.header.stamp.sec, message.header.frame_id) == ("cmd_vel", 1000, "base_footprint")


def test_parameters_change_what_it_does(ros: SimpleNamespace, package: Path) -> None:
    ros.Node.parameters = {
        "policy_directory": str(package / "policy"),
        "max_linear_speed": 0.01,
        "stamped_twist": False,
        "goal_tolerance": 0.01,
    }
    node = importlib.import_module(MODULE).NavigatorNode()
    receive(node, ros)
    send_goal(node, ros, 2.0, 1.0)
    node.timers[0][1]()
    assert node.published[-1][1].linear.x == pytest.approx(0.01)


def test_an_ackermann_drive_is_sent_its_speed_and_its_steering_angle(
    make_checkpoint: Callable[..., Path], tmp_path: Path, ros: SimpleNamespace
) -> None:
    task = TaskConfig(robot=BurgerConfig(drive=AckermannDrive(wheel_base=0.2, steering_limit=20.0)))
    with zipfile.ZipFile(io.BytesIO(bundle(export_checkpoint(make_checkpoint(task=task))))) as archive:
        archive.extractall(tmp_path)
    directory = tmp_path / "mapless-policy" / "ros2" / "mapless_navigator" / "policy"
    ros.Node.parameters = {"policy_directory": str(directory)}
    node = importlib.import_module(MODULE).NavigatorNode()
    receive(node, ros)
    send_goal(node, ros, 2.0, 1.0)
    node.timers[0][1]()
    topic, message = node.published[-1]
    assert topic == "ackermann_cmd"
    assert message.drive.speed != 0.0
    assert 0.0 < abs(message.drive.steering_angle) <= math.radians(20.0)
    assert message.header.stamp.sec == 1000


def test_the_node_stops_the_robot_when_it_ends(ros: SimpleNamespace, package: Path, monkeypatch: Any) -> None:
    ros.Node.parameters = {"policy_directory": str(package / "policy")}
    nodes = []

    def spin(node: Any) -> None:
        nodes.append(node)
        receive(node, ros)
        send_goal(node, ros, 2.0, 1.0)
        tick(node)
        raise KeyboardInterrupt

    ros.rclpy.init = lambda signal_handler_options: None
    ros.rclpy.spin, ros.rclpy.shutdown = spin, lambda: nodes.append("shut down")
    module = importlib.import_module(MODULE)
    monkeypatch.setattr(module.signal, "signal", lambda *_: None)
    module.main()
    node, end = nodes
    stop, before = (message.twist for _, message in node.published[:-3:-1])
    assert (stop.linear.x, stop.angular.z) == (0.0, 0.0)
    assert before.linear.x > 0.0
    assert (node.log[-1], end) == ("destroyed", "shut down")


def test_the_packages_own_parameters_are_the_nodes_defaults(node: Any, package: Path) -> None:
    written = dict(re.findall(r"^    (\w+): (\S+)$", (package / "config" / "navigator.yaml").read_text(), re.MULTILINE))
    assert (written.pop("stamped_twist"), written.pop("measured_speeds")) == ("true", "true")
    defaults = vars(node._navigator._safety)
    assert {name: float(value) for name, value in written.items()} == pytest.approx(defaults)
    assert all(re.search(r"[.e]", value) for value in written.values())  # ROS refuses an integer for a float


def test_package_description_names_what_the_node_imports(package: Path) -> None:
    named = {element.text for element in ElementTree.parse(package / "package.xml").iter("exec_depend")}
    source = (package / "mapless_navigator" / "node.py").read_text()
    imported = set(re.findall(r"^\s*(?:from|import) (\w+)", source, re.MULTILINE))
    assert {name for name in imported if name.endswith("_msgs") or name in ("rclpy", "ament_index_python")} <= named
    launch = ElementTree.parse(package / "launch" / "navigator.launch.xml").getroot()
    remapped = {element.get("from") for element in launch.iter("remap")}
    assert remapped == {"scan", "scan_second", "odom", "goal_pose", "cmd_vel", "ackermann_cmd"}

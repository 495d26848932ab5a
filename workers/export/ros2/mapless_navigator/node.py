"""The ROS 2 node: LaserScan, Odometry and a goal PoseStamped in, TwistStamped, Twist or AckermannDriveStamped out.

| topic         | type                        |                                                                  |
|---------------|-----------------------------|------------------------------------------------------------------|
| `scan`        | sensor_msgs/LaserScan       | in                                                               |
| `scan_second` | sensor_msgs/LaserScan       | in: the second LiDAR's, where the policy has two                 |
| `odom`        | nav_msgs/Odometry           | in: the robot's pose, and its velocities (`measured_speeds`)     |
| `goal_pose`   | geometry_msgs/PoseStamped   | in: only its position counts, in any frame that TF knows         |
| `cmd_vel`     | geometry_msgs/TwistStamped  | out, once per control period while a goal is set, then one stop  |

A robot that takes a plain geometry_msgs/Twist gets it where `stamped_twist` is false. A policy of an Ackermann drive speaks
on `ackermann_cmd` instead, an ackermann_msgs/AckermannDriveStamped: the speed of the rear axle and the steering angle.

Everything that is decided is decided in `navigator`; this file translates messages.
"""

import math
import signal
from pathlib import Path
from typing import Any

import numpy as np
import rclpy
from geometry_msgs.msg import PoseStamped, Twist, TwistStamped
from nav_msgs.msg import Odometry
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.signals import SignalHandlerOptions
from rclpy.time import Time
from sensor_msgs.msg import LaserScan
from tf2_ros import Buffer, TransformException, TransformListener

from .navigator import Command, Navigator, Safety, State
from .observation import Scan
from .policy import Policy

_IDLE = (State.NO_GOAL, State.ARRIVED)


class NavigatorNode(Node):
    """Translates between ROS and `Navigator`."""

    def __init__(self) -> None:
        super().__init__("mapless_navigator")
        policy = Policy.load(self._parameter("policy_directory", "") or default_policy_directory())
        self._measured_speeds = bool(self._parameter("measured_speeds", True))
        self._stamped = bool(self._parameter("stamped_twist", True))
        self._navigator = Navigator(policy, self._safety(Safety.of(policy.specification)))
        self._frame, self._body = "", ""
        self._transforms = Buffer()
        self._listener = TransformListener(self._transforms, self)
        self._trouble = ""
        self._state: State | None = None
        self._steers = policy.specification.drive == "ackermann"
        if self._steers:
            self._publisher = self.create_publisher(ackermann_message(), "ackermann_cmd", 1)
        else:
            self._publisher = self.create_publisher(TwistStamped if self._stamped else Twist, "cmd_vel", 1)
        self.create_subscription(LaserScan, "scan", self.on_scan, qos_profile_sensor_data)
        if len(policy.specification.mounts) > 1:
            self.create_subscription(LaserScan, "scan_second", self.on_second_scan, qos_profile_sensor_data)
        self.create_subscription(Odometry, "odom", self.on_odometry, qos_profile_sensor_data)
        self.create_subscription(PoseStamped, "goal_pose", self.on_goal, 1)
        self.create_timer(policy.specification.control_period, self.on_timer)

    def on_second_scan(self, message: Any) -> None:
        """A `LaserScan` of the second LiDAR."""
        self.on_scan(message, lidar=1)

    def on_scan(self, message: Any, lidar: int = 0) -> None:
        """A `LaserScan`."""
        scan = Scan(
            angle_min=message.angle_min,
            angle_increment=message.angle_increment,
            range_min=message.range_min,
            range_max=message.range_max,
            ranges=np.asarray(message.ranges, np.float64),
        )
        self._navigator.set_scan(self._measured_at(message.header.stamp), scan, lidar)

    def on_odometry(self, message: Any) -> None:
        """An `Odometry`."""
        self._frame, self._body = message.header.frame_id, message.child_frame_id
        position, orientation = message.pose.pose.position, message.pose.pose.orientation
        twist = message.twist.twist
        velocities = (twist.linear.x, twist.linear.y, twist.angular.z) if self._measured_speeds else None
        self._navigator.set_odometry(
            self._measured_at(message.header.stamp), position.x, position.y, yaw_of(orientation), velocities
        )

    def on_goal(self, message: Any) -> None:
        """A goal `PoseStamped`; one without a frame is in the odometry's."""
        self._trouble = ""
        self._navigator.set_goal(message.pose.position.x, message.pose.position.y, message.header.frame_id)

    def on_timer(self) -> None:
        """Once per control period: decide and send."""
        self._place_goal_frame()
        command = self._navigator.command(self._now())
        if command.state is not self._state:
            self.get_logger().info(command.state.value)
        elif command.state in _IDLE:
            return  # Somebody else may be driving now.
        self._state = command.state
        self.send(command)

    def send(self, command: Command) -> None:
        """Publish velocities."""
        if self._steers:
            steered = ackermann_message()()
            steered.header.stamp = self.get_clock().now().to_msg()
            steered.drive.speed, steered.drive.steering_angle = command.linear, command.steering
            self._publisher.publish(steered)
            return
        twist = Twist()
        twist.linear.x, twist.linear.y, twist.angular.z = command.linear, command.lateral, command.angular
        if self._stamped:
            stamped = TwistStamped()
            stamped.header.stamp, stamped.header.frame_id = self.get_clock().now().to_msg(), self._body
            stamped.twist = twist
            self._publisher.publish(stamped)
        else:
            self._publisher.publish(twist)

    def _place_goal_frame(self) -> None:
        """Tell where the goal's frame lies now: what corrects the odometry moves it, as a map's."""
        frame = self._navigator.goal_frame
        if not frame or not self._frame:
            return
        if frame == self._frame:
            self._navigator.place_goal_frame(self._now(), 0.0, 0.0, 0.0)
            return
        try:
            found = self._transforms.lookup_transform(self._frame, frame, Time())
        except TransformException as error:
            if not self._trouble:
                self._trouble = f"no transform from the goal's frame '{frame}' to the odometry's '{self._frame}': {error}"
                self.get_logger().error(self._trouble)
            return
        self._trouble = ""
        moved, turned = found.transform.translation, found.transform.rotation
        # One that never changes has no time.
        self._navigator.place_goal_frame(self._measured_at(found.header.stamp), moved.x, moved.y, yaw_of(turned))

    def _parameter(self, name: str, default: Any) -> Any:
        return self.declare_parameter(name, default).value

    def _safety(self, default: Safety) -> Safety:
        """The parameters: each has the policy's own value where it is not set."""
        names = vars(default)
        return Safety(**{name: float(self._parameter(name, float(value))) for name, value in names.items()})

    def _now(self) -> float:
        return float(self.get_clock().now().nanoseconds) * 1e-9

    def _measured_at(self, stamp: Any) -> float:
        """When a message was measured: its stamp, unless that is not set or lies ahead of our clock."""
        now, stamped = self._now(), stamp.sec + stamp.nanosec * 1e-9
        return min(now, stamped) if stamped > 0.0 else now


def ackermann_message() -> Any:
    """The type of what an Ackermann drive is sent, from a package that no other robot needs."""
    from ackermann_msgs.msg import AckermannDriveStamped

    return AckermannDriveStamped


def default_policy_directory() -> Path:
    """The policy that was installed with this package."""
    from ament_index_python.packages import get_package_share_directory

    return Path(get_package_share_directory("mapless_navigator")) / "policy"


def yaw_of(orientation: Any) -> float:
    """Heading of a quaternion, radians."""
    x, y, z, w = orientation.x, orientation.y, orientation.z, orientation.w
    return math.atan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))


def main() -> None:
    """Run the node until it is interrupted or fails, then stop the robot."""
    # Its own handlers would close the context at Ctrl-C, and the last stop could not be sent.
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    node = NavigatorNode()
    try:
        rclpy.spin(node)
    except KeyboardInterrupt:
        node.get_logger().info("interrupted")
    finally:
        node.send(Command(0.0, 0.0, State.NO_GOAL))
        node.destroy_node()
        rclpy.shutdown()

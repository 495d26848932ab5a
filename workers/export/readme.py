"""The bundle's README: what the files are, what the policy expects, and how to run it."""

import math

from workers.export.check import CheckReport
from workers.export.ros2.mapless_navigator.policy import Specification
from workers.manifest import Manifest

_NUMPY_EXAMPLE = """\
import sys

sys.path.insert(0, "ros2/mapless_navigator")  # without ROS: these modules need NumPy only

from mapless_navigator.observation import Frames, observe
from mapless_navigator.policy import Policy

policy = Policy.load("policy")
ranges = [[3.5] * policy.specification.rays]  # metres, from right to left
frames = Frames(policy.specification)  # of one robot, from start to target
observation = frames.push(observe(policy.specification, ranges, [[0.0, 0.0, 0.0]], [[2.0, 1.0]], [[0.0, 0.0]]))
linear, angular = policy.velocities(observation)[0]
print(f"{linear:.3f} m/s, {angular:.3f} rad/s")
"""

_ONNX_EXAMPLE = """\
import numpy as np
import onnxruntime

session = onnxruntime.InferenceSession("policy_from_scan.onnx")
inputs = {
    "ranges": np.full((1, RAYS), 3.5, np.float32),
    "pose": np.zeros((1, 3), np.float32),  # x, y, heading
    "target": np.array([[2.0, 1.0]], np.float32),
    "last_action": np.zeros((1, 2), np.float32),  # the `action` of the step before
}
PREVIOUSaction, velocity = session.run(["action", "velocity"], inputs)
print(f"{velocity[0, 0]:.3f} m/s, {velocity[0, 1]:.3f} rad/s")
"""


def readme(manifest: Manifest, specification: Specification, report: CheckReport) -> str:
    """The README in Markdown."""
    return "\n".join(
        (
            _head(manifest),
            _files(report),
            _contract(manifest, specification),
            _ros(specification),
            "## Python, without ROS\n\nWith NumPy alone:\n\n```python\n" + _NUMPY_EXAMPLE + "```\n",
            f"With onnxruntime:\n\n```python\n{_onnx_example(specification)}```\n",
        )
    )


def _onnx_example(specification: Specification) -> str:
    previous = ""
    if specification.frames > 1:
        size, earlier = specification.frame_size, specification.frames - 1
        previous = (
            f'inputs["previous"] = np.zeros((1, {earlier * size}), np.float32)\n'
            f'first = session.run(["observation"], inputs)[0][:, :{size}]\n'
            f'inputs["previous"] = np.tile(first, (1, {earlier}))  # later: observation[:, :-{size}] of the step before\n'
        )
    return _ONNX_EXAMPLE.replace("RAYS", str(specification.rays)).replace("PREVIOUS", previous)


def _head(manifest: Manifest) -> str:
    training, evaluation = manifest.training, manifest.evaluation
    measured = (
        f"It arrived in {evaluation.arrivals} of {evaluation.episodes} episodes of the suite `{evaluation.suite}` "
        f"(`{evaluation.suite_hash[:12]}`), in simulation."
        if evaluation
        else "It was not evaluated: try it in simulation first."
    )
    return (
        "# A navigation policy\n\n"
        f"{training.algorithm.name.upper()} ({manifest.network.name}), seed {manifest.seed}, after {manifest.step:,} steps "
        f"in the arena `{training.task.arena.name}`. {measured}\n"
    )


def _files(report: CheckReport) -> str:
    return f"""\
| file | what it is |
|---|---|
| `manifest.json` | all about the policy: training, observation number by number, network, versions |
| `policy.onnx` | observation in, action and velocities out |
| `policy_from_scan.onnx` | scan, pose, target and last action in; makes the observation itself |
| `policy/` | the weights as safetensors, and what it takes to run them |
| `run_policy.py` | runs `policy/` with NumPy alone: one file to copy |
| `ros2/mapless_navigator/` | a ROS 2 package with the policy in it |

Checked against the trained network over {report.rows:,} random observations and scenes: actions differ by at most
{report.policy_difference:.0e}, observations by at most {report.observation_difference:.0e}.
"""


def _contract(manifest: Manifest, specification: Specification) -> str:
    rows = "\n".join(
        f"| {number.index} | {number.name} | {_cell(number.meaning)} | {number.low:g} to {number.high:g} |"
        for number in manifest.observation.numbers
    )
    return f"""\
## What the policy expects

A differential-drive robot with {_body(specification)}, a new command every
{specification.control_period:g} s, 0 to {specification.max_linear_speed:g} m/s forwards and
{specification.max_angular_speed:g} rad/s to either side. A LiDAR with {specification.rays} rays over
{math.degrees(specification.field_of_view):g} degrees, symmetric about the heading, from right to left, cut at
{specification.range:g} m. Pose and target in one fixed frame.

| number | name | meaning | range |
|---|---|---|---|
{rows}
"""


def _body(specification: Specification) -> str:
    if not specification.robot_length:
        return f"a round body of radius {specification.robot_radius:g} m"
    return (
        f"a rectangular body {specification.robot_length:g} m long and {specification.robot_width:g} m wide, "
        "the LiDAR in its middle"
    )


def _cell(text: str) -> str:
    """Text for a Markdown table, in which a bar ends a cell."""
    return text.replace("|", "\\|")


def _ros(specification: Specification) -> str:
    return f"""\
## ROS 2

```sh
cp -r ros2/mapless_navigator ~/ros2_ws/src/
cd ~/ros2_ws && colcon build --packages-select mapless_navigator && . install/setup.sh
ros2 launch mapless_navigator navigator.launch.xml
ros2 topic pub --once goal_pose geometry_msgs/PoseStamped '{{header: {{frame_id: odom}}, pose: {{position: {{x: 1.0}}}}}}'
```

It reads `scan`, `odom` and `goal_pose`, and writes `cmd_vel` every {specification.control_period:g} s while it has a goal
(launch arguments of these names give other topics). It stops when the scan or the odometry is stale, when the scan
leaves a part of the field of view unknown, when something is nearer than {specification.collision_distance:g} m ahead or
touches the body beside or behind, and within {specification.arrival_distance:g} m of the goal. The goal must be in the
odometry's frame. Parameters are in `config/navigator.yaml`: mind `sensor_yaw` where the LiDAR is not mounted straight.
Lift the wheels off the ground for the first start, and keep a hand on the emergency stop.
"""

"""The bundle's README: what the files are, what the policy expects, and how to run it."""

import math
from collections.abc import Mapping

from workers.export.check import CheckReport
from workers.export.graph import LAST_ACTION, POSE, PREVIOUS, RANGES, SPEEDS, TARGET, scan_inputs
from workers.export.names import MEMORY, NEXT_MEMORY
from workers.export.ros2.mapless_navigator.dwell import Dwell
from workers.export.ros2.mapless_navigator.openings import Openings
from workers.export.ros2.mapless_navigator.policy import Part, Specification
from workers.export.ros2.mapless_navigator.trail import Trail
from workers.export.ros2.mapless_navigator.views import Views
from workers.manifest import Manifest

_NUMPY_EXAMPLE = """\
import sys

sys.path.insert(0, "ros2/mapless_navigator")  # without ROS: these modules need NumPy only

from mapless_navigator.observation import Frames, observe
from mapless_navigator.policy import Policy
IMPORTS
policy = Policy.load("policy")
ranges = [[3.5] * policy.specification.scan_size]  # metres, from right to left
pose, target = [0.0, 0.0, 0.0], [2.0, 1.0]  # x, y, heading; x, y
frames = Frames(policy.specification)  # of one robot, from start to target
WAYSobservation = frames.push(observe(policy.specification, ranges, [pose], [target], [[ZEROS]]ADDED))
STEPprint(f"FORMAT")
"""

_WAYS: Mapping[str, type[Trail | Dwell | Views | Openings]] = {
    "trail": Trail,
    "dwell": Dwell,
    "views": Views,
    "openings": Openings,
}
"""Modules of what a robot remembers of its way, and their classes."""

_NUMPY_STEP = """\
NAMES = policy.velocities(observation)[0]
"""

_NUMPY_STEP_WITH_MEMORY = """\
memory = policy.memory(1)  # zeros, of one robot that begins
actions, memory = policy.step(observation, memory)  # at every step with the memory of the one before
NAMES = actions[0] * policy.specification.action_limits
"""

_ONNX_EXAMPLE = """\
IMPORTimport os

import numpy as np

os.environ["ORT_DISABLE_TELEMETRY"] = "1"  # else it reports what it runs to its maker
import onnxruntime

session = onnxruntime.InferenceSession("policy_from_scan.onnx")
inputs = {
INPUTS
}
PREVIOUSOUTPUTS = session.run(["QUOTED"], inputs)
NEXTNAMES = velocity[0]
print(f"FORMAT")
"""


_PREVIOUS = """\
with open("policy/policy.json") as file:
    specification = json.load(file)
first = session.run(["observation"], inputs)[0]
inputs["previous"] = first[:, specification["repeated"]]  # later: observation[:, specification["carried"]], of the last one
"""


def readme(manifest: Manifest, specification: Specification, report: CheckReport) -> str:
    """The README in Markdown."""
    return "\n".join(
        (
            _head(manifest),
            _files(report),
            _contract(manifest, specification),
            _added(manifest, specification),
            _memory(specification),
            _ros(specification),
            f"## Python, without ROS\n\nWith NumPy alone:\n\n```python\n{_numpy_example(specification)}```\n",
            f"With onnxruntime:\n\n```python\n{_onnx_example(specification)}```\n",
        )
    )


def _numpy_example(specification: Specification) -> str:
    step = _NUMPY_STEP_WITH_MEMORY if specification.memory else _NUMPY_STEP
    return _filled(_NUMPY_EXAMPLE.replace("STEP", step), specification)


def _onnx_example(specification: Specification) -> str:
    lines = {
        RANGES: f"np.full((1, {specification.scan_size}), 3.5, np.float32),  # metres, from right to left",
        POSE: "np.zeros((1, 3), np.float32),  # x, y, heading",
        TARGET: "np.array([[2.0, 1.0]], np.float32),",
        SPEEDS: "np.zeros((1, COUNT), np.float32),  # as measured, over their limits, or the `action` of the step before",
        LAST_ACTION: "np.zeros((1, COUNT), np.float32),  # the `action` of the step before",
        **{
            part.kind: f"{_at_first(part, specification)},  # as {_maker(part)} makes it"
            for part in _brought_parts(specification)
        },
        MEMORY: f"np.zeros((1, {specification.memory}), np.float32),  # of a robot that begins",
        PREVIOUS: f"np.zeros((1, {len(specification.carried)}), np.float32),  # see below",
    }
    names = [*scan_inputs(specification), *([MEMORY] if specification.memory else [])]
    inputs = "\n".join(f'    "{name}": {lines[name]}' for name in names)
    outputs = ["action", "velocity", *([NEXT_MEMORY] if specification.memory else [])]
    following = f'inputs["{MEMORY}"] = {NEXT_MEMORY}  # for the next step\n' if specification.memory else ""
    earlier = bool(specification.carried)
    example = _ONNX_EXAMPLE.replace("INPUTS", inputs).replace("PREVIOUS", _PREVIOUS if earlier else "")
    example = (
        example.replace("OUTPUTS", ", ".join(outputs)).replace("QUOTED", '", "'.join(outputs)).replace("NEXT", following)
    )
    return _filled(example.replace("IMPORT", "import json\n" if earlier else ""), specification)


def _filled(example: str, specification: Specification) -> str:
    """An example with the numbers of this policy's action."""
    units = {"linear": "m/s", "lateral": "m/s to the left", "angular": "rad/s", "steering": "rad of steering"}
    names = {
        "differential": ("linear", "angular"),
        "omnidirectional": ("linear", "lateral", "angular"),
        "ackermann": ("linear", "steering"),
    }[specification.drive]
    added = {
        part.kind: f"[{_seen(part)}]" if part.remembered_by else str([[0.0] * part.size])
        for part in _brought_parts(specification)
    }
    brought = ", ".join(f'"{kind}": {numbers}' for kind, numbers in added.items())
    ways = {
        name: _WAYS[name].__name__
        for name in sorted(part.remembered_by for part in specification.parts if part.remembered_by)
    }
    imports = [f"from mapless_navigator.{module} import {name}\n" for module, name in ways.items()]
    made = [f"{module} = {name}(policy.specification)  # likewise\n" for module, name in ways.items()]
    return (
        example.replace("NAMES", ", ".join(names))
        .replace("ADDED", f", added={{{brought}}}" if added else "")
        .replace("IMPORTS", "".join(imports))
        .replace("WAYS", "".join(made))
        .replace("FORMAT", ", ".join(f"{{{name}:.3f}} {units[name]}" for name in names))
        .replace("ZEROS", ", ".join(["0.0"] * len(names)))
        .replace("COUNT", str(len(names)))
    )


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
| `policy_from_scan.onnx` | scan, pose, target and the like in; makes the observation itself |
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

{_drive(specification)} with {_body(specification)}, a new command every
{specification.control_period:g} s: {_speeds(specification)}. {_lidars(specification)} with {specification.rays} rays over
{math.degrees(specification.field_of_view):g} degrees, symmetric about where it looks, from right to left, cut at
{specification.range:g} m. Pose and target in one fixed frame.

| number | name | meaning | range |
|---|---|---|---|
{rows}
"""


def _brought_parts(specification: Specification) -> tuple[Part, ...]:
    return tuple(part for part in specification.parts if part.brought)


def _seen(part: Part) -> str:
    """What the memory of its way tells, as code."""
    name = part.remembered_by
    return f"{name}.see(ranges[0], pose)" if name in ("trail", "dwell") else f"{name}.see(ranges[0], pose, target)"


def _at_first(part: Part, specification: Specification) -> str:
    """What a robot that has not moved, and sees nothing within its range, brings, as code."""
    if part.added:
        return f"np.zeros((1, {part.size}), np.float32)"
    memory = _WAYS[part.remembered_by](specification)
    if isinstance(memory, Dwell):
        return "np.zeros((1, 1), np.float32)"
    if not isinstance(memory, Trail):
        seen = memory.see([specification.range] * specification.scan_size, (0.0, 0.0, 0.0), (2.0, 1.0))
        return f"np.array([{[round(number, 6) for number in seen.tolist()]}], np.float32)"
    return f"np.eye(1, {part.size}, {part.size - 1}, dtype=np.float32) / {161 if part.kind == 'long_trail' else 41}"


def _maker(part: Part) -> str:
    return "its extension" if part.added else f"`mapless_navigator/{part.remembered_by}.py`"


def _added_parts(specification: Specification) -> tuple[Part, ...]:
    return tuple(part for part in specification.parts if part.added)


def _added(manifest: Manifest, specification: Specification) -> str:
    """What is not in the bundle: the code of extensions that makes parts of the observation."""
    if not (parts := _added_parts(specification)):
        return ""
    kinds = ", ".join(f"`{part.kind}`" for part in parts)
    extensions = ", ".join(
        f"{one.name} {one.version}" + (f" (`{one.source}`)" if one.source else "") for one in manifest.training.extensions
    )
    return f"""\
**Code of an extension makes {kinds}**, and it is not in this bundle: the table says what each
number is, the training had {extensions}. `policy_from_scan.onnx` takes these numbers as inputs of their own, `observe` as
`added`, and the ROS 2 node ends with this reason until `Navigator` in `node.py` is given a function `make_added` that makes
them.
"""


def _memory(specification: Specification) -> str:
    """What a recurrent policy is given besides, and gives back."""
    if not (size := specification.memory):
        return ""
    return f"""\
**The policy remembers** {size} numbers of each robot. Both graphs take them as one more input, `memory` (n, {size}), and
give those of the next step as one more output, `next_memory`; `step` of the NumPy runner likewise. They are zeros where a
robot begins, and each step is given what the one before returned: with a step left out, or the memory of another robot, it
no longer does what it was measured to do. The ROS 2 node sees to this by itself.
"""


def _drive(specification: Specification) -> str:
    if specification.drive == "ackermann":
        return f"A robot with steered front wheels, the axles {specification.wheel_base:g} m apart,"
    return "An omnidirectional robot" if specification.drive == "omnidirectional" else "A differential-drive robot"


def _speeds(specification: Specification) -> str:
    speeds = [f"0 to {specification.max_linear_speed:g} m/s forwards"]
    if specification.reverse:
        speeds.append(f"{specification.reverse * specification.max_linear_speed:g} m/s backwards")
    if specification.sideways:
        speeds.append(f"{specification.sideways * specification.max_linear_speed:g} m/s and")
    if specification.drive == "ackermann":
        speeds.append(f"{math.degrees(specification.steering_limit):g} degrees of steering, at most")
    return ", ".join(speeds) + f" {specification.max_angular_speed:g} rad/s to either side"


def _lidars(specification: Specification) -> str:
    if specification.mounts == ((0.0, 0.0, 0.0),):
        return "A LiDAR in its middle that looks ahead,"
    places = " and ".join(
        f"{x:g} m ahead and {y:g} m to the left of its middle, turned by {math.degrees(yaw):g} degrees"
        for x, y, yaw in specification.mounts
    )
    return (
        f"A LiDAR {places}," if len(specification.mounts) == 1 else f"Two LiDARs, {places}, one scan after the other, each"
    )


def _body(specification: Specification) -> str:
    if not specification.robot_length:
        return f"a round body of radius {specification.robot_radius:g} m"
    return f"a rectangular body {specification.robot_length:g} m long and {specification.robot_width:g} m wide"


def _cell(text: str) -> str:
    """Text for a Markdown table, in which a bar ends a cell."""
    return text.replace("|", "\\|")


def _ros(specification: Specification) -> str:
    second = ", `scan_second`" if len(specification.mounts) > 1 else ""
    steers = specification.drive == "ackermann"
    topic = "`ackermann_cmd` (ackermann_msgs/AckermannDriveStamped)" if steers else "`cmd_vel` (geometry_msgs/TwistStamped)"
    return f"""\
## ROS 2

```sh
cp -r ros2/mapless_navigator ~/ros2_ws/src/
cd ~/ros2_ws && colcon build --packages-select mapless_navigator && . install/setup.sh
ros2 launch mapless_navigator navigator.launch.xml
ros2 topic pub --once goal_pose geometry_msgs/PoseStamped '{{header: {{frame_id: odom}}, pose: {{position: {{x: 1.0}}}}}}'
```

It reads `scan`{second}, `odom` and `goal_pose`, and writes {topic} every
{specification.control_period:g} s while it has a goal
(launch arguments of these names give other topics). It stops when the scan or the odometry is stale, when the scan
leaves a part of the field of view unknown, when something is nearer than {specification.collision_distance:g} m ahead or
touches the body beside or behind, and within {specification.arrival_distance:g} m of the goal. The goal may be in
any frame that TF connects with the odometry's, as `map`. Parameters are in `config/navigator.yaml`: mind `sensor_yaw` where
a LiDAR is not turned as in training, and set `stamped_twist` to false for a robot that takes plain Twist messages.
Lift the wheels off the ground for the first start, and keep a hand on the emergency stop.
"""

"""A policy as an ONNX graph, written node by node: from the observation, or from scan, pose and target.

| graph       | inputs                                                      | outputs                             |
|-------------|-------------------------------------------------------------|-------------------------------------|
| observation | `observation` (n, size) as the manifest describes it         | `action`, `velocity`                |
| scan        | what the observation is made of, of `ranges` (n, scan),     | `observation`, `action`, `velocity` |
|             | `pose` (n, 3), `target` (n, 2), `speeds` (n, A) and         |                                     |
|             | `last_action` (n, A); `trail`, `known`, `openings` and      |                                     |
|             | `dwell` (n, numbers), which a robot's program keeps         |                                     |
|             | (`trail.py`, `views.py`, `openings.py` with `gaps.py`, and  |                                     |
|             | `dwell.py` in `ros2/mapless_navigator`), and an             |                                     |
|             | extension's part (n, numbers) by its name; where earlier    |                                     |
|             | moments are seen `previous`, see `Specification.carried`    |                                     |

A policy that remembers has one more input, `memory` (n, m), zeros where a robot begins, and one more output, `next_memory`,
which is the next step's. The nodes of a network that ships are those of its formula; another's are what PyTorch makes of
its module.

`action` (n, A) is in fractions of the limits, as the manifest describes it; `velocity` (n, A) in m/s and rad/s, of an
Ackermann drive m/s and the steering angle in rad, cut at the robot's limits. All numbers are float32. The manifest is in
the file's metadata.
"""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import onnx
import onnx.compose
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

from sim.actions import ActionComponent
from workers.export.names import ACTION, MEMORY, NEXT_MEMORY, OBSERVATION
from workers.export.ros2.mapless_navigator.observation import DIRECTIONS, READ_OFF_SCAN, ray_angles, reach_directions
from workers.export.ros2.mapless_navigator.policy import Forward, Part, Specification
from workers.export.tracing import trace
from workers.kernels.constants import LEAKY_SLOPE
from workers.manifest import Manifest
from workers.policy import Policy

# Old enough for every runtime that robots carry; every operator used here is older still.
OPSET = 17
IR_VERSION = 8

VELOCITY = "velocity"
RANGES, POSE, TARGET, PREVIOUS = "ranges", "pose", "target", "previous"
SPEEDS, LAST_ACTION = "speeds", "last_action"

# Operators of a formula that are operators of ONNX by another name.
_OPERATORS = {
    "relu": "Relu",
    "tanh": "Tanh",
    "sigmoid": "Sigmoid",
    "add": "Add",
    "subtract": "Sub",
    "multiply": "Mul",
}

# Keeps a quotient finite; far below any distance that matters.
_TINY = 1e-12


def observation_graph(policy: Policy, specification: Specification, manifest: Manifest) -> bytes:
    """The policy on its observation, as an ONNX file."""
    graph = _Graph(policy)
    graph.act(OBSERVATION)
    return graph.model({OBSERVATION: specification.observation_size}, (ACTION, VELOCITY), manifest)


def scan_graph(policy: Policy, specification: Specification, manifest: Manifest) -> bytes:
    """The policy on what its observation is made of, as an ONNX file that makes the observation itself."""
    graph = _Graph(policy)
    graph.observe(specification)
    graph.act(OBSERVATION)
    return graph.model(scan_inputs(specification), (OBSERVATION, ACTION, VELOCITY), manifest)


def scan_inputs(specification: Specification) -> dict[str, int]:
    """The inputs of a scan graph, and how many columns each has: what this policy's observation is made of."""
    kinds = {part.kind for part in specification.parts}
    actions = len(specification.action_limits)
    inputs = {RANGES: specification.scan_size} if kinds & {*READ_OFF_SCAN, "way", "reach_progress"} else {}
    brought = {part.kind: part.size for part in specification.parts if part.brought}
    if kinds - brought.keys() - {*READ_OFF_SCAN, "speeds", "actions"}:
        inputs |= {POSE: 3, TARGET: 2}
    inputs |= {SPEEDS: actions} if "speeds" in kinds else {}
    inputs |= {LAST_ACTION: actions} if "actions" in kinds else {}
    inputs |= brought
    return inputs | ({PREVIOUS: len(specification.carried)} if specification.carried else {})


class _Graph:
    """Nodes and arrays of the graph under construction; each method returns the name of its result."""

    def __init__(self, policy: Policy) -> None:
        self._policy, self._actions = policy, policy.actions
        self._nodes: list[onnx.NodeProto] = []
        self._arrays: list[onnx.TensorProto] = []
        if policy.description is not None:
            self._arrays += [numpy_helper.from_array(array, name) for name, array in sorted(policy.weights.items())]

    def model(self, inputs: dict[str, int], outputs: Sequence[str], manifest: Manifest) -> bytes:
        """The finished file; `inputs` maps each one's name to its columns."""
        sizes = {OBSERVATION: len(manifest.observation.numbers), ACTION: self._actions.size, VELOCITY: self._actions.size}
        if memory := self._policy.memory_size:
            inputs, outputs, sizes[NEXT_MEMORY] = {**inputs, MEMORY: memory}, (*outputs, NEXT_MEMORY), memory
        model = helper.make_model(
            helper.make_graph(
                self._nodes,
                "mapless-policy",
                [_rows(name, columns) for name, columns in inputs.items()],
                [_rows(name, sizes[name]) for name in outputs],
                self._arrays,
            ),
            opset_imports=[helper.make_opsetid("", OPSET)],
            ir_version=IR_VERSION,
            producer_name="mapless",
        )
        helper.set_model_props(model, {"manifest": manifest.model_dump_json()})
        onnx.checker.check_model(model, full_check=True)
        data: bytes = model.SerializeToString()
        return data

    def act(self, observation: str) -> None:
        """The network, the bounds of its outputs, and the robot's limits."""
        description = self._policy.description
        if description is None:
            logits = self._traced(observation)
        else:
            values = Forward(description.lines).run({"x": observation, "h": MEMORY}, self._apply)
            logits = values["y"]
            if description.memory:
                self._node("Identity", values["h"], name=NEXT_MEMORY)
        bounded = [
            self._bounded(self._columns(logits, index, index + 1), component)
            for index, component in enumerate(self._actions.components)
        ]
        self._node("Concat", *bounded, name=ACTION, axis=1)
        limits = np.array(self._actions.limits, np.float32)
        scaled = self._node("Mul", ACTION, self._constant(limits))
        # Rounding may not push a velocity past its limit, whatever the runtime's sigmoid and tanh are made of.
        capped = self._node("Min", scaled, self._constant(limits))
        self._node("Max", capped, self._constant(limits * np.array(self._actions.lows, np.float32)), name=VELOCITY)

    def _bounded(self, logit: str, component: ActionComponent) -> str:
        """A column of logits as fractions of a limit."""
        if component.symmetric:
            return self._node("Tanh", logit)
        sigmoid = self._node("Sigmoid", logit)
        if component.low == 0.0:
            return sigmoid
        return self._node("Add", self._node("Mul", sigmoid, self._number(component.span)), self._number(component.low))

    def observe(self, specification: Specification) -> None:
        """The observation; `ros2/mapless_navigator/observation.py` has the same in NumPy, with its table."""
        told: dict[str, Callable[[], str]] = {"speeds": lambda: SPEEDS, "actions": lambda: LAST_ACTION}
        if POSE in scan_inputs(specification):
            told |= self._of_the_target(specification)
        columns = [
            self._seen(specification, part)
            if part.kind in READ_OFF_SCAN
            else (part.kind if part.brought else told[part.kind]())
            for part in specification.parts
        ]
        earlier = (PREVIOUS,) if specification.carried else ()
        self._node("Concat", *columns, *earlier, name=OBSERVATION, axis=1)

    def _of_the_target(self, specification: Specification) -> dict[str, Callable[[], str]]:
        """The parts that pose and target are needed for."""
        offset = self._node("Sub", TARGET, self._columns(POSE, 0, 2))
        distance = self._node("ReduceL2", offset, axes=[1], keepdims=1)
        direction = self._direction(offset, distance)
        heading = self._wrap(self._columns(POSE, 2, 3))
        bearing = self._wrap(self._node("Sub", direction, heading))
        one, pi = self._number(1.0), self._number(math.pi)
        return {
            "distance": lambda: self._node("Div", distance, self._node("Add", distance, one)),
            "distance_of_diagonal": lambda: self._node("Div", distance, self._number(specification.diagonal)),
            "direction": lambda: self._part_of_turn(direction),
            "bearing": lambda: self._node("Div", bearing, pi),
            "bearing_sine_cosine": lambda: self._node(
                "Concat", self._node("Sin", bearing), self._node("Cos", bearing), axis=1
            ),
            "heading": lambda: self._node("Div", heading, pi),
            "heading_turn": lambda: self._part_of_turn(heading),
            "deviation": lambda: self._node("Div", self._node("Abs", bearing), pi),
            "way": lambda: self._free_way(specification, bearing, distance),
            "reach_progress": lambda: self._reach_and_progress(specification, bearing, distance),
        }

    def _seen(self, specification: Specification, part: Part) -> str:
        """The scan as the policy sees it."""
        if part.kind == "reach":
            return self._nearness_of_reach(specification, self._reach(specification, part.size))
        scan = self._node("Min", RANGES, self._number(specification.range))
        batches = np.array([-1, part.size, specification.scan_size // part.size], np.int64)
        nearest = self._node("ReduceMin", self._node("Reshape", scan, self._constant(batches)), axes=[2], keepdims=0)
        if part.kind == "ranges":
            return self._node("Div", nearest, self._number(specification.range))
        near = self._number(specification.near)
        return self._node("Div", near, self._node("Max", nearest, near))

    def _free_way(self, specification: Specification, bearing: str, distance: str) -> str:
        """How much of the straight way is free, and whether all of it is."""
        limit = self._number(specification.range)
        x, y, is_short = self._ends(specification)
        cos, sin = self._node("Cos", bearing), self._node("Sin", bearing)
        along = self._node("Add", self._node("Mul", x, cos), self._node("Mul", y, sin))
        across = self._node("Sub", self._node("Mul", y, cos), self._node("Mul", x, sin))
        beside = self._node("Less", self._node("Abs", across), self._number(specification.near))
        ahead = self._node("GreaterOrEqual", along, self._number(0.0))
        meets = self._node("And", self._node("And", beside, ahead), is_short)
        nearest = self._node("ReduceMin", self._node("Where", meets, along, limit), axes=[1], keepdims=1)
        left = self._node("Sub", distance, self._number(specification.arrival_distance))
        length = self._node("Max", left, self._number(0.0))
        free = self._node("Min", length, nearest, limit)
        share = self._node("Div", free, self._node("Max", length, self._number(_TINY)))
        is_left = self._node("Greater", length, self._number(0.0))
        whole = self._node("Cast", self._node("GreaterOrEqual", free, length), to=TensorProto.FLOAT)
        return self._node("Concat", self._node("Where", is_left, share, self._number(1.0)), whole, axis=1)

    def _nearness_of_reach(self, specification: Specification, reach: str) -> str:
        """What is told of the reach: of each sector's directions the farthest."""
        near = self._number(specification.near)
        farthest = self._node("ReduceMax", reach, axes=[2], keepdims=0)
        return self._node("Div", near, self._node("Add", near, farthest))

    def _reach_and_progress(self, specification: Specification, bearing: str, distance: str) -> str:
        """What is told of the reach, and how much nearer to the target it would bring the robot."""
        (size,) = (part.size for part in specification.parts if part.kind == "reach_progress")
        reach = self._reach(specification, size // 2)
        directions = reach_directions(size // 2).reshape(1, -1, DIRECTIONS)
        one_each = self._constant(np.array([-1, 1, 1], np.int64))
        squares = []
        for operator, turned in (("Cos", np.cos(directions)), ("Sin", np.sin(directions))):
            to_go = self._node("Reshape", self._node("Mul", distance, self._node(operator, bearing)), one_each)
            left = self._node("Sub", to_go, self._node("Mul", reach, self._numbers(turned)))
            squares.append(self._node("Mul", left, left))
        least = self._node("ReduceMin", self._node("Sqrt", self._node("Add", *squares)), axes=[2], keepdims=0)
        progress = self._node("Div", self._node("Sub", distance, least), self._number(specification.range))
        return self._node("Concat", self._nearness_of_reach(specification, reach), progress, axis=1)

    def _reach(self, specification: Specification, sectors: int) -> str:
        """How far the robot could go along each direction of each sector, (n, sectors, directions)."""
        near, directions = self._number(specification.near), reach_directions(sectors)[:, None]
        cos, sin = self._numbers(np.cos(directions)), self._numbers(np.sin(directions))
        rays = self._constant(np.array([-1, 1, specification.scan_size], np.int64))
        x, y, is_short = (self._node("Reshape", values, rays) for values in self._ends(specification))
        along = self._node("Add", self._node("Mul", x, cos), self._node("Mul", y, sin))
        across = self._node("Sub", self._node("Mul", y, cos), self._node("Mul", x, sin))
        beside = self._node("Less", self._node("Abs", across), near)
        ahead = self._node("Greater", along, self._number(0.0))
        meets = self._node("And", self._node("And", beside, ahead), is_short)
        squared = self._node("Sub", self._number(specification.near**2), self._node("Mul", across, across))
        before = self._node("Sqrt", self._node("Max", squared, self._number(0.0)))
        until = self._node("Max", self._node("Sub", along, before), self._number(0.0))
        free = self._node("Where", meets, until, self._number(specification.range))
        nearest = self._node("ReduceMin", free, axes=[2], keepdims=0)
        return self._node("Reshape", nearest, self._constant(np.array([-1, sectors, DIRECTIONS], np.int64)))

    def _ends(self, specification: Specification) -> tuple[str, str, str]:
        """Where readings end, x and y in the robot's frame, and whether they end within the range."""
        limit = self._number(specification.range)
        scan = self._node("Min", RANGES, limit)
        mounts = np.repeat(np.array(specification.mounts), specification.rays, axis=0)
        angles = np.tile(ray_angles(specification), len(specification.mounts)) + mounts[:, 2]
        x, y = (
            self._node("Add", self._node("Mul", scan, self._numbers(turned)), self._numbers(place))
            for turned, place in ((np.cos(angles), mounts[:, 0]), (np.sin(angles), mounts[:, 1]))
        )
        return x, y, self._node("Less", scan, limit)

    def _direction(self, offset: str, distance: str) -> str:
        """atan2(dy, dx), which ONNX lacks, as 2 atan(dy / (d + dx)), or 2 atan((d - dx) / dy) where d + dx would cancel."""
        dx, dy = self._columns(offset, 0, 1), self._columns(offset, 1, 2)
        ahead = self._node("Div", dy, self._node("Max", self._node("Add", distance, dx), self._number(_TINY)))
        behind = self._node("Div", self._node("Sub", distance, dx), dy)
        tangent = self._node("Where", self._node("Less", dx, self._number(0.0)), behind, ahead)
        return self._node("Mul", self._node("Atan", tangent), self._number(2.0))

    def _wrap(self, angle: str) -> str:
        """An angle in [-pi, pi)."""
        turns = self._node(
            "Floor",
            self._node("Div", self._node("Add", angle, self._number(math.pi)), self._number(2.0 * math.pi)),
        )
        return self._node("Sub", angle, self._node("Mul", turns, self._number(2.0 * math.pi)))

    def _part_of_turn(self, angle: str) -> str:
        """(angle mod 2 pi) / 2 pi."""
        turns = self._node("Div", angle, self._number(2.0 * math.pi))
        return self._node("Sub", turns, self._node("Floor", turns))

    def _apply(self, name: str, *arguments: Any) -> str:
        """An operator or a layer of a formula, see `Forward`."""
        if name in _OPERATORS:
            return self._node(_OPERATORS[name], *arguments)
        match name:
            case "leaky_relu":
                return self._node("LeakyRelu", *arguments, alpha=LEAKY_SLOPE)
            case "concatenate":
                return self._node("Concat", *arguments, axis=1)
            case "columns":
                return self._columns(*arguments)
            case "channels":
                values, count = arguments
                return self._node("Reshape", values, self._constant(np.array([0, count, -1], np.int64)))
            case "flatten":
                return self._node("Flatten", *arguments, axis=1)
        values, *numbers = arguments
        weight, bias = f"{name}.weight", f"{name}.bias"
        if not numbers:
            return self._node("Gemm", values, weight, bias, transB=1)
        stride, padding = numbers
        return self._node("Conv", values, weight, bias, strides=[stride], pads=[padding, padding])

    def _traced(self, observation: str) -> str:
        """The nodes that torch makes of a module."""
        model = onnx.load_model_from_string(trace(self._policy))
        prefixed = onnx.compose.add_prefix(model, "network/").graph
        (given,), (made,) = prefixed.input, prefixed.output
        self._nodes.append(helper.make_node("Identity", [observation], [given.name]))
        self._nodes += prefixed.node
        self._arrays += prefixed.initializer
        return str(made.name)

    def _columns(self, values: str, start: int, end: int) -> str:
        bounds = (self._constant(np.array([bound], np.int64)) for bound in (start, end, 1))
        return self._node("Slice", values, *bounds)

    def _node(self, operator: str, *inputs: str, name: str | None = None, **attributes: Any) -> str:
        output = name or f"{operator.lower()}_{len(self._nodes)}"
        self._nodes.append(helper.make_node(operator, list(inputs), [output], **attributes))
        return output

    def _number(self, value: float) -> str:
        return self._constant(np.float32(value))

    def _numbers(self, values: NDArray[np.float64]) -> str:
        return self._constant(values.astype(np.float32))

    def _constant(self, values: NDArray[np.generic] | np.generic) -> str:
        name = f"constant_{len(self._arrays)}"
        self._arrays.append(numpy_helper.from_array(np.asarray(values), name))
        return name


def _rows(name: str, columns: int) -> onnx.ValueInfoProto:
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", columns])

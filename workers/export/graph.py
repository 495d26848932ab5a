"""A policy as an ONNX graph, written node by node: from the observation, or from scan, pose and target.

| graph       | inputs                                                      | outputs                             |
|-------------|-------------------------------------------------------------|-------------------------------------|
| observation | `observation` (n, size) as the manifest describes it         | `action`, `velocity`                |
| scan        | `ranges` (n, rays), `pose` (n, 3), `target` (n, 2),          | `observation`, `action`, `velocity` |
|             | `last_action` (n, 2); with stacked frames `previous`,        |                                     |
|             | all but the last frame of the last `observation`             |                                     |

`action` (n, 2) is in [0, 1] and [-1, 1]; `velocity` (n, 2) in m/s and rad/s, cut at the robot's limits. All numbers are
float32. The manifest is in the file's metadata.
"""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import onnx
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

from workers.config import ResBlockNetwork
from workers.export.ros2.mapless_navigator.policy import Specification
from workers.manifest import Manifest
from workers.networks.layout import ACTION_SIZE, LEAKY_SLOPE, layout
from workers.policy import Policy

# Old enough for every runtime that robots carry; every operator used here is older still.
OPSET = 17
IR_VERSION = 8

OBSERVATION, ACTION, VELOCITY = "observation", "action", "velocity"
RANGES, POSE, TARGET, LAST_ACTION, PREVIOUS = "ranges", "pose", "target", "last_action", "previous"

# Keeps a quotient finite; far below any distance that matters.
_TINY = 1e-12


def observation_graph(policy: Policy, specification: Specification, manifest: Manifest) -> bytes:
    """The policy on its observation, as an ONNX file."""
    graph = _Graph(policy)
    graph.act(OBSERVATION, specification)
    return graph.model({OBSERVATION: specification.observation_size}, (ACTION, VELOCITY), manifest)


def scan_graph(policy: Policy, specification: Specification, manifest: Manifest) -> bytes:
    """The policy on scan, pose, target and its last action, as an ONNX file that makes the observation itself."""
    graph = _Graph(policy)
    graph.observe(specification)
    graph.act(OBSERVATION, specification)
    inputs = {RANGES: specification.rays, POSE: 3, TARGET: 2, LAST_ACTION: ACTION_SIZE}
    if specification.frames > 1:
        inputs[PREVIOUS] = specification.observation_size - specification.frame_size
    return graph.model(inputs, (OBSERVATION, ACTION, VELOCITY), manifest)


class _Graph:
    """Nodes and arrays of the graph under construction; each method returns the name of its result."""

    def __init__(self, policy: Policy) -> None:
        self._network = policy.network
        self._layout = layout(policy.network)
        self._nodes: list[onnx.NodeProto] = []
        self._arrays = [numpy_helper.from_array(array, name) for name, array in sorted(policy.weights.items())]

    def model(self, inputs: dict[str, int], outputs: Sequence[str], manifest: Manifest) -> bytes:
        """The finished file; `inputs` maps each one's name to its columns."""
        sizes = {OBSERVATION: len(manifest.observation.numbers), ACTION: ACTION_SIZE, VELOCITY: ACTION_SIZE}
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

    def act(self, observation: str, specification: Specification) -> None:
        """The network, the bounds of its outputs, and the robot's limits."""
        resblock = isinstance(self._network, ResBlockNetwork)
        logits = self._resblock(observation) if resblock else self._mlp(observation)
        bounded = self._node("Sigmoid", self._columns(logits, 0, 1)), self._node("Tanh", self._columns(logits, 1, 2))
        self._node("Concat", *bounded, name=ACTION, axis=1)
        limits = np.array([specification.max_linear_speed, specification.max_angular_speed], np.float32)
        scaled = self._node("Mul", ACTION, self._constant(limits))
        # Rounding may not push a velocity past its limit, whatever the runtime's sigmoid and tanh are made of.
        capped = self._node("Min", scaled, self._constant(limits))
        self._node("Max", capped, self._constant(limits * np.array([0.0, -1.0], np.float32)), name=VELOCITY)

    def observe(self, specification: Specification) -> None:
        """The observation; `ros2/mapless_navigator/observation.py` has the same in NumPy, with its table."""
        scan = self._node("Min", RANGES, self._number(specification.range))
        batches = np.array([-1, specification.batches, specification.rays // specification.batches], np.int64)
        nearest = self._node("ReduceMin", self._node("Reshape", scan, self._constant(batches)), axes=[2], keepdims=0)
        offset = self._node("Sub", TARGET, self._columns(POSE, 0, 2))
        distance = self._node("ReduceL2", offset, axes=[1], keepdims=1)
        direction = self._direction(offset, distance)
        heading = self._wrap(self._columns(POSE, 2, 3))
        bearing = self._wrap(self._node("Sub", direction, heading))
        if specification.observation == "paper":
            seen = self._node("Div", nearest, self._number(specification.range))
            goal = (
                self._node("Div", distance, self._number(specification.diagonal)),
                self._part_of_turn(direction),
                self._part_of_turn(heading),
            )
        else:
            near = self._number(specification.near)
            seen = self._node("Div", near, self._node("Max", nearest, near))
            goal = (
                self._node("Div", distance, self._node("Add", distance, self._number(1.0))),
                self._node("Div", bearing, self._number(math.pi)),
                self._node("Div", heading, self._number(math.pi)),
            )
        deviation = self._node("Div", self._node("Abs", bearing), self._number(math.pi))
        earlier = (PREVIOUS,) if specification.frames > 1 else ()
        self._node("Concat", seen, LAST_ACTION, *goal, deviation, *earlier, name=OBSERVATION, axis=1)

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

    def _mlp(self, values: str) -> str:
        *hidden, head = self._layout.layers
        operator = "Relu" if self._layout.activation == "relu" else "Tanh"
        for layer in hidden:
            values = self._node(operator, self._linear(layer, values))
        return self._linear(head, values)

    def _resblock(self, inputs: str) -> str:
        hidden = self._linear("layer2", self._leaky(self._linear("layer1", inputs)))
        first = self._leaky(self._node("Concat", hidden, inputs, axis=1))
        hidden = self._leaky(self._linear("layer4", self._leaky(self._linear("layer3", first))))
        second = self._leaky(self._node("Concat", hidden, first, axis=1))
        return self._linear("head", second)

    def _linear(self, layer: str, inputs: str) -> str:
        return self._node("Gemm", inputs, f"{layer}.weight", f"{layer}.bias", transB=1)

    def _leaky(self, values: str) -> str:
        return self._node("LeakyRelu", values, alpha=LEAKY_SLOPE)

    def _columns(self, values: str, start: int, end: int) -> str:
        bounds = (self._constant(np.array([bound], np.int64)) for bound in (start, end, 1))
        return self._node("Slice", values, *bounds)

    def _node(self, operator: str, *inputs: str, name: str | None = None, **attributes: Any) -> str:
        output = name or f"{operator.lower()}_{len(self._nodes)}"
        self._nodes.append(helper.make_node(operator, list(inputs), [output], **attributes))
        return output

    def _number(self, value: float) -> str:
        return self._constant(np.float32(value))

    def _constant(self, values: NDArray[np.generic] | np.generic) -> str:
        name = f"constant_{len(self._arrays)}"
        self._arrays.append(numpy_helper.from_array(np.asarray(values), name))
        return name


def _rows(name: str, columns: int) -> onnx.ValueInfoProto:
    return helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", columns])

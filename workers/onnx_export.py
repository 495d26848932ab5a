"""A policy as an ONNX graph, checked against the policy itself before anybody gets it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import onnx
import onnxruntime
from numpy.typing import NDArray
from onnx import TensorProto, helper, numpy_helper

from workers.config import ResBlockNetwork
from workers.errors import ExportError
from workers.layout import LEAKY_SLOPE, layout
from workers.manifest import Manifest
from workers.policy import Policy

# Old enough for every runtime that robots carry; every operator used here is older still.
OPSET = 17
IR_VERSION = 8

TOLERANCE = 1e-5
_CHECKED_OBSERVATIONS = 1000

OBSERVATION, ACTION, VELOCITY = "observation", "action", "velocity"


def export_onnx(policy: Policy, manifest: Manifest) -> bytes:
    """The policy as an ONNX file.

    Its input `observation` (n, size) is as the manifest describes it, number by number. Its outputs are `action` (n, 2),
    the policy's own, and `velocity` (n, 2), the same in m/s and rad/s. The manifest is in the file's metadata.

    Raises:
        ExportError: onnxruntime does not compute what the policy does.
    """
    graph = _Graph(policy)
    logits = graph.resblock() if isinstance(policy.network, ResBlockNetwork) else graph.mlp()
    linear, angular = graph.split(logits)
    graph.node("Concat", [graph.node("Sigmoid", [linear]), graph.node("Tanh", [angular])], name=ACTION, axis=1)
    robot = manifest.training.task.robot
    limits = np.array([robot.max_linear_speed, robot.max_angular_speed], np.float32)
    graph.node("Mul", [ACTION, graph.constant("velocity_limits", limits)], name=VELOCITY)

    size = len(manifest.observation.numbers)
    model = helper.make_model(
        helper.make_graph(
            graph.nodes,
            "mapless-policy",
            [helper.make_tensor_value_info(OBSERVATION, TensorProto.FLOAT, ["n", size])],
            [helper.make_tensor_value_info(name, TensorProto.FLOAT, ["n", 2]) for name in (ACTION, VELOCITY)],
            graph.initializers,
        ),
        opset_imports=[helper.make_opsetid("", OPSET)],
        ir_version=IR_VERSION,
        producer_name="mapless",
    )
    helper.set_model_props(model, {"manifest": manifest.model_dump_json()})
    onnx.checker.check_model(model, full_check=True)
    data: bytes = model.SerializeToString()
    check_onnx(data, policy, size)
    return data


def check_onnx(data: bytes, policy: Policy, observation_size: int) -> None:
    """Compares an ONNX file with a policy over random observations.

    Raises:
        ExportError: an action differs by more than `TOLERANCE`.
    """
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(data, options, providers=["CPUExecutionProvider"])
    rng = np.random.default_rng(0)
    observations = rng.uniform(-1.0, 1.0, (_CHECKED_OBSERVATIONS, observation_size)).astype(np.float32)
    (actions,) = session.run([ACTION], {OBSERVATION: observations})
    error = float(np.abs(actions - policy(observations)).max())
    if not error <= TOLERANCE:
        raise ExportError(
            f"the ONNX graph's actions are up to {error:.1e} off, more than {TOLERANCE:.0e}: do not use it, and report this"
        )


class _Graph:
    """Nodes and arrays of the graph under construction; each method returns the name of its result."""

    def __init__(self, policy: Policy) -> None:
        self._layout = layout(policy.network)
        self.nodes: list[onnx.NodeProto] = []
        self.initializers = [numpy_helper.from_array(array, name) for name, array in policy.weights.items()]

    def node(self, operator: str, inputs: Sequence[str], name: str | None = None, **attributes: Any) -> str:
        output = name or f"{operator.lower()}_{len(self.nodes)}"
        self.nodes.append(helper.make_node(operator, list(inputs), [output], **attributes))
        return output

    def constant(self, name: str, values: NDArray[np.generic]) -> str:
        self.initializers.append(numpy_helper.from_array(values, name))
        return name

    def linear(self, layer: str, inputs: str) -> str:
        return self.node("Gemm", [inputs, f"{layer}.weight", f"{layer}.bias"], transB=1)

    def mlp(self) -> str:
        *hidden, head = self._layout.layers
        operator = "Relu" if self._layout.activation == "relu" else "Tanh"
        values = OBSERVATION
        for layer in hidden:
            values = self.node(operator, [self.linear(layer, values)])
        return self.linear(head, values)

    def leaky(self, values: str) -> str:
        return self.node("LeakyRelu", [values], alpha=LEAKY_SLOPE)

    def resblock(self) -> str:
        hidden = self.linear("layer2", self.leaky(self.linear("layer1", OBSERVATION)))
        first = self.leaky(self.node("Concat", [hidden, OBSERVATION], axis=1))
        hidden = self.leaky(self.linear("layer4", self.leaky(self.linear("layer3", first))))
        second = self.leaky(self.node("Concat", [hidden, first], axis=1))
        return self.linear("head", second)

    def split(self, logits: str) -> tuple[str, str]:
        bounds = [self.constant(f"column_{k}", np.array([k], np.int64)) for k in range(3)]
        linear = self.node("Slice", [logits, bounds[0], bounds[1], bounds[1]])
        angular = self.node("Slice", [logits, bounds[1], bounds[2], bounds[1]])
        return linear, angular

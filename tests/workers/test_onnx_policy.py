"""Policies of somebody else's: what onnxruntime runs and fits the task drives, all else is refused with the reason."""

from pathlib import Path

import numpy as np
import onnx
import pytest
from onnx import TensorProto, helper

from sim.config import TaskConfig
from sim.observations import observation_layout
from workers.checkpoints import read_policy
from workers.errors import ForeignPolicyError
from workers.export.bundle import export_checkpoint
from workers.onnx_policy import OnnxPolicy
from workers.policy import torch_policy
from workers.shipped.library import shipped_policy

SIZE = observation_layout(TaskConfig()).size


def graph(
    *, rows: int | str = "n", numbers: int | str = SIZE, actions: int = 2, name: str = "observation", scale: float = 0.0
) -> bytes:
    """One matrix product: observation (rows, numbers) to action (rows, actions), all weights `scale`."""
    width = numbers if isinstance(numbers, int) else SIZE
    weights = helper.make_tensor("w", TensorProto.FLOAT, (width, actions), [scale] * (width * actions))
    made = helper.make_graph(
        [helper.make_node("MatMul", [name, "w"], ["action"])],
        "policy",
        [helper.make_tensor_value_info(name, TensorProto.FLOAT, (rows, numbers))],
        [helper.make_tensor_value_info("action", TensorProto.FLOAT, (rows, actions))],
        [weights],
    )
    model = helper.make_model(made, opset_imports=[helper.make_opsetid("", 17)], ir_version=8)
    content: bytes = model.SerializeToString()
    return content


def test_an_exported_policy_acts_as_it_does_here() -> None:
    archive = shipped_policy("simple").archive
    manifest, policy = read_policy(archive)
    foreign = OnnxPolicy(export_checkpoint(archive).by_observation, manifest.training.task)
    observations = np.random.default_rng(0).uniform(0.0, 1.0, (64, policy.inputs.size)).astype(np.float32)
    np.testing.assert_allclose(foreign(observations), torch_policy(policy)(observations), atol=1e-5)


def test_actions_beyond_the_limits_are_cut() -> None:
    actions = OnnxPolicy(graph(scale=100.0), TaskConfig())(np.ones((3, SIZE), np.float32))
    assert (actions == 1.0).all()
    lowest = OnnxPolicy(graph(scale=-100.0), TaskConfig())(np.ones((3, SIZE), np.float32))
    # The default robot does not reverse.
    np.testing.assert_array_equal(lowest, [[0.0, -1.0]] * 3)


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        (b"no graph at all", "no ONNX file"),
        (
            helper.make_model(helper.make_graph([], "nothing", [], [])).SerializeToString(),
            "does not run this file|is missing",
        ),
        (graph(numbers=SIZE + 1), rf"'observation' is \(n, {SIZE + 1}\), and this robot, LiDAR and observation make it"),
        (graph(actions=3), r"'action' is \(n, 3\)"),
        (graph(name="scan"), "asks for scan"),
        (graph(rows=1), "for 1 robots at a time"),
    ],
)
def test_what_does_not_fit_is_refused(content: bytes, reason: str) -> None:
    with pytest.raises(ForeignPolicyError, match=reason):
        OnnxPolicy(content, TaskConfig())


def test_actions_that_are_no_numbers_are_refused() -> None:
    policy = OnnxPolicy(graph(scale=float("nan")), TaskConfig())
    with pytest.raises(ForeignPolicyError, match="finite"):
        policy(np.ones((2, SIZE), np.float32))
    # A size that only shows when it runs.
    free = OnnxPolicy(graph(numbers="any"), TaskConfig())
    with pytest.raises(ForeignPolicyError, match="does not run"):
        free(np.ones((2, SIZE + 3), np.float32))


def test_a_graph_reads_no_file_of_this_machine(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # Weights that lie in another file: a graph could name any.
    model = onnx.load_from_string(graph())
    secret = tmp_path / "secret"
    secret.write_bytes(bytes(4 * SIZE * 2))
    (weights,) = model.graph.initializer
    weights.ClearField("float_data")
    weights.data_location = TensorProto.EXTERNAL
    for key, value in (("location", "secret"), ("length", str(4 * SIZE * 2))):
        entry = weights.external_data.add()
        entry.key, entry.value = key, value
    monkeypatch.chdir(tmp_path)
    with pytest.raises(ForeignPolicyError, match="keeps its weights in another one"):
        OnnxPolicy(model.SerializeToString(), TaskConfig())
    # Nor one that is hidden in a branch.
    branch = onnx.load_from_string(graph())
    (node,) = branch.graph.node
    node.attribute.append(helper.make_attribute("body", model.graph))
    with pytest.raises(ForeignPolicyError, match="keeps its weights in another one"):
        OnnxPolicy(branch.SerializeToString(), TaskConfig())

"""ONNX Runtime tells nobody what it runs: neither in a worker, nor on a robot by the bundle's node."""

import ast
import os
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]

_GRAPH = """
from onnx import TensorProto, helper
value = [helper.make_tensor_value_info(name, TensorProto.FLOAT, (1, 1)) for name in "xy"]
graph = helper.make_graph([helper.make_node("Identity", ["x"], ["y"])], "identity", value[:1], value[1:])
model = helper.make_model(graph, opset_imports=[helper.make_opsetid("", 17)], ir_version=8).SerializeToString()
"""


@pytest.mark.parametrize(
    "session",
    [
        "from workers.onnx_runtime import session\nsession(model)",
        "from workers.export.ros2.mapless_navigator.policy import _session\n_session(model)",
    ],
    ids=["worker", "robot"],
)
def test_nothing_is_kept_of_the_machine_that_could_be_reported(session: str, tmp_path: Path) -> None:
    # In CI, and told not to by somebody else, it is silent by itself.
    silent = ("CI", "ORT_DISABLE_TELEMETRY", "XDG_CACHE_HOME")
    environment = {name: value for name, value in os.environ.items() if name not in silent}
    subprocess.run([sys.executable, "-c", _GRAPH + session], cwd=ROOT, env=environment | {"HOME": str(tmp_path)}, check=True)
    assert [path for path in tmp_path.rglob("*") if "onnxruntime" in path.name] == []


def test_it_is_loaded_in_these_two_places_alone() -> None:
    loading = {
        str(path.relative_to(ROOT))
        for room in ("sim", "workers", "server")
        for path in (ROOT / room).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text()))
        if isinstance(node, ast.Import) and any(name.name == "onnxruntime" for name in node.names)
    }
    assert loading == {"workers/onnx_runtime.py", "workers/export/ros2/mapless_navigator/policy.py"}

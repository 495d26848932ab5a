"""What is compiled: that it is never older than what it was compiled from."""

import ast
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

import sim.kernels
import workers.kernels
from sim.kernels.movers import move_movers
from sim.kernels.options import bound, kernels_in
from sim.kernels.sensing import scan_poses
from sim.kernels.step import step_usual_robots
from workers.kernels.adam import adam_step
from workers.kernels.dense import tanh


def folder_of(package: ModuleType) -> Path:
    (folder,) = package.__path__
    return Path(folder)


def test_compiled_code_is_kept_by_the_sources_of_all_kernels(tmp_path: Path) -> None:
    # Numba alone would go on with a `step_usual_robots` that was compiled with yesterday's `sense`.
    def key(folder: Path) -> str:
        @kernels_in(folder)()
        def nothing() -> None:
            pass

        return Path(nothing.stats.cache_path).parent.name

    assert {Path(kernel.stats.cache_path).parent.name for kernel in (step_usual_robots, move_movers, scan_poses)} == {
        key(folder_of(sim.kernels))
    }
    assert Path(tanh.stats.cache_path).parent.name == key(folder_of(workers.kernels))
    (tmp_path / "one.py").write_text("SLOPE = 0.01")
    before = key(tmp_path)
    assert key(tmp_path) == before
    (tmp_path / "one.py").write_text("SLOPE = 0.02")
    assert key(tmp_path) != before


@pytest.mark.parametrize("package", [sim.kernels, workers.kernels])
def test_kernels_use_nothing_of_ours_that_their_key_leaves_out(package: ModuleType) -> None:
    for path in folder_of(package).glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [node.module or ""] if isinstance(node, ast.ImportFrom) else []
            names += [alias.name for alias in node.names] if isinstance(node, ast.Import) else []
            ours = [name for name in names if name.split(".")[0] in {"sim", "workers", "server"}]
            beyond = [name for name in ours if not name.startswith(package.__name__) and name != "sim.kernels.options"]
            assert not beyond, f"{path.name} takes from {beyond}"


def test_a_kernel_that_is_bound_is_its_code_for_those_types() -> None:
    numbers = np.array([0.5, -2.0, 3.0], np.float32)
    gradients, mean, square = np.full((3, 3), 0.25, np.float32)
    given = (numbers.copy(), gradients, mean, square, 1e-3, 1e-8)
    bound(adam_step, *given)(*given)
    again = (numbers.copy(), gradients, np.full(3, 0.25, np.float32), np.full(3, 0.25, np.float32), 1e-3, 1e-8)
    adam_step(*again)
    np.testing.assert_array_equal(given[0], again[0])

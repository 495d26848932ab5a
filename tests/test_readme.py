"""What the README shows works as it stands there, in an environment that has never seen torch."""

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from workers.checkpoints import Checkpoint, read_policy, write_checkpoint
from workers.manifest import TrainingCounters
from workers.shipped.library import shipped_policy

ROOT = Path(__file__).parents[1]
# What the arena and the README's lines need; versions are those that are locked.
PACKAGES = ("gymnasium", "numba", "numpy", "pydantic", "pymunk", "safetensors", "scipy")


@pytest.fixture(scope="module")
def clean_python(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The interpreter of a virtual environment with `PACKAGES` and nothing of this project's."""
    directory = tmp_path_factory.mktemp("clean") / "venv"
    python = directory / "bin" / "python"
    uv = (sys.executable, "-m", "uv")
    subprocess.run([*uv, "venv", "-q", "--python", sys.executable, str(directory)], check=True)
    install = [*uv, "pip", "install", "-q", "--python", str(python), "-c", str(ROOT / "requirements.txt"), *PACKAGES]
    subprocess.run(install, check=True)
    return python


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    """A policy that was trained well, in an archive as one is written today."""
    manifest, policy = read_policy(shipped_policy("simple").archive)
    counters = TrainingCounters(step=manifest.step, updates=1, evaluations=1)
    path = tmp_path / "checkpoint.zip"
    write_checkpoint(path, Checkpoint(manifest, dict(policy.weights), {"none": np.zeros(1)}, counters))
    return path


def test_a_downloaded_policy_drives_the_arena_with_numpy_alone(clean_python: Path, archive: Path) -> None:
    (code,) = re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text("utf-8"), re.DOTALL)
    result = subprocess.run(
        [str(clean_python), "-c", code, str(archive)], cwd=ROOT, capture_output=True, text=True, timeout=240
    )
    assert result.returncode == 0, result.stderr
    arrivals = re.fullmatch(r"(\d+) targets reached in 400 s\n", result.stdout)
    assert arrivals is not None
    assert int(arrivals.group(1)) >= 15  # 20 s for each


def test_the_environment_is_clean(clean_python: Path) -> None:
    without = subprocess.run([str(clean_python), "-c", "import torch"], capture_output=True, cwd=ROOT)
    assert without.returncode != 0

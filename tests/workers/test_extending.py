"""What a new extension is made of, and what those do with it that have not got it."""

import json
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import numpy as np
import onnx
import pytest

from workers.checkpoints import read_policy
from workers.errors import ArchiveExtensionError
from workers.export.ros2.mapless_navigator.navigator import Navigator, Safety, State
from workers.export.ros2.mapless_navigator.observation import Scan, observe
from workers.export.ros2.mapless_navigator.policy import Policy, PolicyFileError
from workers.extending.new import write_package

ROOT = Path(__file__).parents[2]


def test_the_tests_of_a_new_extension_pass_as_they_are_written(tmp_path: Path) -> None:
    """The package is found by its name alone; one process trains in it, whose last checkpoint comes back."""
    folder = write_package("our_lab", tmp_path)
    assert not [path for path in folder.rglob("*") if path.is_file() and "my_lab" in path.read_text(encoding="utf-8")]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join([str(folder), str(ROOT)]), "MAPLESS_EXTENSIONS": "our_lab"}
    archives = tmp_path / "archives"
    command = [sys.executable, "-m", "pytest", "-q", "-p", "no:cacheprovider", "--basetemp", str(archives)]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    archive = next(archives.rglob("step-2048.zip"))
    with zipfile.ZipFile(archive) as opened:
        training = json.loads(opened.read("manifest.json"))["training"]
    assert training["extensions"] == [{"name": "our_lab", "version": "0.1.0", "source": "pip install our_lab==0.1.0"}]
    bundle = tmp_path / "bundle.zip"
    export = [sys.executable, "-m", "workers", "export", str(archive), "--format", "bundle", "-o", str(bundle)]
    subprocess.run(export, cwd=ROOT, env=environment, check=True, capture_output=True)
    with zipfile.ZipFile(bundle) as opened:
        opened.extractall(tmp_path)
    # This process has no our_lab, as a robot has not.
    takes_its_numbers_along(tmp_path / "mapless-policy")
    with pytest.raises(
        ArchiveExtensionError, match=r"needs our_lab 0\.1\.0, .* install it \(pip install our_lab==0\.1\.0\)"
    ):
        read_policy(archive)


def takes_its_numbers_along(bundle: Path) -> None:
    """What a bundle does whose policy sees a part of an extension: all that it can, and it says what it can't."""
    policy = Policy.load(bundle / "policy")
    size = policy.specification.observation_size
    assert policy.actions(np.zeros((3, size), np.float32)).shape == (3, 2)
    scan, pose, target, action = np.ones((1, 30)), np.zeros((1, 3)), np.ones((1, 2)), np.zeros((1, 2))
    reason = r"sees 'our_lab.opening', 2 numbers that code of the extension 'our_lab' makes, which is not in this program"
    with pytest.raises(PolicyFileError, match=reason):
        observe(policy.specification, scan, pose, target, action)
    with pytest.raises(PolicyFileError, match=reason):
        Navigator(policy, Safety.of(policy.specification))
    made = {"our_lab.opening": np.array([[0.25, 0.75]])}
    seen = observe(policy.specification, scan, pose, target, action, added=made)
    np.testing.assert_allclose(seen[0, -2:], [0.25, 0.75])
    navigator = Navigator(policy, Safety.of(policy.specification), lambda *_known: made)
    navigator.set_scan(10.0, Scan(-np.pi, np.pi / 180.0, 0.05, 3.5, np.full(360, 3.0)))
    navigator.set_odometry(10.0, 0.0, 0.0, 0.0)
    navigator.set_goal(2.0, 0.5)
    assert navigator.command(10.1).state is State.DRIVING
    inputs = onnx.load(bundle / "policy_from_scan.onnx").graph.input
    assert [one.type.tensor_type.shape.dim[1].dim_value for one in inputs if one.name == "our_lab.opening"] == [2]
    readme = (bundle / "README.md").read_text()
    assert "Code of an extension makes `our_lab.opening`" in readme
    assert "our_lab 0.1.0 (`pip install our_lab==0.1.0`)" in readme
    for example in re.findall(r"```python\n(.*?)```", readme, re.DOTALL):
        done = subprocess.run([sys.executable, "-c", example], cwd=bundle, capture_output=True, text=True, check=False)
        assert "m/s" in done.stdout, done.stderr


@pytest.mark.parametrize("name", ["", "My Lab", "../lab", "1lab", "x" * 31])
def test_a_name_that_no_extension_can_have_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="can't be a name"):
        write_package(name, tmp_path)


def test_what_is_there_is_not_overwritten(tmp_path: Path) -> None:
    write_package("lab", tmp_path)
    with pytest.raises(ValueError, match="is there already"):
        write_package("lab", tmp_path)

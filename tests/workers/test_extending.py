"""What a new extension is made of, and what those do with it that have not got it."""

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from workers.checkpoints import read_policy
from workers.errors import ArchiveExtensionError
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
    # This process has no our_lab.
    with pytest.raises(
        ArchiveExtensionError, match=r"needs our_lab 0\.1\.0, .* install it \(pip install our_lab==0\.1\.0\)"
    ):
        read_policy(archive)


@pytest.mark.parametrize("name", ["", "My Lab", "../lab", "1lab", "x" * 31])
def test_a_name_that_no_extension_can_have_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="can't be a name"):
        write_package(name, tmp_path)


def test_what_is_there_is_not_overwritten(tmp_path: Path) -> None:
    write_package("lab", tmp_path)
    with pytest.raises(ValueError, match="is there already"):
        write_package("lab", tmp_path)

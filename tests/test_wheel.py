"""The package as it is installed where there is no checkout: each module once, the client by its own name."""

import subprocess
import sys
import zipfile
from pathlib import Path

ROOT = Path(__file__).parents[1]


def test_a_wheel_holds_every_package_once(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(tmp_path)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = tmp_path.iterdir()
    names = zipfile.ZipFile(wheel).namelist()
    assert len(names) == len(set(names))
    assert {name.split("/")[0] for name in names if "/" in name and ".dist-info" not in name} == {
        "sim",
        "workers",
        "server",
        "mapless_client",
    }
    assert "mapless_client/__init__.py" in names
    assert not [name for name in names if name.startswith("server/client/")]
    # What is read beside the code comes along.
    beside = ("sim/suites/data/complex-200.json", "workers/shipped/policies/complex/policy.zip", "server/replays/assets")
    for needed in beside:
        assert any(name.startswith(needed) for name in names), needed

"""What stops an installation is said in one line that tells what to do."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """As much of the project as `make` needs to begin."""
    for name in ("Makefile", "requirements-uv.txt", "requirements.txt", "pyproject.toml"):
        shutil.copy(ROOT / name, tmp_path)
    return tmp_path


def first_refusal(checkout: Path, python: str, **environment: str) -> str:
    """The line that `make run` ends with; it must have failed, and left make's own remark as the only other."""
    result = subprocess.run(
        ["make", "run", f"PYTHON={python}"],
        cwd=checkout,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=120,
    )
    assert result.returncode != 0
    (line,) = [line for line in result.stdout.splitlines() if line.startswith("mapless:")]
    return line


def fake_python(directory: Path, script: str) -> str:
    path = directory / "fake-python"
    path.write_text(f"#!/bin/sh\n{script}\n")
    path.chmod(0o755)
    return str(path)


def test_no_python(checkout: Path) -> None:
    assert "not found: install Python 3.11 or newer" in first_refusal(checkout, "python-that-is-not-there")


def test_an_old_python(checkout: Path) -> None:
    old = fake_python(checkout, '[ "$1" = -V ] && echo "Python 3.9.2" && exit 0; exit 1')
    assert "Python 3.11 or newer is needed, this is Python 3.9.2" in first_refusal(checkout, old)


def test_no_venv_module(checkout: Path) -> None:
    crippled = fake_python(checkout, 'case "$2" in *ensurepip*) exit 1;; esac; exit 0')
    assert "apt install python3-venv" in first_refusal(checkout, crippled)


def test_no_network(checkout: Path) -> None:
    nowhere = "http://127.0.0.1:9/simple"
    offline = {"PIP_INDEX_URL": nowhere, "PIP_RETRIES": "0", "PIP_NO_CACHE_DIR": "1", "PIP_CONFIG_FILE": os.devnull}
    # An environment that is made at once: a real one takes seconds, and is what these tests run in.
    environment = "mkdir -p .venv/bin && cp fake-python .venv/bin/python"
    python = fake_python(checkout, f'[ "$2" = venv ] && {environment} || exec {sys.executable} "$@"')
    line = first_refusal(checkout, python, **offline, PIP_FIND_LINKS="")
    assert "is there a network? Then run make again" in line


@pytest.mark.services
@pytest.mark.timeout(300)
def test_the_bills_of_materials_list_what_the_locks_name() -> None:
    """Installs the tool on its first run, and so takes a network as `make run` does."""
    made = subprocess.run(["make", "sbom"], cwd=ROOT, capture_output=True, text=True, check=False)
    if made.returncode and os.environ.get("REQUIRE_SERVICES") != "1":
        pytest.skip(f"the tool is not installed, and can not be: {made.stderr[-500:]}")
    assert made.returncode == 0, made.stderr

    for part in ("server", "worker"):
        locked = re.findall(r"^([\w.-]+)==([^\s;]+)", (ROOT / f"requirements-{part}.txt").read_text(), re.MULTILINE)
        bill = json.loads((ROOT / "build" / "sbom" / f"{part}.cdx.json").read_text())
        assert bill["bomFormat"] == "CycloneDX"
        assert sorted((one["name"], one["version"]) for one in bill["components"]) == sorted(locked)
    pages = json.loads((ROOT / "build" / "sbom" / "pages.cdx.json").read_text())
    wanted = json.loads((ROOT / "web" / "package.json").read_text())["dependencies"]
    assert wanted.keys() <= {f"{one.get('group', '')}/{one['name']}".lstrip("/") for one in pages["components"]}

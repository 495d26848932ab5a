"""Mapless in parts, each in a fresh environment made of its hash-pinned list: what works, and how to get the rest."""

import json
import os
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import httpx
import pytest

from sim import parts
from tests.services.stack import TOKEN, WORKER_TOKEN, free_port, until

ROOT = Path(__file__).parents[2]
UV = Path(sys.executable).parent / "uv"
# Of this checkout, as an editable installation has them.
SOURCES = os.pathsep.join((str(ROOT), str(ROOT / "server" / "client")))
Make = Callable[[str], "Environment"]


class Environment:
    """A virtual environment with one part."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.variables = {
            **os.environ,
            "PYTHONPATH": SOURCES,
            "MAPLESS_DATA_DIR": str(folder / "data"),
            "MAPLESS_TOKEN": TOKEN,
            "MAPLESS_WORKER_TOKEN": WORKER_TOKEN,
        }
        self.python = folder / "venv" / "bin" / "python"

    def run(self, *arguments: str) -> "subprocess.CompletedProcess[str]":
        return subprocess.run(
            [self.python, *arguments], cwd=self.folder, env=self.variables, capture_output=True, text=True, timeout=100
        )

    def has(self, *modules: str) -> dict[str, bool]:
        code = "import sys, json, importlib.util as u; print(json.dumps({m: bool(u.find_spec(m)) for m in sys.argv[1:]}))"
        found: dict[str, bool] = json.loads(self.run("-c", code, *modules).stdout)
        return found


@pytest.fixture(scope="module")
def make(tmp_path_factory: pytest.TempPathFactory) -> Make:
    """Installs a part from its list; from what was downloaded before, where that is enough."""

    def made(part: str) -> Environment:
        environment = Environment(tmp_path_factory.mktemp(part))
        venv = environment.folder / "venv"
        subprocess.run([UV, "venv", "--quiet", "--python", sys.executable, venv], check=True)
        install: list[str | Path] = [UV, "pip", "install", "--quiet", "--python", environment.python, "--require-hashes"]
        for offline in (["--offline"], []):
            done = subprocess.run(
                [*install, *offline, "-r", ROOT / f"requirements-{part}.txt"], capture_output=True, text=True
            )
            if done.returncode == 0:
                return environment
        if os.environ.get("REQUIRE_SERVICES") != "1":
            pytest.skip(f"packages can't be installed here: {done.stderr[-300:]}")
        raise AssertionError(done.stderr)

    return made


def test_the_simulator_alone(make: Make) -> None:
    base = make("base")
    drive = """
import gymnasium, sim
env = gymnasium.make("Mapless/Navigation-v0")
env.reset(seed=1)
for _ in range(100):
    _, _, terminated, truncated, _ = env.step(env.action_space.sample())
    if terminated or truncated:
        env.reset()
print("100 steps")
"""
    done = base.run("-c", drive)
    assert done.stdout == "100 steps\n", done.stderr
    assert not any(base.has("torch", "onnxruntime", "fastapi", "sqlalchemy", "celery").values())
    assert base.run("-m", "server", "--help").returncode == 0
    for command, part in (("serve", "server"), ("up", "server"), ("train", "worker")):
        refused = base.run("-m", "server", command)
        assert refused.returncode == 1, refused.stdout
        (line,) = refused.stderr.splitlines()
        assert f"pip install 'mapless[{part}]'" in line
    # The client speaks to a server that is elsewhere.
    asked = base.run("-m", "mapless_client", "--help")
    assert asked.returncode == 0
    assert "launch" in asked.stdout


def test_the_service_alone(make: Make) -> None:
    server = make("server")
    assert not any(server.has("torch", "onnx", "onnxruntime", "threadpoolctl", "triton").values())
    for command in ("train", "worker", "up"):
        refused = server.run("-m", "server", command)
        assert (refused.returncode, "pip install 'mapless[worker]'" in refused.stderr) == (1, True), refused.stderr
    port = free_port()
    pages = server.folder / "pages"
    pages.mkdir()
    (pages / "index.html").write_text("<title>Mapless</title>")
    server.variables |= {"MAPLESS_PORT": str(port), "MAPLESS_WEB_DIST": str(pages)}
    with (server.folder / "log").open("w") as log:
        process = subprocess.Popen(
            [server.python, "-m", "server", "serve"], cwd=server.folder, env=server.variables, stdout=log, stderr=log
        )
    try:
        with httpx.Client(base_url=f"http://127.0.0.1:{port}", headers={"Authorization": f"Bearer {TOKEN}"}) as api:

            def answers() -> bool:
                assert process.poll() is None, (server.folder / "log").read_text()
                return api.get("/healthz").status_code == 200

            until(answers)
            assert "<title>Mapless</title>" in api.get("/").text
            assert api.get("/api/policies").status_code == 200
            launched = api.post("/api/experiments", json={"name": "waits"})
            assert launched.status_code == 201, launched.text
            assert [one["state"] for one in api.get("/api/experiments").json()["items"]] == ["queued"]
            assert api.get("/api/status").json()["workers"] == []
    finally:
        process.terminate()
        process.wait(30)


def test_the_workers_part_is_complete_and_the_lists_are_parts_of_the_whole() -> None:
    """Read, not installed: torch has gigabytes."""

    def pins(name: str) -> set[str]:
        text = (ROOT / name).read_text(encoding="utf-8")
        return {line.partition(" \\")[0] for line in text.splitlines() if "==" in line and line[0].isalpha()}

    whole = pins("requirements.txt")
    base, server, worker, build = (pins(f"requirements-{part}.txt") for part in ("base", "server", "worker", "build"))
    assert base <= server & worker
    assert server | worker | build | pins("requirements-parquet.txt") == whole
    assert server < pins("requirements-parquet.txt")
    assert server < pins("requirements-s3.txt")
    torch = next(pin for pin in whole if pin.startswith("torch=="))
    assert torch in worker
    assert torch not in server


def test_what_tells_that_a_part_is_missing_is_what_that_part_brings() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"]

    def modules(part: str) -> set[str]:
        names = (requirement.split("[")[0].split(">")[0].split("=")[0] for requirement in extras[part])
        imported = {"argon2-cffi": "argon2", "mcap-ros2-support": "mcap_ros2"}
        return {imported.get(name, name).replace("-", "_") for name in names}

    server, worker = modules("server"), modules("worker")
    assert dict.fromkeys(server, "server") | dict.fromkeys(worker - server, "worker") == parts._MODULES

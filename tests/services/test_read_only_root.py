"""A worker on a root that can't be written to, as in its container: it trains, exports, drives again, and is watched."""

import json
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.conftest import require_mounts
from tests.services.stack import ROLLOUT, ROOT, Service, until

COMPOSE: dict[str, Any] = yaml.safe_load((ROOT / "docker-compose.yml").read_text())["services"]
DOCKERFILE = (ROOT / "Dockerfile").read_text()
# Nothing but Docker's own: a file system in memory from which no program runs, and one volume.
_MOUNTS = """set -e
mount --make-rprivate /
mount --bind "$VOLUME" "$VOLUME"
mount -o remount,ro,bind /
mount -t tmpfs -o noexec,nosuid,nodev tmpfs "$TMPDIR"
if touch "$HOME/written" 2>/dev/null; then exit 9; fi
exec "$@"
"""


def written_in_image(name: str) -> str:
    """A variable of the workers' image."""
    worker = DOCKERFILE.partition("FROM run AS worker")[2].partition("\nFROM")[0]
    found = re.search(rf"\b{name}=(\S+)", worker.partition("\nENV")[2])
    assert found is not None
    return found[1]


def copied_kernels(into: Path) -> set[str]:
    """What is compiled here, as the image has it; the names of the files."""
    for folder in ("sim", "workers"):
        shutil.copytree(ROOT / folder / "kernels" / "__pycache__", into, dirs_exist_ok=True)
    return {path.name for path in into.rglob("*.nbi")}


@pytest.fixture
def service(tmp_path: Path, redis_url: str) -> Iterator[Service]:
    require_mounts()
    service = Service(tmp_path, MAPLESS_BROKER_URL=redis_url)
    service.start_server()
    yield service
    service.close()


@pytest.mark.services
def test_a_worker_needs_no_root_that_can_be_written_to(service: Service, tmp_path: Path) -> None:
    for name in ("worker", "jobs"):
        compose = COMPOSE[name]
        assert (compose["read_only"], compose["tmpfs"], compose["volumes"]) == (True, ["/tmp"], ["/work"])
        assert compose["environment"]["MAPLESS_WORK_DIR"] == written_in_image("MAPLESS_WORK_DIR") == "/work"
    assert written_in_image("NUMBA_CACHE_DIR").startswith("/tmp/")

    work, home, kernels = tmp_path / "volume", tmp_path / "home", tmp_path / "kernels"
    for directory in (work, home, kernels):
        directory.mkdir()
    compiled = copied_kernels(kernels)
    (entrypoint,) = re.findall(r"^ENTRYPOINT (.*sh.*)$", DOCKERFILE, re.MULTILINE)
    begin, *given = json.loads(entrypoint.replace("/app/kernels", str(kernels)))
    program = Path(sys.executable).parent / "mapless"
    environment = {
        **{name: value for name, value in service.environment.items() if not name.startswith(("XDG_", "NUMBA_"))},
        "HOME": str(home),
        "VOLUME": str(work),
        # In the container it is /tmp, which here holds what the test itself needs.
        "TMPDIR": "/media",
        "MAPLESS_WORK_DIR": str(work),
        "NUMBA_CACHE_DIR": written_in_image("NUMBA_CACHE_DIR").replace("/tmp", "/media"),
        "CUDA_CACHE_PATH": written_in_image("CUDA_CACHE_PATH").replace("/tmp", "/media"),
        "PYTHONDONTWRITEBYTECODE": "1",
        "PATH": f"{program.parent}{os.pathsep}{os.environ['PATH']}",
    }
    command = [begin, *given, "worker", "--concurrency=1", "--jobs=2", "--name=w"]
    with (tmp_path / "w.log").open("wb") as log:
        worker = subprocess.Popen(
            ["unshare", "-m", "sh", "-c", _MOUNTS, "sh", *command],
            cwd=ROOT,
            env=environment,
            stdout=log,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )
    service.processes.append(worker)

    def there() -> bool:
        assert worker.poll() is None, (tmp_path / "w.log").read_text()
        return bool(service.api.get("/api/status").json()["workers"])

    until(there)
    (run_id,) = service.launch(4 * ROLLOUT)
    assert service.until_state(run_id, "completed")["step"] == 4 * ROLLOUT

    newest = service.api.get(f"/api/runs/{run_id}/checkpoints").json()["items"][0]["id"]
    bundle = service.api.get(f"/api/checkpoints/{newest}/bundle", timeout=150)
    assert bundle.status_code == 200, bundle.text
    replay = service.api.get(f"/api/checkpoints/{newest}/replays/0", timeout=150)
    assert replay.status_code == 200, replay.text
    asked = service.api.post("/api/evaluations", json={"policies": [{"source": "checkpoint", "id": newest}]})
    assert asked.status_code == 202, asked.text
    (evaluation,) = asked.json()
    until(lambda: service.api.get(f"/api/evaluations/{evaluation['id']}").json()["state"] == "done")

    # Nothing was compiled that came compiled, and nobody was refused anything.
    inside = Path(f"/proc/{worker.pid}/root{environment['NUMBA_CACHE_DIR']}")
    assert {path.name for path in inside.rglob("*.nbi")} == compiled
    assert "Read-only file system" not in (tmp_path / "w.log").read_text()
    assert (work / "heartbeat").is_file()
    assert list(home.iterdir()) == []

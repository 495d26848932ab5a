"""The units of docs/systemd under a real systemd, installed by the commands of docs/many-machines.md as they stand."""

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.conftest import require_mounts, require_program
from tests.services.stack import ROLLOUT, ROOT, TOKEN, WORKER_TOKEN, Service, assert_one_unbroken_curve, until
from tests.services.systemd import PYTHON, Machine, machine

PAGE = (ROOT / "docs" / "many-machines.md").read_text()
SECTION = PAGE.partition("## As a service of the system")[2].partition("\n## ")[0]
SERVER, WORKER = re.findall(r"^```sh\n(.*?)^```", SECTION, re.MULTILINE | re.DOTALL)
(BACKUP,) = re.findall(r"`(set -a;[^`]+)`", SECTION)


@pytest.fixture
def there(tmp_path: Path) -> Iterator[Machine]:
    for program in ("systemctl", "nsenter"):
        require_program(program)
    require_mounts()
    (tmp_path / "machine").mkdir()
    with machine(tmp_path / "machine") as there:
        yield there


def write(there: Machine, name: str, settings: dict[str, str]) -> None:
    (there.root / "root" / name).write_text("".join(f"{key}={value}\n" for key, value in settings.items()))


@pytest.mark.services
def test_what_the_page_says_makes_a_lab_that_outlives_kills_stops_and_drains(
    there: Machine, tmp_path: Path, redis_url: str
) -> None:
    service = Service(tmp_path)  # for its port and its client: nothing of it is started here
    library = {"LD_LIBRARY_PATH": f"{PYTHON}/lib"}
    broker = {"MAPLESS_BROKER_URL": redis_url, "MAPLESS_WORKER_TOKEN": WORKER_TOKEN}
    write(there, "server.env", {"MAPLESS_TOKEN": TOKEN, "MAPLESS_PORT": str(service.port), **broker, **library})
    write(there, "worker.env", {"MAPLESS_SERVER_URL": service.url, **broker, **library})
    there.bring_compiled("/var/cache/private/mapless-worker/numba")
    there.run(SERVER)
    there.run(WORKER)
    until(lambda: service.api.get("/readyz").status_code == 200)

    (long,) = service.launch(4_000 * ROLLOUT, save_every=4 * ROLLOUT)
    until(lambda: service.checkpoints(long))
    there.run("systemctl kill --signal=KILL --kill-whom=main mapless-server")
    until(lambda: there.is_active("mapless-server") == "active" and service.api.get("/readyz").status_code == 200)
    there.run("systemctl stop mapless-worker")
    service.until_state(long, "queued")
    there.run("systemctl start mapless-worker")
    service.until_state(long, "running")
    service.stop(long)
    assert service.run(long)["attempt"] == 2
    assert_one_unbroken_curve(service, long)

    # Who is asked to drain finishes what it has and stays down, and nobody calls that a failure.
    (short,) = service.launch(100 * ROLLOUT)
    service.until_state(short, "running", "completed")
    there.run("systemctl reload mapless-worker")
    service.until_state(short, "completed")
    until(lambda: there.is_active("mapless-worker") == "inactive")

    there.run(BACKUP)
    backup = there.root / "root" / "mapless.backup"
    assert backup.stat().st_size > 0
    assert backup.stat().st_mode & 0o077 == 0
    assert "Mapless is at http" in there.run("journalctl --no-pager -u mapless-server")

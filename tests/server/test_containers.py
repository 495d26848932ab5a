"""docker-compose.yml and the Dockerfile name only what exists, and hold no secret."""

import os
import re
import shutil
import subprocess
import sys
import time
from fnmatch import fnmatch
from pathlib import Path
from typing import Any

import httpx
import pytest
import yaml
from typer.main import get_command

from server.cli import app as server_commands
from server.settings import Settings
from tests.conftest import require_mounts
from workers.cli import app as worker_commands
from workers.runtime.settings import WorkerSettings

ROOT = Path(__file__).parents[2]
COMPOSE_TEXT = (ROOT / "docker-compose.yml").read_text()
COMPOSE: dict[str, Any] = yaml.safe_load(COMPOSE_TEXT)
DOCKERFILE = (ROOT / "Dockerfile").read_text()
OURS = ("server", "worker", "jobs")


def substituted(text: str | None) -> str:
    """With every variable set, or at its default; without a value it is what the variable of that name is: here, nothing."""
    if text is None:
        return ""
    return re.sub(r"\$\{(\w+)(?::([-?])([^}]*))?\}", lambda m: m[3] if m[2] == "-" else "x" * 24, text)


@pytest.mark.parametrize("service", OURS)
def test_every_setting_exists_and_accepts_its_value(service: str) -> None:
    environment = COMPOSE["services"][service]["environment"]
    fields = Settings.model_fields if service == "server" else WorkerSettings.model_fields
    # An object store's library reads its own.
    ours = {name for name in environment if not name.startswith("AWS_")}
    assert {name.removeprefix("MAPLESS_").lower() for name in ours} <= set(fields)


def test_the_server_starts_on_these_settings(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in COMPOSE["services"]["server"]["environment"].items():
        monkeypatch.setenv(name, substituted(value))
    settings = Settings()
    assert settings.resolved_broker_url.startswith("redis://")
    assert settings.resolved_database_url.startswith("postgresql+psycopg://")
    assert settings.resolved_server_url == "http://server:8400"


def test_no_default_is_empty() -> None:
    """Debian's podman-compose (1.0.3) hands `${NAME:-}` on as it is written; a name alone is passed on where it is set."""
    assert ":-}" not in COMPOSE_TEXT


def test_the_server_needs_no_root_that_can_be_written_to(tmp_path: Path) -> None:
    """As in its container: all but its volume and a place for temporary files is read-only, in a namespace of the test's."""
    server = COMPOSE["services"]["server"]
    assert (server["read_only"], server["tmpfs"], server["volumes"]) == (True, ["/tmp"], ["data:/data"])
    require_mounts()
    script = (
        f"mount --make-rprivate / && mount --bind {tmp_path} /mnt && mount -o remount,ro,bind / "
        "&& mount -t tmpfs tmpfs /media && ! touch /root/written 2>/dev/null && exec $0 -m server serve"
    )
    environment = {name: value for name, value in os.environ.items() if not name.startswith("MAPLESS_")}
    environment |= {"MAPLESS_DATA_DIR": "/mnt", "MAPLESS_PORT": "0", "TMPDIR": "/media", "PYTHONDONTWRITEBYTECODE": "1"}
    command = ["unshare", "-m", "sh", "-c", script, sys.executable]
    with subprocess.Popen(command, cwd=ROOT, env=environment, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout is not None
            found = re.search(r"http://[^/]+", process.stdout.readline())
            assert found is not None
            deadline = time.monotonic() + 30.0
            while httpx.get(f"{found[0]}/readyz").status_code != 200:
                assert time.monotonic() < deadline
                time.sleep(0.2)
        finally:
            process.terminate()
    assert (tmp_path / "mapless.db").is_file()


def test_workers_know_neither_the_database_nor_the_login() -> None:
    for service in ("worker", "jobs"):
        environment = COMPOSE["services"][service]["environment"]
        assert "MAPLESS_TOKEN" not in environment
        assert not any("POSTGRES" in str(value) for value in environment.values())
        # Each container's own, which nobody shares.
        assert COMPOSE["services"][service]["volumes"] == [environment["MAPLESS_WORK_DIR"]]


def test_every_command_exists_with_its_options() -> None:
    server, *_ = COMPOSE["services"]["server"]["command"]
    assert server in get_command(server_commands).commands  # type: ignore[attr-defined]
    for service in ("worker", "jobs"):
        worker, *options = COMPOSE["services"][service]["command"]
        command = get_command(worker_commands).commands[worker]  # type: ignore[attr-defined]
        known = {name for parameter in command.params for name in parameter.opts}
        assert {option.partition("=")[0] for option in options} <= known


def test_secrets_have_no_default_and_their_absence_is_explained() -> None:
    variables = re.findall(r"\$\{(\w+)(?::([-?])([^}]*))?\}", COMPOSE_TEXT)
    secret = [found for found in variables if re.search("TOKEN|PASSWORD", found[0])]
    assert {name for name, _, _ in secret} == {
        "MAPLESS_TOKEN",
        "MAPLESS_WORKER_TOKEN",
        "POSTGRES_PASSWORD",
        "REDIS_PASSWORD",
    }
    assert all(operator == "?" and "is not set" in message for _, operator, message in secret)


def test_everything_is_checked_for_health_and_only_the_server_is_reachable_from_this_machine_only() -> None:
    services = COMPOSE["services"]
    assert all("healthcheck" in service for service in services.values())
    assert [name for name, service in services.items() if "ports" in service] == ["server"]
    assert services["server"]["ports"] == ["${MAPLESS_PUBLISH:-127.0.0.1}:${MAPLESS_PORT:-8400}:8400"]
    assert all(
        volume.partition(":")[0] in COMPOSE["volumes"]
        for service in services.values()
        for volume in service.get("volumes", [])
        if ":" in volume
    )


def test_the_image_is_built_with_the_arguments_that_it_takes() -> None:
    for service in OURS:
        build = COMPOSE["services"][service]["build"]
        assert build["context"] == "."
        assert set(build["args"]) <= set(re.findall(r"^ARG (\w+)", DOCKERFILE, re.MULTILINE))
    # What compose hands over where nobody says otherwise is what the Dockerfile takes by itself.
    usual = dict(re.findall(r'^ARG (\w+)="?([^"\n]*)"?$', DOCKERFILE, re.MULTILINE))
    handed = {name: value for service in OURS for name, value in COMPOSE["services"][service]["build"]["args"].items()}
    assert {name: substituted(value) for name, value in handed.items()} == usual


def test_each_service_has_the_part_that_it_runs() -> None:
    built = {service: COMPOSE["services"][service]["build"]["target"] for service in OURS}
    assert built == {"server": "server", "worker": "worker", "jobs": "worker"}
    assert set(built.values()) <= set(re.findall(r"^FROM \S+ AS (\w+)$", DOCKERFILE, re.MULTILINE))
    packages = {part: (ROOT / f"requirements-{part}.txt").read_text() for part in ("server", "worker")}
    assert re.search(r"^torch==", packages["worker"], re.MULTILINE)
    assert not re.search(r"^(torch|onnx|onnxruntime|triton|nvidia-\S+)==", packages["server"], re.MULTILINE)


def test_the_image_runs_without_rights_on_files_that_exist() -> None:
    for stage in DOCKERFILE.split("\nFROM ")[-2:]:
        assert re.findall(r"^USER (\w+)$", stage, re.MULTILINE) == ["mapless"]
    let_in = [line[1:] for line in (ROOT / ".dockerignore").read_text().splitlines() if line.startswith("!")]
    for copied in re.findall(r"^COPY (?!--from)(.+) \S+$", DOCKERFILE, re.MULTILINE):
        for source in re.sub(r"\$\{(\w+)_LOCK\}", lambda m: f"requirements-{m[1].lower()}.txt", copied).split():
            assert (ROOT / source).exists()
            assert any(fnmatch(source, pattern) for pattern in let_in)


@pytest.mark.parametrize("unit", ["server", "worker"])
def test_the_units_for_systemd_name_only_what_exists(unit: str, tmp_path: Path) -> None:
    text = (ROOT / "docs" / "systemd" / f"mapless-{unit}.service").read_text()
    settings = Settings.model_fields if unit == "server" else WorkerSettings.model_fields
    names = {name.lower() for name in re.findall(r"MAPLESS_([A-Z_]+)", text)}
    assert names <= set(settings)
    if (analyze := shutil.which("systemd-analyze")) is None:
        return
    # Where the project is in this checkout, and no file of secrets.
    here = text.replace("/opt/mapless/.venv/bin/", f"{Path(sys.executable).parent}/").replace(
        "EnvironmentFile=", "EnvironmentFile=-"
    )
    (tmp_path / f"mapless-{unit}.service").write_text(here)
    verified = subprocess.run(
        [analyze, "verify", tmp_path / f"mapless-{unit}.service"], capture_output=True, text=True, check=False
    )
    assert (verified.returncode, verified.stderr) == (0, "")

"""`mapless up` says in one line what stands in its way, and leaves nothing behind, however it ends."""

import os
import re
import signal
import socket
import stat
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest
from typer.testing import CliRunner

from server.cli import app
from tests.services.stack import ROOT, until


class Up:
    """`mapless up --workers 0` on a directory of its own."""

    def __init__(self, directory: Path, port: int = 0) -> None:
        self.data = directory / "data"
        self.output = directory / "output"
        command = [sys.executable, "-m", "server", "up", "--workers", "0", "--port", str(port), "--data-dir", str(self.data)]
        with self.output.open("wb") as output:
            self.process = subprocess.Popen(
                command, cwd=ROOT, env=environment(), stdout=output, stderr=subprocess.STDOUT, start_new_session=True
            )

    def url(self) -> str:
        found = until(lambda: re.search(r"http://\S+token=\S+", self.output.read_text()), seconds=60)
        assert found is not None
        return found.group()

    def server(self) -> psutil.Process:
        (server,) = psutil.Process(self.process.pid).children()
        return server

    def answers(self) -> bool:
        address = re.search(r"//([\d.]+):(\d+)", self.output.read_text())
        assert address is not None
        with socket.socket() as client:
            return client.connect_ex((address[1], int(address[2]))) == 0


def environment() -> dict[str, str]:
    return {name: value for name, value in os.environ.items() if not name.startswith("MAPLESS_")}


def refusal(directory: Path, *options: str) -> str:
    """What `mapless up` says as it refuses to start: one line."""
    command = ["up", "--workers", "0", "--port", "0", "--data-dir", str(directory), *options]
    others = {name: None for name in os.environ if name.startswith("MAPLESS_")}
    result = CliRunner().invoke(app, command, env=others)
    assert result.exit_code == 1
    assert result.stdout == ""
    (line,) = result.stderr.splitlines()
    return line


@pytest.fixture
def up(tmp_path: Path) -> Iterator[Up]:
    up = Up(tmp_path)
    yield up
    if up.process.poll() is None:
        for process in (psutil.Process(up.process.pid), *psutil.Process(up.process.pid).children()):
            process.kill()
        up.process.wait()


def test_it_prints_one_address_restarts_what_dies_and_stops_cleanly(up: Up) -> None:
    url = up.url()
    for name in ("token", "worker-token"):
        assert stat.S_IMODE((up.data / name).stat().st_mode) == 0o600
    assert url.endswith((up.data / "token").read_text())
    assert up.output.read_text().count("http://") == 1

    assert "Another Mapless runs on" in refusal(up.data)

    first = up.server()
    first.kill()
    until(lambda: psutil.Process(up.process.pid).children() not in ([], [first]) and up.answers(), seconds=60)
    assert (
        "The server was killed by signal 9 (SIGKILL): out of memory, perhaps. It is started again" in up.output.read_text()
    )

    server = up.server()
    up.process.send_signal(signal.SIGINT)
    assert up.process.wait(10) == 0
    assert not server.is_running()


def test_a_second_interrupt_ends_everything_at_once(up: Up) -> None:
    up.url()
    server = up.server()
    server.suspend()
    up.process.send_signal(signal.SIGINT)
    until(lambda: "Stopping" in up.output.read_text())
    up.process.send_signal(signal.SIGINT)
    up.process.wait(5)
    assert not server.is_running()


def test_closing_the_terminal_stops_everything_in_order(tmp_path: Path) -> None:
    terminal, inside = os.openpty()
    shell = f"exec {sys.executable} -m server up --workers 0 --port 0 --data-dir {tmp_path} <>{os.ttyname(inside)} >&0 2>&0"
    # A session without a terminal takes the first one that it opens for its own, and is hung up on when that is closed.
    before = signal.signal(signal.SIGHUP, signal.SIG_DFL)  # under `nohup` it would be ignored, and rightly so
    up = subprocess.Popen(["sh", "-c", shell], cwd=ROOT, env=environment(), start_new_session=True)
    signal.signal(signal.SIGHUP, before)
    try:
        with os.fdopen(terminal, "rb", buffering=0) as screen:
            while b"Ctrl-C" not in screen.readline():  # the last that it says
                assert up.poll() is None
            (server,) = psutil.Process(up.pid).children()
            os.close(inside)
        assert up.wait(30) == 0
        assert not server.is_running()
    finally:
        up.kill()
        up.wait()


def test_a_server_does_not_outlive_its_supervisor(up: Up) -> None:
    up.url()
    server = up.server()
    up.process.kill()
    up.process.wait()
    until(lambda: not server.is_running() or server.status() == psutil.STATUS_ZOMBIE, seconds=20)


def test_a_taken_port_is_said_in_one_line(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        assert f"Port {port} on 127.0.0.1 is taken" in refusal(tmp_path, "--port", str(port))


def test_a_directory_without_write_access_is_said_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    assert "No write access to" in refusal(tmp_path / "file" / "data")


def test_a_network_without_a_token_is_refused(tmp_path: Path) -> None:
    assert "MAPLESS_TOKEN" in refusal(tmp_path, "--host", "0.0.0.0")

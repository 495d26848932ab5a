"""The service as a process: how it starts, what it imports, how it ends, and how it says that it can't start."""

import json
import os
import platform
import re
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import IO

import httpx
import pytest
from typer.testing import CliRunner

from server.cli import app

ROOT = Path(__file__).parents[2]


def environment(data: Path) -> dict[str, str]:
    """A clean environment: no settings but this."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith("MAPLESS_")}
    return kept | {"MAPLESS_DATA_DIR": str(data)}


@contextmanager
def serving(
    data: Path, port: str = "0", stderr: IO[bytes] | None = None, **settings: str
) -> Iterator[tuple["subprocess.Popen[str]", str]]:
    """`mapless serve` while the block lasts, and its login URL."""
    with subprocess.Popen(
        [sys.executable, "-m", "server", "serve", "--port", port],
        cwd=ROOT,
        env=environment(data) | settings,
        stdout=subprocess.PIPE,
        stderr=stderr,
        text=True,
    ) as process:
        try:
            assert process.stdout is not None
            match = re.search(r"http://\S+", process.stdout.readline())
            assert match is not None
            yield process, match.group()
        finally:
            process.kill()


def test_a_page_hears_of_changes_until_the_server_ends(tmp_path: Path) -> None:
    with serving(tmp_path) as (process, url), httpx.Client(base_url=url.partition("/?")[0], timeout=10) as browser:
        assert browser.get(url).status_code == 303
        with browser.stream("GET", "/api/events") as events:
            lines = events.iter_lines()
            assert events.headers["content-type"].startswith("text/event-stream")
            position, event, *_ = islice(lines, 4)
            assert event == "event: opened"
            experiment = browser.post("/api/experiments", json={}).json()
            _, event, data, end = islice(lines, 4)
            assert (event, end) == ("event: changes", "")
            changes = [{"experiment_id": experiment["id"], "run_id": None, "kind": "experiment"}]
            assert json.loads(data.removeprefix("data: ")) == changes
            # Who comes back with the last event that was read hears what came after it.
            since = {"Last-Event-ID": position.removeprefix("id: ")}
            with browser.stream("GET", "/api/events?follow=shown", headers=since) as again:
                told = [line for line in islice(again.iter_lines(), 8) if line.startswith("data: [")]
                assert [json.loads(line.removeprefix("data: ")) for line in told] == [changes]
            process.send_signal(signal.SIGINT)
            # The stream ends by itself, else the server would wait for it.
            assert list(lines) == []
        assert process.wait(timeout=10) == 0
    # What it keeps, the login token above all, is its owner's alone.
    kept = [path for path in tmp_path.rglob("*") if path.is_file()]
    assert len(kept) >= 3
    assert [path for path in kept if path.stat().st_mode & 0o077] == []


def test_what_was_launched_is_there_after_a_restart(tmp_path: Path) -> None:
    with serving(tmp_path) as (process, url):
        base, _, token = url.partition("/?token=")
        headers = {"Authorization": f"Bearer {token}"}
        experiment = httpx.post(f"{base}/api/experiments", json={}, headers=headers).json()
        process.kill()

    # The same port and token: pages that are open go on.
    with serving(tmp_path, port=base.rpartition(":")[2]) as (process, same_url):
        assert same_url == url
        assert httpx.get(f"{base}/api/experiments/{experiment['id']}", headers=headers).json() == experiment
        process.terminate()
        assert process.wait(timeout=10) == 0


def start_and_fail(data: Path, *arguments: str, **more: str) -> str:
    """The one line with which a start is refused."""
    others = {name: None for name in os.environ if name.startswith("MAPLESS_")}
    result = CliRunner().invoke(app, ["serve", *arguments], env={**others, "MAPLESS_DATA_DIR": str(data), **more})
    assert result.exit_code == 1
    assert result.stdout == ""
    (line,) = result.stderr.splitlines()
    return line


def test_a_port_that_is_taken_is_one_clear_line(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        port = taken.getsockname()[1]
        line = start_and_fail(tmp_path, "--port", str(port))

    assert line == (
        f"mapless: Port {port} on 127.0.0.1 is taken: stop what runs there, or choose another with MAPLESS_PORT."
    )


def test_a_data_directory_that_cannot_be_written_is_one_clear_line(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    line = start_and_fail(tmp_path / "file" / "data", "--port", "0")

    assert line.startswith("mapless: ")
    assert str(tmp_path / "file" / "data") in line


def test_the_network_without_a_token_is_one_clear_line(tmp_path: Path) -> None:
    assert "without a login token: set MAPLESS_TOKEN" in start_and_fail(tmp_path, "--host", "0.0.0.0")


def test_a_wrong_setting_is_one_clear_line_with_its_name(tmp_path: Path) -> None:
    line = start_and_fail(tmp_path, MAPLESS_PORT="many")

    assert line.startswith("mapless: MAPLESS_PORT: Input should be a valid integer")


def test_a_database_that_does_not_answer_is_one_clear_line(tmp_path: Path) -> None:
    with socket.create_server(("127.0.0.1", 0)) as nobody:
        port = nobody.getsockname()[1]
    url = f"postgresql+psycopg://mapless:secret@127.0.0.1:{port}/mapless"
    line = start_and_fail(tmp_path, "--port", "0", MAPLESS_DATABASE_URL=url, MAPLESS_DATABASE_WAIT_SECONDS="0")

    assert line.startswith("mapless: The database postgresql+psycopg://mapless:***@127.0.0.1")


def imported_by(statement: str) -> set[str]:
    """The packages that are loaded after `statement`, in a fresh interpreter."""
    code = f"import sys; {statement}; print(*sys.modules)"
    result = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    return {name.partition(".")[0] for name in result.stdout.split()}


def test_the_server_starts_without_what_only_workers_need() -> None:
    loaded = imported_by("import server.app, server.processes.serve")

    assert "fastapi" in loaded
    assert loaded.isdisjoint({"torch", "pymunk", "numba", "scipy", "viser", "mcap", "mcap_ros2", "av"})


def test_help_does_not_wait_for_the_server_nor_for_the_workers() -> None:
    loaded = imported_by("import server.cli")

    assert loaded.isdisjoint({"torch", "pymunk", "numba", "numpy", "fastapi", "sqlalchemy", "celery"})


def test_a_server_that_answers_imports_what_intervals_take_and_hides_what_lasts_from_the_collector() -> None:
    look = "print('scipy.special' in sys.modules, gc.get_freeze_count() > 0)"
    code = f"import gc, sys; from server.processes.settling import settle; settle(); {look}"
    result = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert result.stdout.split() == ["True", "True"]


@pytest.mark.skipif(platform.libc_ver()[0] != "glibc", reason="only glibc has arenas")
def test_threads_of_a_server_share_two_arenas() -> None:
    code = """
import ctypes, threading
from server.processes.settling import share_memory
share_memory()
together = threading.Barrier(20)
def allocate():
    together.wait()
    kept = [bytes(2_000) for _ in range(1_000)]
    together.wait()
threads = [threading.Thread(target=allocate) for _ in range(20)]
for thread in threads: thread.start()
for thread in threads: thread.join()
libc = ctypes.CDLL(None)
libc.malloc_info(0, ctypes.c_void_p.in_dll(libc, "stdout"))
libc.fflush(None)
"""
    told = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True).stdout
    assert 1 <= told.count("<heap nr=") <= 2

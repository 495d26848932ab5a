"""The chaos benchmark's tools do as they say: the proxy cuts, refuses, silences and loses; disks fill; clocks shift."""

import socket
import subprocess
import sys
import threading
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from benchmarks.chaos.clock import Clock
from benchmarks.chaos.disk import Disk
from benchmarks.chaos.proxy import Proxy, Trap
from benchmarks.service import wait_for


@pytest.fixture
def heard() -> list[bytes]:
    """What the server behind the proxy has been sent."""
    return []


@pytest.fixture
def proxy(heard: list[bytes]) -> Iterator[Proxy]:
    """Before a server that answers whatever it hears in capitals."""
    listener = socket.create_server(("127.0.0.1", 0))

    def serve(connection: socket.socket) -> None:
        with connection:
            try:
                while data := connection.recv(1024):
                    heard.append(data)
                    connection.sendall(data.upper())
            except OSError:
                return

    def accept() -> None:
        while True:
            try:
                connection, _ = listener.accept()
            except OSError:
                return
            threading.Thread(target=serve, args=(connection,), daemon=True).start()

    thread = threading.Thread(target=accept, daemon=True)
    thread.start()
    proxy = Proxy(listener.getsockname()[1])
    yield proxy
    proxy.close()
    listener.shutdown(socket.SHUT_RDWR)
    listener.close()
    thread.join()


def connect(proxy: Proxy) -> socket.socket:
    return socket.create_connection(("127.0.0.1", proxy.port), timeout=10)


def asked(connection: socket.socket, question: bytes) -> bytes:
    """The answer; nothing where the connection is closed instead."""
    try:
        connection.sendall(question)
        return connection.recv(1024)
    except ConnectionError:
        return b""


def test_it_carries_both_ways(proxy: Proxy) -> None:
    with connect(proxy) as one, connect(proxy) as other:
        assert asked(one, b"one") == b"ONE"
        assert asked(other, b"other") == b"OTHER"


def test_a_cut_closes_what_is_open_and_nothing_more(proxy: Proxy) -> None:
    with connect(proxy) as before:
        assert asked(before, b"x") == b"X"
        proxy.cut()
        assert asked(before, b"y") == b""
    with connect(proxy) as after:
        assert asked(after, b"z") == b"Z"


def test_refused_connections_close_until_it_is_opened(proxy: Proxy) -> None:
    proxy.refuse()
    with connect(proxy) as refused:
        assert asked(refused, b"x") == b""
    proxy.open()
    with connect(proxy) as carried:
        assert asked(carried, b"x") == b"X"


def test_silence_closes_nothing_and_delivers_late(proxy: Proxy, heard: list[bytes]) -> None:
    with connect(proxy) as connection:
        assert asked(connection, b"x") == b"X"
        proxy.silence()
        connection.settimeout(0.3)
        with pytest.raises(TimeoutError):
            asked(connection, b"y")
        assert heard == [b"x"]
        proxy.open()
        connection.settimeout(10)
        assert connection.recv(1024) == b"Y"


def test_a_lost_answer_is_to_a_request_that_was_carried_out(proxy: Proxy, heard: list[bytes]) -> None:
    trap = Trap(b"claim", lose="answer")
    proxy.set_trap(trap)
    with connect(proxy) as connection:
        assert asked(connection, b"hello") == b"HELLO"
        assert asked(connection, b"claim 1") == b""
    assert trap.sprung.is_set()
    with connect(proxy) as connection:  # once only
        assert asked(connection, b"claim 2") == b"CLAIM 2"
    assert heard == [b"hello", b"claim 1", b"claim 2"]


def test_a_lost_request_arrives_in_part(proxy: Proxy, heard: list[bytes]) -> None:
    proxy.set_trap(Trap(b"upload", lose="request"))
    with connect(proxy) as connection:
        assert asked(connection, b"upload 123456") == b""
    wait_for(lambda: heard == [b"upload"], seconds=10)


@pytest.mark.parametrize("mounting", [True, False])
def test_a_full_disk_takes_no_byte_until_it_is_freed(tmp_path: Path, mounting: bool) -> None:
    script = (
        "import sys\n"
        "with open(sys.argv[1], 'ab', buffering=0) as file:\n"
        "    for _ in sys.stdin:\n"
        "        try: print(file.write(b'x' * 8192), flush=True)\n"
        "        except OSError: print('full', flush=True)\n"
    )
    writers: list[psutil.Process] = []
    disk = Disk(tmp_path / "disk", 1, lambda: writers)
    if not mounting:  # as where only root may
        disk.close()
        disk.mounted = False
    writer = subprocess.Popen(
        [sys.executable, "-c", script, str(disk.path / "file")], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    )
    writers.append(psutil.Process(writer.pid))
    assert writer.stdin is not None
    assert writer.stdout is not None

    def written() -> str:
        assert writer.stdin is not None
        assert writer.stdout is not None
        writer.stdin.write("\n")
        writer.stdin.flush()
        return writer.stdout.readline().strip()

    try:
        assert written() == "8192"
        disk.fill()
        assert written() == "full"
        disk.free()
        assert written() == "8192"
    finally:
        writer.stdin.close()
        writer.wait()
        writer.stdout.close()
        disk.close()


def test_whoever_shares_a_clock_sees_it_shifted(tmp_path: Path) -> None:
    clock = Clock(tmp_path / "clock")
    shared = Clock(tmp_path / "clock")
    clock.shift(-3600.0)
    assert shared.offset == -3600.0
    clock.shift(60.0)
    assert shared.offset == -3540.0

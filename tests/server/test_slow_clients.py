"""Clients that take for ever, on real sockets: their connections end, everybody else's go on."""

import contextlib
import socket
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import httpx
import pytest

from benchmarks.service import wait_for
from tests.server.harness import WORKER_TOKEN
from tests.server.test_serving import serving

SECONDS = 1.0
# More than all buffers on the way hold.
LARGE = 64 * 2**20
# A machine that tests other things too.
PATIENCE = 20.0


@pytest.fixture(scope="module")
def url(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Of a server that gives its clients a second, with its token."""
    directory = tmp_path_factory.mktemp("slow")
    (directory / "dist" / "assets").mkdir(parents=True)
    (directory / "dist" / "index.html").touch()
    with (directory / "dist" / "assets" / "large").open("wb") as file:
        file.truncate(LARGE)
    dist = str(directory / "dist")
    with serving(directory / "data", MAPLESS_REQUEST_SECONDS=str(SECONDS), MAPLESS_WEB_DIST=dist) as (_, url):
        yield url


@contextmanager
def connected(url: str) -> Iterator[socket.socket]:
    parsed = httpx.URL(url)
    assert parsed.port is not None
    with socket.create_connection((parsed.host, parsed.port)) as connection:
        connection.settimeout(PATIENCE)
        yield connection


def trickle(connection: socket.socket, data: bytes) -> float:
    """Send a byte every fifth of the time until the other side hangs up; the seconds until then."""
    began = time.monotonic()
    for byte in data:
        try:
            connection.sendall(bytes([byte]))
        except OSError:
            break
        time.sleep(SECONDS / 5)
    return time.monotonic() - began


def answer(connection: socket.socket) -> bytes:
    """All that comes until the other side hangs up."""
    blocks = []
    with contextlib.suppress(ConnectionResetError):
        while block := connection.recv(2**20):
            blocks.append(block)
    return b"".join(blocks)


def test_a_connection_that_says_nothing_is_closed(url: str) -> None:
    with connected(url) as connection:
        assert answer(connection) == b""


@pytest.mark.parametrize("data", [b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nX-Slow: ", b"GET", b"\r\n"])
def test_headers_that_never_end_are_not_waited_for(url: str, data: bytes) -> None:
    with connected(url) as connection:
        connection.sendall(data)
        assert answer(connection).startswith(b"HTTP/1.1 408 ")


def test_headers_that_trickle_are_not_waited_for(url: str) -> None:
    with connected(url) as connection:
        assert trickle(connection, b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n" + b"X-Slow: 1\r\n" * 10) < 5 * SECONDS


@pytest.mark.parametrize("data", [b"GET /hea", b"\r\n"])
def test_nor_are_those_of_a_second_request(url: str, data: bytes) -> None:
    with connected(url) as connection:
        connection.sendall(b"GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        assert connection.recv(65_536).startswith(b"HTTP/1.1 200 ")
        connection.sendall(data)
        assert b"HTTP/1.1 408 " in answer(connection)


LOGIN = b"POST /api/login HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\nContent-Length: 200\r\n\r\n"


def test_a_body_that_stands_still_is_refused(url: str) -> None:
    with connected(url) as connection:
        connection.sendall(LOGIN + b'{"token":')
        said = answer(connection)
    assert said.startswith(b"HTTP/1.1 408 ")
    assert b"did not arrive within 1 s" in said


def test_a_body_that_trickles_is_refused(url: str) -> None:
    with connected(url) as connection:
        connection.sendall(LOGIN)
        assert trickle(connection, b'{"token": "' + b"x" * 100) < 5 * SECONDS


def test_a_body_that_comes_steadily_may_take_longer(url: str) -> None:
    def parts() -> Iterator[bytes]:
        yield b'{"token": "'
        for _ in range(10):
            time.sleep(SECONDS / 4)
            yield b"x" * 1_000
        yield b'"}'

    # Longer than a token may be: what matters is that all of it was read.
    response = httpx.post(
        f"{url.partition('/?')[0]}/api/login",
        content=parts(),
        headers={"Content-Type": "application/json"},
        timeout=PATIENCE,
    )
    assert response.status_code == 422


def test_an_answer_that_nobody_reads_is_not_kept(url: str) -> None:
    with connected(url) as connection:
        connection.sendall(b"GET /assets/large HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n")
        time.sleep(5 * SECONDS)
        assert httpx.get(f"{url.partition('/?')[0]}/healthz").status_code == 200
        received = len(answer(connection))
    assert 0 < received < LARGE


def test_a_stream_stays_open(url: str) -> None:
    base, _, token = url.partition("/?token=")
    with httpx.stream("GET", f"{base}/api/events", headers={"Authorization": f"Bearer {token}"}, timeout=PATIENCE) as events:
        lines = events.iter_lines()
        assert next(line for line in lines if line.startswith("event: ")) == "event: opened"
        time.sleep(4 * SECONDS)
        httpx.post(f"{base}/api/experiments", json={}, headers={"Authorization": f"Bearer {token}"}).raise_for_status()
        assert any(line == "event: changes" for line in lines)


def test_a_worker_that_goes_away_in_the_middle_of_an_upload_is_one_line_of_the_log(tmp_path: Path) -> None:
    log = tmp_path / "log"
    with log.open("wb") as stderr, serving(tmp_path / "data", stderr=stderr, MAPLESS_WORKER_TOKEN=WORKER_TOKEN) as (_, url):
        with connected(url) as connection:
            head = (
                "PUT /api/worker/runs/lost/checkpoints/1?attempt=1 HTTP/1.1\r\nHost: 127.0.0.1\r\n"
                f"Authorization: Bearer {WORKER_TOKEN}\r\nContent-Length: 1000000\r\n\r\n"
            )
            connection.sendall(head.encode() + b'{"after_seq":')
            time.sleep(0.2)
        wait_for(lambda: b"left before it was complete" in log.read_bytes(), seconds=PATIENCE)
        assert httpx.get(httpx.URL(url).copy_with(path="/healthz", query=None)).status_code == 200
    said = log.read_text()
    assert "Traceback" not in said
    assert len(said.splitlines()) == 1, said

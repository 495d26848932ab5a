"""A service of its own for a benchmark: `mapless up` in a temporary directory, and its API as a logged-in client."""

import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, TypeVar
from urllib.parse import parse_qs, urlsplit

import httpx

ROOT = Path(__file__).resolve().parent.parent
T = TypeVar("T")


@contextmanager
def running_service(*, workers: int) -> Iterator[httpx.Client]:
    """A service with that many workers, each of them ready; ended on leaving."""
    with TemporaryDirectory() as data:
        command = (sys.executable, "-m", "server", "up", "--port", "0", "--workers", str(workers), "--data-dir", data)
        process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True)
        try:
            address = urlsplit(_read_address(process))
            with httpx.Client(
                base_url=f"{address.scheme}://{address.netloc}",
                headers={"Authorization": f"Bearer {parse_qs(address.query)['token'][0]}"},
                timeout=30.0,
            ) as client:
                wait_for(lambda: get(client, "/api/status")["workers"], seconds=60.0)
                yield client
        finally:
            process.send_signal(signal.SIGINT)
            process.wait(30)


def get(client: httpx.Client, path: str) -> Any:
    """The JSON at a path of the API."""
    response = client.get(path)
    response.raise_for_status()
    return response.json()


def wait_for(condition: Callable[[], T], *, seconds: float, interval: float = 0.02) -> T:
    """What `condition` returns once that is true.

    Raises:
        TimeoutError: it was not within `seconds`.
    """
    deadline = time.monotonic() + seconds
    while time.monotonic() < deadline:
        if value := condition():
            return value
        time.sleep(interval)
    raise TimeoutError(f"not within {seconds} s")


def _read_address(process: "subprocess.Popen[str]") -> str:
    assert process.stdout is not None
    for line in process.stdout:
        if match := re.search(r"http://\S+token=\S+", line):
            return match.group()
    raise RuntimeError("mapless up printed no address; its own output says why")

"""The server that is measured, as a process of its own, and what it costs: processor time and memory."""

import os
import re
import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import parse_qs, urlsplit

import httpx
import psutil

ROOT = Path(__file__).resolve().parents[2]
WORKER_TOKEN = "benchmark-worker-token"


@dataclass(frozen=True)
class Server:
    """A running server.

    Attributes:
        origin: its address, "http://127.0.0.1:8400".
        token: that logs a person in.
        process: its process.
    """

    origin: str
    token: str
    process: psutil.Process

    def cpu_ms(self) -> float:
        """Processor time that it and what it has started have taken so far, milliseconds."""
        times = [process.cpu_times() for process in self._processes()]
        return 1000.0 * sum(float(each.user) + float(each.system) for each in times)

    def memory_mb(self) -> float:
        """Resident memory, MB."""
        return sum(float(process.memory_info().rss) for process in self._processes()) / 1e6

    def _processes(self) -> list[psutil.Process]:
        return [self.process, *self.process.children(recursive=True)]

    def client(self, token: str | None = None) -> httpx.Client:
        """A client of its API, a person's unless another token is given."""
        return httpx.Client(base_url=self.origin, headers={"Authorization": f"Bearer {token or self.token}"}, timeout=120.0)


@contextmanager
def serving(data_dir: Path, workers: int = 0) -> Iterator[Server]:
    """The server over a data directory, with so many workers; ended on leaving."""
    begin = ("up", "--workers", str(workers)) if workers else ("serve",)
    command = (sys.executable, "-m", "server", *begin, "--port", "0", "--data-dir", str(data_dir))
    environment = {**os.environ, "MAPLESS_WORKER_TOKEN": WORKER_TOKEN}
    process = subprocess.Popen(command, cwd=ROOT, stdout=subprocess.PIPE, text=True, env=environment)
    try:
        assert process.stdout is not None
        for line in process.stdout:
            if match := re.search(r"http://\S+token=\S+", line):
                url = urlsplit(match.group())
                break
        else:
            raise RuntimeError("the server printed no address; its own output says why")
        yield Server(f"{url.scheme}://{url.netloc}", parse_qs(url.query)["token"][0], psutil.Process(process.pid))
    finally:
        process.send_signal(signal.SIGINT)
        try:
            process.wait(60)
        except subprocess.TimeoutExpired:
            process.kill()
            process.wait()

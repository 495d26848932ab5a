"""The service as it runs in earnest, with a proxy at every connection and a disk of its own under every part."""

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal, TypeVar

import httpx
import psutil

from benchmarks.backing import Postgres, Redis
from benchmarks.chaos.clock import Clock
from benchmarks.chaos.disk import Disk
from benchmarks.chaos.proxy import Proxy
from benchmarks.chaos.recorder import Recorder
from benchmarks.processes import free_port, kill, nursery_of, trainer_of, tree

ROOT = Path(__file__).resolve().parents[2]
Mode = Literal["embedded", "production"]
# Kernels may have to be compiled first.
_PATIENCE_SECONDS = 180.0
_WORKER_DISK_MB = 64
_SERVER_DISK_MB = 1024
_TOKEN = "a-login-token-of-the-benchmark"
_WORKER_TOKEN = "a-worker-token-of-the-benchmark"

T = TypeVar("T")


class Node:
    """A worker with one slot, the way from it to the server, and the disk of its spools.

    Args:
        name: of the worker.
        directory: of its disk.
        environment: of the process.
        server_port: of the server.
    """

    def __init__(self, name: str, directory: Path, environment: dict[str, str], server_port: int) -> None:
        self.name = name
        self.proxy = Proxy(server_port)
        self._process: subprocess.Popen[bytes] | None = None
        self._log = directory.with_suffix(".log")
        self.disk = Disk(directory, _WORKER_DISK_MB, self.members)
        self._environment = {
            **environment,
            "MAPLESS_SERVER_URL": f"http://127.0.0.1:{self.proxy.port}",
            "MAPLESS_WORK_DIR": str(directory / "work"),
            # Of a disk that small.
            "MAPLESS_MIN_FREE_BYTES": str(2**20),
        }

    def start(self) -> None:
        """Start the worker; it may take seconds to be ready."""
        command = ("-m", "workers", "worker", "--concurrency=1", "--jobs=0", f"--name={self.name}")
        self._process = _start(command, self._log, self._environment)

    def members(self) -> list[psutil.Process]:
        """The worker's processes, trainers included."""
        return tree(self._process.pid) if self._process is not None else []

    @property
    def ended(self) -> bool:
        """Whether the worker is not there although it was started."""
        return self._process is not None and self._process.poll() is not None

    def trainer(self) -> psutil.Process | None:
        """The process that trains, or waits to."""
        return trainer_of(self._process.pid) if self._process is not None else None

    def nursery(self) -> psutil.Process | None:
        """The process that trainers are forked from."""
        return nursery_of(self._process.pid) if self._process is not None else None

    def child(self) -> psutil.Process | None:
        """The process of Celery's pool in which the attempt is looked after."""
        if self._process is None or not psutil.pid_exists(self._process.pid):
            return None
        children = psutil.Process(self._process.pid).children()
        return next((child for child in children if child.name() != "mapless-nursery"), None)

    def spool(self, run_id: str) -> Path | None:
        """The file of the attempt that is under way."""
        return next(iter(self.disk.path.glob(f"work/*-{run_id}-*/spool.jsonl")), None)

    def kill(self) -> None:
        """End everything without a word."""
        kill(self.members())
        if self._process is not None:
            self._process.wait()

    def stop(self) -> None:
        """Ask the worker to end, and wait for that."""
        assert self._process is not None
        self._process.send_signal(signal.SIGTERM)
        try:
            self._process.wait(30)
        except subprocess.TimeoutExpired:
            self.kill()


class Stack:
    """Server, workers and, in production mode, a database and a broker, each with a proxy before it.

    Args:
        directory: for everything.
        mode: 'embedded': SQLite and a broker in a file; 'production': PostgreSQL and Redis.
        workers: how many, with one slot each.
        lease_seconds: after which a silent worker loses its run.
    """

    def __init__(self, directory: Path, mode: Mode, workers: int, lease_seconds: float) -> None:
        self.postgres = Postgres(directory) if mode == "production" else None
        self.redis = Redis(directory) if mode == "production" else None
        self.mode = mode
        self.lease_seconds = lease_seconds
        self.port = free_port()
        self._log = directory / "server.log"
        self._process: subprocess.Popen[bytes] | None = None
        self.disk = Disk(directory / "server", _SERVER_DISK_MB, self.server_members)
        self.data = directory / "server" / "data"
        self.database_url = f"sqlite:///{self.data / 'mapless.db'}"
        self.broker_path = self.data / "broker.db"
        self.database_proxy: Proxy | None = None
        self.broker_proxy: Proxy | None = None
        reached_database, broker_url = self.database_url, f"sqla+sqlite:///{self.broker_path}"
        if self.postgres is not None and self.redis is not None:
            self.database_url = self.postgres.url
            self.database_proxy, self.broker_proxy = Proxy(self.postgres.port), Proxy(self.redis.port)
            reached_database = self.database_url.replace(str(self.postgres.port), str(self.database_proxy.port))
            broker_url = f"redis://127.0.0.1:{self.broker_proxy.port}/0"
        self._environment = {
            **{name: value for name, value in os.environ.items() if not name.startswith("MAPLESS_")},
            "MAPLESS_DATA_DIR": str(self.data),
            "MAPLESS_DATABASE_URL": reached_database,
            "MAPLESS_BROKER_URL": broker_url,
            "MAPLESS_PORT": str(self.port),
            "MAPLESS_TOKEN": _TOKEN,
            "MAPLESS_WORKER_TOKEN": _WORKER_TOKEN,
            "MAPLESS_LEASE_SECONDS": str(lease_seconds),
        }
        self._clock_path = directory / "clock"
        self.clock = Clock(self._clock_path)
        self.nodes = [
            Node(f"worker{number}", directory / f"worker{number}", self._environment, self.port) for number in range(workers)
        ]
        self.recorder = Recorder(node.disk.path for node in self.nodes)
        self.api = httpx.Client(
            base_url=f"http://127.0.0.1:{self.port}", headers={"Authorization": f"Bearer {_TOKEN}"}, timeout=30.0
        )

    def start(self) -> None:
        """Start everything and wait until every worker is there.

        Raises:
            RuntimeError, TimeoutError: something does not start.
        """
        for backing in (self.postgres, self.redis):
            if backing is not None:
                backing.start()
        self.start_server()
        for node in self.nodes:
            node.start()
        self.until(lambda: len(self.api.get("/api/status").json()["workers"]) == len(self.nodes))

    def server_members(self) -> list[psutil.Process]:
        """The server's processes."""
        return tree(self._process.pid) if self._process is not None else []

    def start_server(self) -> None:
        """Start the server and wait until it answers.

        Raises:
            RuntimeError: it ended.
            TimeoutError: it does not answer.
        """
        command = ("-m", "benchmarks.chaos.clock", str(self._clock_path), "serve")
        self._process = process = _start(command, self._log, self._environment)

        def answers() -> bool:
            if process.poll() is not None:
                raise RuntimeError(f"the server ended: {self._log.read_text()[-4000:]}")
            return self.api.get("/healthz").status_code == 200

        self.until(answers)

    @property
    def server_ended(self) -> bool:
        """Whether the server is not there although it was started."""
        return self._process is not None and self._process.poll() is not None

    def kill_server(self) -> None:
        """End it without a word."""
        kill(self.server_members())
        assert self._process is not None
        self._process.wait()

    def stop_server(self) -> None:
        """Ask it to end, and wait for that."""
        assert self._process is not None
        self._process.send_signal(signal.SIGTERM)
        try:
            self._process.wait(30)
        except subprocess.TimeoutExpired:
            self.kill_server()

    def launch(self, training: dict[str, Any], seed: int) -> str:
        """A run of this training; returns its id."""

        def launched() -> str | None:
            response = self.api.post(
                "/api/experiments", json={"name": f"chaos {seed}", "seeds": [seed], "training": training}
            )
            if response.status_code >= 500:
                return None
            response.raise_for_status()
            return str(response.json()["runs"][0]["id"])

        run_id = self.until(launched)
        assert run_id is not None
        return run_id

    def until(self, value: Callable[[], T]) -> T:
        """The first truthy value; a server that is away counts as none.

        Raises:
            TimeoutError: it did not come.
        """
        deadline = time.monotonic() + _PATIENCE_SECONDS
        while time.monotonic() < deadline:
            try:
                if result := value():
                    return result
            except (httpx.TransportError, KeyError):
                pass
            time.sleep(0.1)
        raise TimeoutError(f"it did not happen within {_PATIENCE_SECONDS:.0f} s")

    def close(self) -> None:
        """End everything; what the disks hold is gone."""
        self.recorder.close()
        for node in self.nodes:
            node.kill()
            node.proxy.close()
        if self._process is not None:
            self.kill_server()
        for proxy in (self.database_proxy, self.broker_proxy):
            if proxy is not None:
                proxy.close()
        for backing in (self.postgres, self.redis):
            if backing is not None:
                backing.close()
        for disk in (self.disk, *(node.disk for node in self.nodes)):
            disk.close()
        self.api.close()


def _start(arguments: tuple[str, ...], log: Path, environment: dict[str, str]) -> "subprocess.Popen[bytes]":
    with log.open("ab") as output:
        return subprocess.Popen(
            [sys.executable, *arguments],
            cwd=ROOT,
            env=environment,
            stdout=output,
            stderr=subprocess.STDOUT,
            start_new_session=True,
        )

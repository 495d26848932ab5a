"""PostgreSQL and Redis of the benchmark's own, on ports of their own, to be killed, stopped and restarted at will."""

import os
import pwd
import shutil
import signal
import subprocess
import time
from abc import ABC, abstractmethod
from pathlib import Path
from tempfile import mkdtemp

import psutil

from benchmarks.processes import free_port, kill, tree

_PATIENCE_SECONDS = 60.0
_SYSTEM_USER = "postgres"


class Backing(ABC):
    """A process that others connect to. `start` returns once it answers; its data outlive `kill`."""

    # What ends it in order.
    stop_signal = signal.SIGTERM

    def __init__(self, name: str, directory: Path) -> None:
        self.name = name
        self.port = free_port()
        self._log = directory / f"{name}.log"
        self._process: subprocess.Popen[bytes] | None = None

    @abstractmethod
    def command(self) -> list[str]:
        """What starts it, in the foreground."""

    @abstractmethod
    def answers(self) -> bool:
        """Whether it can be used."""

    def start(self) -> None:
        """Start it.

        Raises:
            TimeoutError: it does not answer.
        """
        with self._log.open("ab") as log:
            self._process = subprocess.Popen(self.command(), stdout=log, stderr=log, start_new_session=True)
        deadline = time.monotonic() + _PATIENCE_SECONDS
        while not self.answers():
            if time.monotonic() > deadline:
                raise TimeoutError(f"{self.name} does not answer: {self._log.read_text()[-2000:]}")
            time.sleep(0.05)

    def members(self) -> list[psutil.Process]:
        """Its processes."""
        return tree(self._process.pid) if self._process is not None else []

    def kill(self) -> None:
        """End it without a word."""
        # Some may end by themselves once the first is gone.
        kill(self.members())
        if self._process is not None:
            self._process.wait()

    def stop(self) -> None:
        """End it in order, connections or not."""
        assert self._process is not None
        self._process.send_signal(self.stop_signal)
        self._process.wait(_PATIENCE_SECONDS)

    def close(self) -> None:
        """End it for good."""
        self.kill()


class Redis(Backing):
    """A broker that forgets its queues when it ends: the doorbells are rung again."""

    def __init__(self, directory: Path) -> None:
        super().__init__("redis", directory)
        self._directory = directory

    def command(self) -> list[str]:
        """Nothing is written to disk."""
        return ["redis-server", "--port", str(self.port), "--save", "", "--dir", str(self._directory), "--bind", "127.0.0.1"]

    def answers(self) -> bool:
        """Whether it is pinged back."""
        command = ("redis-cli", "-p", str(self.port), "ping")
        return subprocess.run(command, check=False, capture_output=True).stdout.strip() == b"PONG"


class Postgres(Backing):
    """A cluster of its own; it refuses to be root's, so it is the system user's where root asks."""

    stop_signal = signal.SIGINT  # "fast", which ends connections

    def __init__(self, directory: Path) -> None:
        super().__init__("postgres", directory)
        # Of its own: the system user may not look into root's directories.
        self._data = Path(mkdtemp(prefix="mapless-postgres-"))
        self._as_user: list[str] = []
        if os.getuid() == 0:
            user = pwd.getpwnam(_SYSTEM_USER)
            os.chown(self._data, user.pw_uid, user.pw_gid)
            self._as_user = ["setpriv", f"--reuid={user.pw_uid}", f"--regid={user.pw_gid}", "--clear-groups"]
        self._bin = _programs()
        options = ("--auth=trust", "--username=postgres", "--encoding=UTF8", "--no-locale", "--no-sync")
        subprocess.run(
            [*self._as_user, str(self._bin / "initdb"), *options, str(self._data)], check=True, capture_output=True
        )

    @property
    def url(self) -> str:
        """SQLAlchemy URL, past any proxy."""
        return f"postgresql+psycopg://postgres@127.0.0.1:{self.port}/postgres"

    def command(self) -> list[str]:
        """With one socket, on 127.0.0.1."""
        options = ("-k", "", "-h", "127.0.0.1", "-p", str(self.port), "-D", str(self._data))
        return [*self._as_user, str(self._bin / "postgres"), *options]

    def close(self) -> None:
        """End it and remove its data."""
        super().close()
        shutil.rmtree(self._data, ignore_errors=True)

    def answers(self) -> bool:
        """Whether connections are accepted."""
        command = (str(self._bin / "pg_isready"), "-q", "-h", "127.0.0.1", "-p", str(self.port))
        return subprocess.run(command, check=False).returncode == 0


def _programs() -> Path:
    """Where initdb and postgres are: Debian keeps them out of the path."""
    if found := shutil.which("initdb"):
        return Path(found).resolve().parent
    candidates = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))
    if not candidates:
        raise FileNotFoundError("initdb: install PostgreSQL's server (Debian: apt install postgresql)")
    return candidates[-1].parent

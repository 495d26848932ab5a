"""`mapless up`: the server and its workers under one roof, started, watched, restarted and stopped together.

It stays small: what it starts are processes of their own (`mapless serve`, `mapless worker`), which end in order when it
dies.
"""

import fcntl
import http.client
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from types import FrameType
from typing import IO
from urllib.parse import urlsplit

from server.errors import ServiceError
from server.processes.listening import listen, local_url, login_url
from server.security.secrets import load_secrets
from server.settings import PROJECT_ROOT, Settings
from workers.processes import how_it_ended, usable_cores
from workers.runtime.supervised import SUPERVISED

# The whole of a stop takes less than 10 s: the trainings' checkpoints first, then the server, which takes them in.
_WORKER_STOP_SECONDS = 7.5
_SERVER_STOP_SECONDS = 2.0
_START_SECONDS = 60.0
_ANSWER_SECONDS = 2.0
_POLL_SECONDS = 0.1
_FIRST_RESTART_SECONDS = 0.5
_LAST_RESTART_SECONDS = 30.0
# A process that ran for this long has not died of what it died of before.
_STABLE_SECONDS = 60.0
# One for what somebody waits for, one that takes evaluations too.
_USUAL_JOBS = 2
_LOG_BYTES = 10 * 2**20


class UnusableDataError(ServiceError):
    """The data directory can't be used."""


class StartError(ServiceError):
    """The server did not start."""


class Child:
    """A process that is meant to run for as long as the supervisor does; what it prints goes to a log file."""

    def __init__(self, name: str, command: Sequence[str], environment: Mapping[str, str], log: Path) -> None:
        self.name = name
        self.log = log
        self._command = command
        self._environment = environment
        self._process: subprocess.Popen[bytes] | None = None
        self._started_at = 0.0
        self._start_at = 0.0
        self._patience = _FIRST_RESTART_SECONDS

    def start(self) -> None:
        """Start it, in a session of its own: Ctrl-C in the terminal is for the supervisor."""
        if self.log.exists() and self.log.stat().st_size > _LOG_BYTES:
            self.log.replace(self.log.with_suffix(".log.1"))
        with self.log.open("ab") as output:
            self._process = subprocess.Popen(
                [sys.executable, *self._command],
                stdin=subprocess.PIPE,
                stdout=output,
                stderr=subprocess.STDOUT,
                start_new_session=True,
                env=dict(self._environment),
            )
        self._started_at = time.monotonic()

    @property
    def running(self) -> bool:
        """Whether it runs now."""
        return self._process is not None and self._process.poll() is None

    def restart_if_dead(self, say: Callable[[str], None]) -> None:
        """Start it again where it has died, after a while that doubles as long as it keeps dying."""
        if self.running:
            return
        now = time.monotonic()
        if self._process is not None:
            code = self._process.returncode
            self._close()
            if now - self._started_at > _STABLE_SECONDS:
                self._patience = _FIRST_RESTART_SECONDS
            self._start_at = now + self._patience
            self._patience = min(2 * self._patience, _LAST_RESTART_SECONDS)
            say(f"The {self.name} {how_it_ended(code)}. It is started again; {self.log} says more.")
        elif now >= self._start_at:
            self.start()

    def ask_to_stop(self) -> None:
        """Ask it to end in order."""
        self._signal(signal.SIGTERM)

    def wait(self, deadline: float) -> None:
        """Wait for its end, and bring it about at `deadline` (monotonic seconds)."""
        if self._process is None:
            return
        try:
            self._process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            self.kill()
        self._close()

    def kill(self) -> None:
        """End it and what it has started, at once."""
        if self._process is not None:
            try:
                os.killpg(self._process.pid, signal.SIGKILL)
            except ProcessLookupError:
                return

    def last_words(self) -> str:
        """The last line of its log."""
        lines = self.log.read_text(errors="replace").strip().splitlines()
        return lines[-1] if lines else "it said nothing"

    def _signal(self, number: signal.Signals) -> None:
        if self._process is not None and self._process.poll() is None:
            self._process.send_signal(number)

    def _close(self) -> None:
        if self._process is not None:
            self._process.wait()
            assert self._process.stdin is not None
            self._process.stdin.close()
            self._process = None


class Supervisor:
    """One server and, unless there are to be none, one Celery worker with several processes.

    Args:
        settings: of the service.
        say: tells the person at the terminal something.
    """

    def __init__(self, settings: Settings, say: Callable[[str], None]) -> None:
        # Children get it too, and may be given another working directory.
        self._settings = settings.model_copy(update={"data_dir": settings.data_dir.resolve()})
        self._say = say
        self._signals = 0

    def run(self) -> None:
        """Run until SIGINT or SIGTERM; a second one ends everything at once.

        Raises:
            UnusableDataError: the data directory can't be written, or another supervisor has it.
            PortTakenError, UnusableAddressError: see `server.processes.listening`.
            StartError: the server did not start.
        """
        with ExitStack() as stack:
            stack.enter_context(_locked(self._settings.data_dir))
            with listen(self._settings) as listener:
                # Bound for a moment, to know that it can be, and which port it is where the settings say 0.
                settings = self._settings.model_copy(update={"port": listener.getsockname()[1]})
            secrets = load_secrets(settings)
            for number in _stop_signals():
                stack.callback(signal.signal, number, signal.signal(number, self._on_signal))
            count = usable_cores() if settings.workers is None else settings.workers
            server = _server(settings)
            jobs = (_USUAL_JOBS if count else 0) if settings.jobs is None else settings.jobs
            worker = _worker(settings, secrets.worker_token, count, jobs) if count or jobs else None
            children = [server, *([worker] if worker else [])]
            stack.callback(self._stop, server, worker)
            server.start()
            self._until_answering(server, settings)
            if worker is not None:
                worker.start()
            if not self._signals:
                self._say(f"Mapless is at {login_url(settings, secrets.token)}")
                workers = "worker" if count == 1 else "workers"
                self._say(
                    f"{count} {workers}, data in {settings.data_dir}. Ctrl-C stops; trainings go on at the next start."
                )
            while not self._signals:
                for child in children:
                    child.restart_if_dead(self._say)
                time.sleep(_POLL_SECONDS)

    def _on_signal(self, _number: int, _frame: FrameType | None) -> None:
        self._signals += 1

    def _until_answering(self, server: Child, settings: Settings) -> None:
        deadline = time.monotonic() + _START_SECONDS
        while not self._signals:
            if not server.running:
                raise StartError(f"The server did not start: {server.last_words()} ({server.log} says more).")
            if time.monotonic() > deadline:
                raise StartError(f"The server does not answer at {local_url(settings)}; {server.log} may say why.")
            if _answers(local_url(settings)):
                return
            time.sleep(_POLL_SECONDS / 2)

    def _stop(self, server: Child, worker: Child | None) -> None:
        """Workers first: they hand their runs back to a server that still listens."""
        if self._signals:
            with suppress(OSError):  # the terminal may be gone
                self._say("Stopping; running trainings write a checkpoint ...")
        for child, seconds in ((worker, _WORKER_STOP_SECONDS), (server, _SERVER_STOP_SECONDS)):
            if child is None:
                continue
            child.ask_to_stop()
            deadline = time.monotonic() + seconds
            while child.running and time.monotonic() < deadline and self._signals < 2:
                time.sleep(_POLL_SECONDS / 2)
            child.wait(time.monotonic())


def _answers(url: str) -> bool:
    """Whether the server behind `url` is well."""
    address = urlsplit(url)
    connection = http.client.HTTPConnection(address.hostname or "", address.port, timeout=_ANSWER_SECONDS)
    try:
        connection.request("GET", "/healthz")
        return connection.getresponse().status == http.HTTPStatus.OK
    except (OSError, http.client.HTTPException):
        return False
    finally:
        connection.close()


def _stop_signals() -> tuple[signal.Signals, ...]:
    """Ctrl-C, a service manager's stop, and a terminal that is closed, unless `nohup` means it to go on."""
    if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:
        return signal.SIGINT, signal.SIGTERM
    return signal.SIGINT, signal.SIGTERM, signal.SIGHUP


def _locked(data_dir: Path) -> IO[bytes]:
    """The data directory's lock file, held for as long as it is open; the directory is made where there is none."""
    path = data_dir / "supervisor.lock"
    try:
        (data_dir / "logs").mkdir(parents=True, exist_ok=True)
        lock = path.open("a+b")
    except OSError as error:
        raise UnusableDataError(
            f"No write access to {data_dir} ({error.strerror}): choose another place with --data-dir or MAPLESS_DATA_DIR."
        ) from error
    try:
        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        lock.close()
        raise UnusableDataError(
            f"Another Mapless runs on {data_dir}: stop it first, or choose another place with --data-dir."
        ) from error
    return lock


def _environment(settings: Settings, **more: str) -> dict[str, str]:
    path = os.pathsep.join(filter(None, (str(PROJECT_ROOT), os.environ.get("PYTHONPATH"))))
    return {**os.environ, "PYTHONPATH": path, "PYTHONUNBUFFERED": "1", SUPERVISED: "1", **more}


def _server(settings: Settings) -> Child:
    environment = _environment(
        settings,
        MAPLESS_DATA_DIR=str(settings.data_dir),
        MAPLESS_HOST=settings.host,
        MAPLESS_PORT=str(settings.port),
    )
    return Child("server", ["-m", "server", "serve"], environment, settings.data_dir / "logs" / "server.log")


def _worker(settings: Settings, token: str, count: int, jobs: int) -> Child:
    environment = _environment(
        settings,
        MAPLESS_SERVER_URL=local_url(settings),
        MAPLESS_BROKER_URL=settings.resolved_broker_url,
        MAPLESS_WORKER_TOKEN=token,
        MAPLESS_WORKER_NAME="local",
        MAPLESS_WORK_DIR=str(settings.data_dir / "work"),
    )
    command = ["-m", "workers", "worker", f"--concurrency={count}", f"--jobs={jobs}"]
    return Child("worker", command, environment, settings.data_dir / "logs" / "worker.log")

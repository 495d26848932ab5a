"""What a load is made of: a server on a core of its own, runs to report, and processes that make parts of the load."""

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from typing import Any, Literal, TypeVar

import httpx
import psutil
from pydantic import BaseModel

from benchmarks.backing import Postgres
from benchmarks.load.plan import Plan
from benchmarks.processes import free_port, kill, tree
from benchmarks.service import wait_for

ROOT = Path(__file__).resolve().parents[2]
Database = Literal["sqlite", "postgresql"]
TOKEN = "a-login-token-of-the-benchmark"
WORKER_TOKEN = "a-worker-token-of-the-benchmark"
_SEEDS_PER_EXPERIMENT = 50

M = TypeVar("M", bound=BaseModel)


def cores() -> tuple[int, list[int]]:
    """The core that is the server's, and those of everybody else."""
    usable = sorted(os.sched_getaffinity(0))
    return usable[0], usable[1:] or usable[:1]


@contextmanager
def server_on_a_core(directory: Path, database: Database, cores: tuple[int, list[int]]) -> Iterator[tuple[str, int]]:
    """A server on a core of its own; its URL and process id."""
    port, (own, others) = free_port(), cores
    environment = {
        **{name: value for name, value in os.environ.items() if not name.startswith("MAPLESS_")},
        "MAPLESS_DATA_DIR": str(directory / "data"),
        "MAPLESS_PORT": str(port),
        "MAPLESS_TOKEN": TOKEN,
        "MAPLESS_WORKER_TOKEN": WORKER_TOKEN,
    }
    # What has been started is ended, however far the rest has come.
    with ExitStack() as started:
        if database == "postgresql":
            postgres = Postgres(directory)
            started.callback(postgres.close)
            postgres.start()
            for process in postgres.members():
                # Some end as soon as the database is up.
                with suppress(psutil.NoSuchProcess):
                    process.cpu_affinity(others)
            environment["MAPLESS_DATABASE_URL"] = postgres.url
        log = started.enter_context((directory / "server.log").open("ab"))
        server = subprocess.Popen(
            ["taskset", "-c", str(own), sys.executable, "-m", "server", "serve"],
            cwd=ROOT,
            env=environment,
            stdout=log,
            stderr=log,
            start_new_session=True,
        )
        started.callback(_end, server)
        url = f"http://127.0.0.1:{port}"
        wait_for(lambda: _answers(url), seconds=60.0)
        yield url, server.pid


def _end(process: "subprocess.Popen[Any]") -> None:
    """End it, if it has not ended, with all that it has started."""
    kill(tree(process.pid))
    process.wait()


def _answers(url: str) -> bool:
    try:
        return httpx.get(f"{url}/healthz").status_code == 200
    except httpx.TransportError:
        return False


def launch(url: str, runs: int) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """So many runs, and their experiments."""
    run_ids: list[str] = []
    experiment_ids: list[str] = []
    with httpx.Client(base_url=url, headers={"Authorization": f"Bearer {TOKEN}"}, timeout=60.0) as api:
        while len(run_ids) < runs:
            seeds = list(range(min(_SEEDS_PER_EXPERIMENT, runs - len(run_ids))))
            answer = api.post("/api/experiments", json={"name": "load", "seeds": seeds, "training": {}}).raise_for_status()
            experiment_ids.append(answer.json()["id"])
            run_ids.extend(run["id"] for run in answer.json()["runs"])
    return tuple(run_ids), tuple(experiment_ids)


class Part:
    """A process that makes a part of the load, on the cores that are not the server's."""

    def __init__(self, plan: Plan, cores: list[int], niceness: int, *command: str) -> None:
        where = ("taskset", "-c", ",".join(map(str, cores)), "nice", "-n", str(niceness))
        self._process = subprocess.Popen(
            [*where, sys.executable, "-m", *command], cwd=ROOT, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )
        self._say(plan.model_dump_json())

    def await_readiness(self) -> None:
        """Until it has imported what it needs.

        Raises:
            RuntimeError: it ended instead.
        """
        assert self._process.stdout is not None
        if not self._process.stdout.readline():
            raise RuntimeError("a part of the load did not start; its own output says why")

    def begin(self, end: float) -> None:
        """Make the load until then, on the machine's clock."""
        self._say(f"{end}")

    def told(self, model: type[M], seconds: float) -> M:
        """What it tells when it is over, which must be so within `seconds`."""
        # Read while it writes: what many pages took does not fit into a pipe.
        told, _ = self._process.communicate(timeout=seconds)
        return model.model_validate_json(told)

    def _say(self, line: str) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(f"{line}\n")
        self._process.stdin.flush()

    def kill(self) -> None:
        """End it, if it has not ended."""
        _end(self._process)

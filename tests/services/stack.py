"""The service as it runs in earnest: server, broker, Celery workers and trainers, each a process of its own."""

import os
import socket
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from itertools import pairwise
from pathlib import Path
from typing import Any, TypeVar

import httpx
import psutil

from workers.config import PpoConfig
from workers.wording import NARROW_SPACE

ROOT = Path(__file__).parents[2]
TOKEN = "a-login-token-for-tests"
WORKER_TOKEN = "a-worker-token-for-tests"
# A short lease, so that what is lost is missed soon.
LEASE_SECONDS = 3
# Far more than anything here takes; compiling the simulation's kernels anew, on a fresh checkout, takes a minute.
PATIENCE = 150.0
# Environment steps between two updates of the default training.
ROLLOUT = PpoConfig().robots * PpoConfig().rollout_steps
# And between two reports, at most: a fifth of a second, on a machine much faster than today's.
REPORT = 8 * ROLLOUT

T = TypeVar("T")


def until(value: Callable[[], T], seconds: float = PATIENCE) -> T:
    """The first truthy value; a server that is away counts as none."""
    deadline = time.monotonic() + seconds
    while True:
        try:
            if result := value():
                return result
        except httpx.TransportError:
            pass
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.1)


def free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as listener:
        port: int = listener.getsockname()[1]
        return port


class Service:
    """A server and workers whose processes a test starts and kills as it likes."""

    def __init__(self, directory: Path, **environment: str) -> None:
        self.directory = directory
        self.port = free_port()
        self.url = f"http://127.0.0.1:{self.port}"
        self.api = httpx.Client(base_url=self.url, headers={"Authorization": f"Bearer {TOKEN}"}, timeout=30)
        self.environment = {
            **os.environ,
            "MAPLESS_DATA_DIR": str(directory / "data"),
            "MAPLESS_PORT": str(self.port),
            "MAPLESS_TOKEN": TOKEN,
            "MAPLESS_WORKER_TOKEN": WORKER_TOKEN,
            "MAPLESS_LEASE_SECONDS": str(LEASE_SECONDS),
            "MAPLESS_SERVER_URL": self.url,
            "MAPLESS_BROKER_URL": f"sqla+sqlite:///{directory / 'data' / 'broker.db'}",
            "MAPLESS_WORK_DIR": str(directory / "work"),
            **environment,
        }
        self.processes: list[subprocess.Popen[bytes]] = []
        self.server: subprocess.Popen[bytes] | None = None
        self.workers: dict[str, subprocess.Popen[bytes]] = {}

    def start(self, name: str, *command: str) -> "subprocess.Popen[bytes]":
        with (self.directory / f"{name}.log").open("ab") as log:
            process = subprocess.Popen(
                [sys.executable, "-m", *command],
                cwd=ROOT,
                env=self.environment,
                stdout=log,
                stderr=subprocess.STDOUT,
                start_new_session=True,
            )
        self.processes.append(process)
        return process

    def start_server(self) -> "subprocess.Popen[bytes]":
        self.server = process = self.start("server", "server", "serve")

        def answers() -> bool:
            assert process.poll() is None, (self.directory / "server.log").read_text()
            return self.api.get("/healthz").status_code == 200

        until(answers)
        return process

    def start_worker(self, name: str = "w", concurrency: int = 1) -> "subprocess.Popen[bytes]":
        self.workers[name] = process = self.start(
            name, "workers", "worker", f"--concurrency={concurrency}", f"--name={name}", "--jobs=0"
        )
        until(lambda: any(worker["name"].startswith(f"{name}@") for worker in self.api.get("/api/status").json()["workers"]))
        return process

    def launch(
        self, steps: int, save_every: int = 2 * ROLLOUT, seeds: tuple[int, ...] = (0,), **training: object
    ) -> list[str]:
        """Runs of a small training; returns their ids."""
        training = {"steps": steps, "evaluation": {"every_steps": save_every}, **training}
        response = self.api.post("/api/experiments", json={"name": "tiny", "seeds": list(seeds), "training": training})
        assert response.status_code == 201, response.text
        return [run["id"] for run in response.json()["runs"]]

    def run(self, run_id: str) -> dict[str, Any]:
        run: dict[str, Any] = self.api.get(f"/api/runs/{run_id}").json()
        return run

    def until_state(self, run_id: str, *states: str) -> dict[str, Any]:
        def reached() -> dict[str, Any] | None:
            run = self.run(run_id)
            assert run["state"] in states or run["state"] != "failed", run["error"]
            return run if run["state"] in states else None

        run = until(reached)
        assert run is not None
        return run

    def steps(self, run_id: str) -> list[int]:
        """Steps of the run's curve."""
        series = self.api.get(f"/api/runs/{run_id}/metrics", params={"names": "train/return", "points": 100_000}).json()
        return series["series"][0]["steps"] if series["series"] else []

    def checkpoints(self, run_id: str) -> list[int]:
        return [
            checkpoint["step"] for checkpoint in reversed(self.api.get(f"/api/runs/{run_id}/checkpoints").json()["items"])
        ]

    def events(self, run_id: str) -> list[str]:
        return [event["message"] for event in self.api.get(f"/api/runs/{run_id}/events").json()]

    def resumed_from(self, run_id: str) -> list[int]:
        """The step from which each attempt after the first began."""
        begins = [message for message in self.events(run_id) if " begins from step " in message]
        return [int(message.split(" from step ")[1].split(" ")[0].replace(NARROW_SPACE, "")) for message in begins]

    def stop(self, run_id: str) -> int:
        """Stop a run and return its last step, of which there is a checkpoint and a point of the curve."""
        self.api.post(f"/api/runs/{run_id}/stop").raise_for_status()
        step: int = self.until_state(run_id, "stopped")["step"]
        assert self.checkpoints(run_id)[-1] == step == self.steps(run_id)[-1]
        return step

    def close(self) -> None:
        for process in self.processes:
            if process.poll() is None:
                for member in tree(process.pid):
                    with suppress(psutil.NoSuchProcess):  # it ended meanwhile
                        member.kill()
                process.wait()
        self.api.close()


def tree(pid: int) -> list[psutil.Process]:
    """A process and all that it has started."""
    process = psutil.Process(pid)
    return [process, *process.children(recursive=True)]


def trainers(pid: int) -> list[psutil.Process]:
    """The trainer processes under a worker."""
    members = [process for process in tree(pid) if process.status() != psutil.STATUS_ZOMBIE]
    return [process for process in members if process.name() == "mapless-trainer"]


def assert_one_unbroken_curve(service: Service, run_id: str) -> None:
    """Every step once, in order; where an attempt resumed, its first report follows the checkpoint as any other would."""
    steps = service.steps(run_id)
    assert all(before < after for before, after in pairwise(steps))
    for checkpoint in service.resumed_from(run_id):
        assert checkpoint in steps
        following = steps[steps.index(checkpoint) + 1 :]
        assert following == [] or following[0] - checkpoint <= REPORT

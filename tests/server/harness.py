"""What tests of the service share: its tokens, and a stand-in for the workers that report to it."""

import asyncio
import time
from collections.abc import AsyncIterator, Sequence
from dataclasses import dataclass
from typing import Any

import httpx
from sqlalchemy import func, select

from server.checkpoints.repository import CheckpointRepository
from server.database import tables
from server.database.tables import RunState
from server.evaluations.repository import PolicyEvaluationRepository
from server.ids import new_id
from server.metrics.repository import MetricRepository, ReportedRow
from server.services import Services
from server.system.repository import WorkerRepository
from sim.config import ArenaFile, TaskConfig
from workers.job_protocol import Measurement
from workers.reporting import EpisodeResult, EvaluationResult

TOKEN = "a-login-token-for-tests"
WORKER_TOKEN = "a-worker-token-for-tests"
BASE_URL = "http://127.0.0.1:8400"


@dataclass(frozen=True)
class Reports:
    """Puts into the service what workers would have reported."""

    client: httpx.Client
    services: Services

    def experiment(self, name: str = "Corridor", seeds: Sequence[int] = (0,), **training: object) -> dict[str, Any]:
        """Launch an experiment; as the API shows it."""
        response = self.client.post("/api/experiments", json={"name": name, "seeds": list(seeds), "training": training})
        assert response.status_code == 201, response.text
        experiment: dict[str, Any] = response.json()
        return experiment

    @staticmethod
    def evaluation(arrivals: int, episodes: int = 10, *, steps: int = 80, suite_hash: str = "hash-a") -> EvaluationResult:
        """`arrivals` episodes arrive after `steps` steps with reward 100, the others collide after 5 with reward -100."""
        arrived = EpisodeResult(
            outcome="arrival", steps=steps, reward=100.0, path_length=4.0, shortest_path=3.5, min_clearance=0.3
        )
        collided = EpisodeResult(
            outcome="collision", steps=5, reward=-100.0, path_length=0.2, shortest_path=3.5, min_clearance=0.0
        )
        rows = (arrived,) * arrivals + (collided,) * (episodes - arrivals)
        return EvaluationResult(suite="simple-200", suite_hash=suite_hash, episodes=rows)

    def measured(self, evaluation: dict[str, Any], suite: str | None = None, *, arrivals: int = 8) -> None:
        """What a worker would bring of an evaluation that was asked for: eight of ten arrive, on straight ways."""
        result = Reports.evaluation(arrivals)
        if suite is not None:
            result = result.model_copy(update={"suite": suite})
        measurement = Measurement(
            result=result,
            task=TaskConfig(),
            arenas=(ArenaFile(name="room", width=6.0, height=6.0),),
            arena_indices=(0,) * len(result.episodes),
            targets=((1.0, 1.0),) * len(result.episodes),
            ways=(((0.0, 0.0), (1.0, 1.0)),) * len(result.episodes),
            jerks=(0.5,) * len(result.episodes),
            terms=("arrival", "collision"),
            returns=((100.0, 0.0),) * 8 + ((0.0, -100.0),) * 2,
        )
        with self.services.database.write() as session:
            PolicyEvaluationRepository(session).measured(evaluation["job_id"], measurement)

    def checkpoint(self, run: dict[str, Any], step: int, evaluation: EvaluationResult | None) -> str:
        """Upload an archive and register it; its id."""

        async def archive() -> AsyncIterator[bytes]:
            yield f"archive of step {step}".encode()

        file = asyncio.run(self.services.files.write(new_id(), archive()))
        with self.services.database.write() as session:
            CheckpointRepository(session).add(run["id"], step, file, evaluation)
        return file.id

    def metrics(self, run: dict[str, Any], name: str, points: dict[int, float]) -> None:
        """Report one series."""
        self.rows(run, {step: {name: value} for step, value in points.items()})

    def rows(self, run: dict[str, Any], values: dict[int, dict[str, float]]) -> None:
        """Report several series together, by step."""
        with self.services.database.write() as session:
            waiting = session.scalar(select(func.max(tables.MetricRow.seq)).where(tables.MetricRow.run_id == run["id"])) or 0
            first = max(waiting, session.get_one(tables.Run, run["id"]).last_seq) + 1
            rows = [ReportedRow(seq, step, 0.0, each) for seq, (step, each) in enumerate(values.items(), start=first)]
            MetricRepository(session).append({run["id"]: rows})
            session.get_one(tables.Run, run["id"]).last_seq = rows[-1].seq

    def cut(self, run: dict[str, Any], step: int) -> None:
        """Forget what was reported beyond a step."""
        with self.services.database.write() as session:
            MetricRepository(session).drop_beyond(run["id"], step)

    def state(self, run: dict[str, Any], state: RunState, **columns: Any) -> None:
        """Bring a run where a worker would have brought it."""
        with self.services.database.write() as session:
            row = session.get_one(tables.Run, run["id"])
            row.state = state
            for name, value in columns.items():
                setattr(row, name, value)

    def remove(self, experiment: dict[str, Any]) -> None:
        """Remove an experiment that lies in the trash."""
        action = {"action": "remove", "experiments": [experiment["id"]]}
        assert self.client.post("/api/workbench/actions", json=action).json()["done"] == [experiment["id"]]

    def heard_of(self, worker: str, seconds_ago: float) -> None:
        """Have heard of a worker."""
        with self.services.database.write() as session:
            WorkerRepository(session).seen(worker, "cpu", time.time() - seconds_ago)

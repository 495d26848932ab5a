"""Makes a lab's database: experiments, runs, curves and checkpoints, written by the server's own repositories."""

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import text
from sqlalchemy.orm import Session

from server.checkpoints.repository import CheckpointRepository
from server.database import tables
from server.database.engine import Database
from server.database.migrate import upgrade
from server.experiments.repository import ExperimentRepository
from server.files import StoredFile
from server.ids import new_id
from server.metrics.points import Points
from server.metrics.repository import MetricRepository
from workers.config import TrainingConfig
from workers.reporting import EpisodeResult, EvaluationResult
from workers.reproduction.rows import ROWS
from workers.training.effort import CPU, EPISODES, WALL

# Series of a PPO run, those of the run's first charts and of the comparison among them.
SERIES = (
    "train/success_rate",
    "train/return",
    "train/reward",
    "train/episode_length",
    "train/collision_rate",
    "train/timeout_rate",
    "reward/arrival",
    "reward/collision",
    "reward/progress",
    "reward/penalty",
    "loss/policy",
    "loss/value",
    "policy/kl",
    "policy/entropy",
    "policy/std_linear",
    "policy/std_angular",
    "policy/clip_fraction",
    "value/explained_variance",
    "optim/learning_rate",
    "time/steps_per_second",
)
EVALUATED = ("eval/success_rate", "eval/steps")
# An evaluation comes once in so many points of the other series.
_EVALUATE_EVERY = 50
_STEPS_A_POINT = 512
_SECONDS_A_POINT = 0.7
_SEEDS = 5
_EPISODES = 100
# Points in one transaction at most: bounds memory.
_COMMIT_POINTS = 4_000_000
_NAMES = ("Corridor", "Office", "Märkte", "École", "Bays", "Thicket", "Crossing", "Crowd")


@dataclass(frozen=True)
class Sizes:
    """How much there is.

    Attributes:
        experiments: of five runs each, finished.
        points: of each of the 20 series of their runs, and of what they count beside steps.
        long_experiments: of five long runs each, finished too: what is compared.
        long_points: of each of the 20 series of those.
        checkpoints: of the one run that has many.
        live: runs that wait for somebody to report for them.
    """

    experiments: int = 196
    points: int = 1_000
    long_experiments: int = 10
    long_points: int = 100_000
    checkpoints: int = 2_000
    live: int = 50


def ask_sizes(options: argparse.ArgumentParser) -> Sizes:
    """Add the options that say how many experiments there are and how long; the sizes where nobody says."""
    sizes = Sizes()
    options.add_argument("--experiments", type=int, default=sizes.experiments, help="finished ones of five short runs")
    options.add_argument("--points", type=int, default=sizes.points, help="of each of the 20 series of a short run")
    options.add_argument("--long-experiments", type=int, default=sizes.long_experiments, help="that are compared")
    options.add_argument("--long-points", type=int, default=sizes.long_points, help="of each series of their runs")
    return sizes


@dataclass
class Lab:
    """What was made: ids by the part that they play, and what the curves cost.

    Attributes:
        experiments: finished ones with short runs.
        long_experiments: finished ones with long runs.
        short: a run of one of the first.
        few: a long run with 50 checkpoints.
        many: a long run with many.
        stopped: long runs that can be resumed.
        stopped_short: short ones, of the last two of `experiments`.
        live: queued runs.
        points: in the curves of all.
        bytes: that the database's file has grown by them.
        seconds: that making it took.
    """

    experiments: list[str] = field(default_factory=list)
    long_experiments: list[str] = field(default_factory=list)
    short: str = ""
    few: str = ""
    many: str = ""
    stopped: list[str] = field(default_factory=list)
    stopped_short: list[str] = field(default_factory=list)
    live: list[str] = field(default_factory=list)
    points: int = 0
    bytes: int = 0
    seconds: float = 0.0


def make(data_dir: Path, sizes: Sizes) -> Lab:
    """Fill a new SQLite database in `data_dir`."""
    began = time.monotonic()
    data_dir.mkdir(parents=True, exist_ok=True)
    database = Database(f"sqlite:///{data_dir / 'mapless.db'}")
    upgrade(database)
    lab = Lab()
    try:
        _Maker(database, lab).make(sizes)
    finally:
        database.dispose()
    lab.seconds = time.monotonic() - began
    return lab


class _Maker:
    def __init__(self, database: Database, lab: Lab) -> None:
        self._database = database
        self._lab = lab
        self._random = np.random.default_rng(0)
        self._evaluation = _evaluation()

    def make(self, sizes: Sizes) -> None:
        campaign = new_id()
        for row in ROWS[: sizes.experiments]:
            self._experiment(f"Paper: {row.id}", row.training, "completed", campaign=campaign, campaign_row=row.id)
        for index in range(max(0, sizes.experiments - len(ROWS))):
            name = f"{_NAMES[index % len(_NAMES)]} {index}"
            experiment = self._experiment(name, TrainingConfig(), "completed")
            self._lab.experiments.append(experiment.id)
            self._lab.short = self._lab.short or experiment.runs[0].id
            self._lab.stopped_short = [*self._lab.stopped_short[-_SEEDS:], *(run.id for run in experiment.runs)]
        long = [self._experiment(f"Long {index}", TrainingConfig(), "completed") for index in range(sizes.long_experiments)]
        self._lab.long_experiments = [experiment.id for experiment in long]
        steps = max(sizes.points, sizes.long_points) * _STEPS_A_POINT
        live = TrainingConfig(steps=max(1_000_000, steps))
        for start in range(0, sizes.live, _SEEDS):
            seeds = min(_SEEDS, sizes.live - start)
            experiment = self._experiment(f"Live {start}", live, "queued", seeds=seeds)
            self._lab.live += [run.id for run in experiment.runs]
        self._curves(sizes, {run.id for experiment in long for run in experiment.runs})
        runs = [run for experiment in long for run in experiment.runs]
        self._lab.many, self._lab.few = runs[0].id, runs[1].id
        self._lab.stopped = [run.id for run in runs[2:]]
        self._checkpoints(self._lab.many, sizes.checkpoints, sizes.long_points)
        self._checkpoints(self._lab.few, min(50, sizes.checkpoints), sizes.long_points)
        # They go on from before their end: what lies beyond is dropped.
        for run_ids, points in ((self._lab.stopped, sizes.long_points), (self._lab.stopped_short, sizes.points)):
            for run_id in run_ids:
                self._checkpoints(run_id, 1, int(0.95 * points))
        with self._database.write() as session:
            for run_id in (*self._lab.stopped, *self._lab.stopped_short):
                session.get_one(tables.Run, run_id).state = "stopped"

    def _experiment(
        self, name: str, training: TrainingConfig, state: tables.RunState, *, seeds: int = _SEEDS, **campaign: str
    ) -> tables.Experiment:
        now = time.time()
        experiment = tables.Experiment(id=new_id(), name=name, training=training.model_dump(mode="json"), **campaign)
        for seed in range(seeds):
            run = tables.Run(id=new_id(), seed=seed, state=state)
            if state == "completed":
                run.attempt, run.step, run.started_at, run.finished_at = 1, training.steps, now - 3600, now
            experiment.runs.append(run)
        with self._database.write() as session:
            ExperimentRepository(session).add(experiment)
        return experiment

    def _curves(self, sizes: Sizes, long: set[str]) -> None:
        """The curves of every finished run, and one checkpoint of it."""
        before = self._file_bytes()
        with self._database.read() as session:
            runs = [run.id for run in session.query(tables.Run).where(tables.Run.state == "completed")]
        for batch in _batches(runs, [len(SERIES) * (sizes.long_points if run in long else sizes.points) for run in runs]):
            with self._database.write() as session:
                for run_id in batch:
                    self._write(session, run_id, sizes.long_points if run_id in long else sizes.points)
        self._lab.bytes = self._file_bytes() - before
        for run_id in runs:
            if run_id not in long and run_id not in self._lab.stopped_short:
                self._checkpoints(run_id, 1, sizes.points)

    def _write(self, session: Session, run_id: str, count: int) -> None:
        steps = np.arange(1, count + 1, dtype=np.int64) * _STEPS_A_POINT
        seconds = np.cumsum(self._random.gamma(20.0, _SECONDS_A_POINT / 20.0, count))
        times = time.time() + seconds
        rare = slice(_EVALUATE_EVERY - 1, None, _EVALUATE_EVERY)
        series = {name: Points(steps, times, self._walk(count)) for name in SERIES}
        series |= {name: Points(steps[rare], times[rare], self._walk(count)[rare]) for name in EVALUATED}
        counts = {WALL: seconds, CPU: 1.4 * seconds, EPISODES: np.cumsum(self._random.poisson(6.0, count))}
        series |= {name: Points(steps, times, each.astype(np.float32)) for name, each in counts.items()}
        table = {"reward": 1.0, "episodes": 90.0, "success": 0.9, "collisions": 0.1, "steps": 110.0}
        last = slice(count - 1, count)
        series |= {
            f"table/{name}": Points(steps[last], times[last], np.full(1, value, np.float32)) for name, value in table.items()
        }
        MetricRepository(session).add_series(run_id, series)
        run = session.get_one(tables.Run, run_id)
        run.step, run.last_seq = int(steps[-1]), count
        self._lab.points += sum(len(points) for points in series.values())

    def _walk(self, count: int) -> NDArray[np.float32]:
        """A rate that wanders between 0 and 1 with noise on it."""
        walk = np.cumsum(self._random.standard_normal(count, dtype=np.float32)) / np.float32(np.sqrt(count))
        values = 0.5 + 0.4 * np.tanh(walk) + 0.05 * self._random.standard_normal(count, dtype=np.float32)
        return np.asarray(np.clip(values, 0.0, 1.0), np.float32)

    def _checkpoints(self, run_id: str, count: int, points: int) -> None:
        with self._database.write() as session:
            repository = CheckpointRepository(session)
            for index in range(1, count + 1):
                file = StoredFile(id=new_id(), size=48_000, sha256="0" * 64)
                repository.add(run_id, points * _STEPS_A_POINT * index // count, file, self._evaluation)

    def _file_bytes(self) -> int:
        with self._database.read() as session:
            pages = session.scalar(text("PRAGMA page_count")) or 0
            return int(pages) * int(session.scalar(text("PRAGMA page_size")) or 0)


def _evaluation() -> EvaluationResult:
    episode = EpisodeResult(outcome="arrival", steps=80, reward=100.0, path_length=4.0, shortest_path=3.5, min_clearance=0.3)
    return EvaluationResult(suite="simple-200", suite_hash="0" * 64, episodes=(episode,) * _EPISODES)


def _batches(runs: list[str], points: list[int]) -> Iterator[list[str]]:
    """The runs in order, so many together that their points fit into one transaction."""
    batch: list[str] = []
    total = 0
    for run, count in zip(runs, points, strict=True):
        if batch and total + count > _COMMIT_POINTS:
            yield batch
            batch, total = [], 0
        batch.append(run)
        total += count
    if batch:
        yield batch

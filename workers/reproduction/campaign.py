"""The campaign on this machine: every row with every seed, several side by side, continued where it was interrupted."""

import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import torch

from sim.config import Frozen, TaskConfig
from sim.vector_env import NavigationVectorEnv
from workers.checkpoints import read_policy
from workers.errors import ArchiveError
from workers.frames import Frame
from workers.live.viewing import PolicyFunction
from workers.reporting import EvaluationResult, EventLevel, WatchRequest
from workers.reproduction.rows import EPISODES_STEPS, ROWS, Row, TableRow
from workers.trainer import train

RESULT = "result.json"

# One drive of 10,000 steps, as the paper's, holds about 90 attempts: ten of them are a fairer sample.
DRIVES = 10
# Of the drives' own starts and targets, apart from every training's.
_DRIVE_SEED = 1_000_003


class RunResult(Frozen):
    """One row with one seed, trained and measured."""

    row: str
    seed: int
    measured: TableRow


class Quiet:
    """A reporter of trainings that nobody follows one by one."""

    watch: WatchRequest | None = None
    stop_requested = False

    def metrics(self, step: int, values: Mapping[str, float]) -> None:
        """Not kept."""

    def event(self, step: int, level: EventLevel, message: str) -> None:
        """Not kept."""

    def checkpoint(self, step: int, archive: Path, evaluation: EvaluationResult | None) -> None:
        """Drops what came before: only the last one is needed to go on, and to measure."""
        for other in archive.parent.glob("step-*.zip"):
            if other != archive:
                other.unlink()

    def frames(self, frames: Sequence[Frame]) -> None:
        """Not kept."""


def drive(policy: PolicyFunction, task: TaskConfig, drives: int = DRIVES, steps: int = EPISODES_STEPS) -> TableRow:
    """Measures a policy as the paper's tables do: target after target, for a number of steps.

    Args:
        policy: deterministic.
        task: what it was trained for.
        drives: robots, each alone.
        steps: of each.

    Returns:
        Figures of one drive, the mean of all of them.
    """
    env = NavigationVectorEnv(task, drives, seed=_DRIVE_SEED, copy=False)
    observations, _ = env.reset(seed=_DRIVE_SEED)
    outcomes, reward = np.zeros(4, np.int64), 0.0
    for _ in range(steps):
        observations, rewards, _, _, _ = env.step(policy(observations))
        outcomes += np.bincount(env.outcomes, minlength=4)
        reward += float(rewards.sum())
    episodes = max(1, int(outcomes[1:].sum()))
    return TableRow(
        reward=reward / (drives * steps),
        episodes=episodes / drives,
        success=int(outcomes[1]) / episodes,
        steps=drives * steps / episodes,
    )


def reproduce_one(row: Row, seed: int, directory: Path) -> RunResult:
    """Trains and measures one row with one seed in a folder of its own; done work is not done again."""
    folder = directory / row.id / f"seed-{seed}"
    done = folder / RESULT
    if done.exists():
        return RunResult.model_validate_json(done.read_text())
    train(row.training, seed, Quiet(), folder, _last_checkpoint(folder))
    archive = _last_checkpoint(folder)
    assert archive is not None, "a completed training leaves a checkpoint"
    torch.set_num_threads(1)
    result = RunResult(row=row.id, seed=seed, measured=drive(read_policy(archive)[1], row.training.task))
    partial = done.with_suffix(".part")
    partial.write_text(result.model_dump_json(indent=2))
    partial.replace(done)
    return result


def reproduce(
    directory: Path, seeds: int, jobs: int, rows: Sequence[Row] = ROWS, on_result: Callable[[RunResult], None] | None = None
) -> dict[str, list[TableRow]]:
    """Runs every row with seeds 0 to `seeds` - 1, `jobs` at a time.

    Args:
        directory: of the campaign; one that was interrupted goes on where it was.
        seeds: of each row.
        jobs: processes, one thread each.
        rows: which.
        on_result: told of each result as it comes.

    Returns:
        Results by row, in the order of seeds.
    """
    found: dict[tuple[str, int], TableRow] = {}
    for result in _results(directory, seeds, jobs, rows):
        found[result.row, result.seed] = result.measured
        if on_result is not None:
            on_result(result)
    return {row.id: [found[row.id, seed] for seed in range(seeds)] for row in rows}


def _results(directory: Path, seeds: int, jobs: int, rows: Sequence[Row]) -> Iterator[RunResult]:
    # A fresh interpreter for each process: torch's threads do not survive a fork.
    with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
        pending: set[Future[RunResult]] = {
            pool.submit(reproduce_one, row, seed, directory) for seed in range(seeds) for row in rows
        }
        try:
            while pending:
                finished, pending = wait(pending, return_when=FIRST_COMPLETED)
                for future in finished:
                    yield future.result()
        finally:
            for future in pending:
                future.cancel()


def _last_checkpoint(folder: Path) -> Path | None:
    """The newest archive that is whole."""
    archives = {int(match[1]): path for path in folder.glob("step-*.zip") if (match := re.search(r"step-(\d+)", path.name))}
    for step in sorted(archives, reverse=True):
        try:
            read_policy(archives[step])
        except ArchiveError:
            continue
        return archives[step]
    return None

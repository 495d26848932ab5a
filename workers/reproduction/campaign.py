"""The campaign on this machine: every row with every seed, several side by side, continued where it was interrupted."""

import os
import signal
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from multiprocessing import get_context
from multiprocessing.synchronize import Event
from pathlib import Path
from types import FrameType
from typing import Any

from sim.config import Frozen
from sim.errors import SimError
from workers.errors import InterruptedCampaignError, TrainingError
from workers.processes import die_with_parent
from workers.reproduction.pace import Share, seconds_left
from workers.reproduction.results import Progress, Trained
from workers.reproduction.rows import ROWS, Row, scaled

_TIME = "campaign.json"
# Numbers that a process tells of its training: before, done, seconds.
_TOLD = 3
_TICK_SECONDS = 0.5


class SeedDone(Frozen):
    """One row with one seed: trained, or failed for a reason."""

    row: str
    seed: int
    trained: Trained | None
    error: str | None = None


class Tick(Frozen):
    """How a campaign stands.

    Attributes:
        finished: trainings that are through.
        trainings: all of them.
        done: part of the work, 0 to 1.
        seconds_left: to the end, about.
    """

    finished: int
    trainings: int
    done: float
    seconds_left: float


class Outcome(Frozen):
    """A campaign that is through.

    Attributes:
        done: every row with every seed, by row and seed.
        seeds: of each row.
        effort: part of the rows' training steps.
        seconds: wall time, that of interrupted attempts included.
    """

    done: tuple[SeedDone, ...]
    seeds: int
    effort: float
    seconds: float

    def of_row(self, row: str) -> list[Trained]:
        """The row's trainings that did not fail, by seed."""
        return [one.trained for one in self.done if one.row == row and one.trained is not None]


class _Time(Frozen):
    seconds: float = 0.0


def reproduce(
    directory: Path,
    seeds: int,
    jobs: int,
    *,
    effort: float = 1.0,
    rows: Sequence[Row] = ROWS,
    on_done: Callable[[SeedDone], None] = lambda _: None,
    on_tick: Callable[[Tick], None] = lambda _: None,
) -> Outcome:
    """Runs every row with seeds 0 to `seeds` - 1.

    Args:
        directory: of the campaign; one that was interrupted goes on where it was.
        seeds: of each row.
        jobs: trainings side by side, one process and one thread each.
        effort: part of the rows' training steps, above 0, at most 1; below 1 it is a trial.
        rows: which.
        on_done: told of each training as it ends.
        on_tick: told twice a second how things stand.

    Raises:
        InterruptedCampaignError: Ctrl-C was pressed, or a process was killed.
        OtherTrainingError: the directory is that of another campaign.
    """
    directory.mkdir(parents=True, exist_ok=True)
    spent = directory / _TIME
    before = _Time.model_validate_json(spent.read_text()) if spent.exists() else _Time()
    begun = time.monotonic()
    # Seed by seed: the first intervals can be looked at early.
    tasks = [(row, seed) for seed in range(seeds) for row in rows]
    try:
        found = {(one.row, one.seed): one for one in _run(directory, tasks, effort, jobs, on_done, on_tick)}
    finally:
        spent.write_text(_Time(seconds=before.seconds + time.monotonic() - begun).model_dump_json())
    return Outcome(
        done=tuple(found[row.id, seed] for row in rows for seed in range(seeds)),
        seeds=seeds,
        effort=effort,
        seconds=before.seconds + time.monotonic() - begun,
    )


def _run(
    directory: Path,
    tasks: Sequence[tuple[Row, int]],
    effort: float,
    jobs: int,
    on_done: Callable[[SeedDone], None],
    on_tick: Callable[[Tick], None],
) -> Iterator[SeedDone]:
    # A fresh interpreter for each process: torch's threads do not survive a fork.
    context = get_context("spawn")
    told, stop = context.Array("d", _TOLD * len(tasks), lock=False), context.Event()
    shared = (told, stop, os.getpid())
    with (
        ProcessPoolExecutor(min(jobs, len(tasks)), mp_context=context, initializer=_start, initargs=shared) as pool,
        _on_interrupt(stop),
    ):
        pending: set[Future[SeedDone | None]] = {
            pool.submit(_work, index, directory / row.id / f"seed-{seed}", row, seed, effort)
            for index, (row, seed) in enumerate(tasks)
        }
        finished = 0
        while pending:
            ended, pending = wait(pending, timeout=_TICK_SECONDS, return_when=FIRST_COMPLETED)
            if stop.is_set():
                for future in pending:
                    future.cancel()
                pending = {future for future in pending if not future.cancelled()}
            for one in filter(None, map(_result, ended)):
                finished += 1
                on_done(one)
                yield one
            on_tick(_tick(told, [row.seconds * effort for row, _ in tasks], finished, jobs))
        if finished < len(tasks):
            raise InterruptedCampaignError("interrupted: the same command goes on where it was")


def _result(future: "Future[SeedDone | None]") -> SeedDone | None:
    try:
        return future.result()
    except BrokenProcessPool as error:
        raise InterruptedCampaignError(
            "a training's process was killed, perhaps for want of memory: the same command goes on where it was, with fewer "
            "jobs it needs less"
        ) from error


def _tick(told: Any, expected: Sequence[float], finished: int, jobs: int) -> Tick:
    trainings = [Progress(before=told[at], done=told[at + 1], seconds=told[at + 2]) for at in range(0, len(told), _TOLD)]
    shares = [
        # What was done in an earlier attempt is no part of what is timed in this one.
        Share(
            expected=seconds * (1.0 - one.before),
            done=(one.done - one.before) / (1.0 - one.before) if one.before < 1.0 else 1.0,
            spent=one.seconds,
        )
        for one, seconds in zip(trainings, expected, strict=True)
    ]
    done = sum(one.done * seconds for one, seconds in zip(trainings, expected, strict=True)) / sum(expected)
    return Tick(finished=finished, trainings=len(trainings), done=done, seconds_left=seconds_left(shares, jobs))


@contextmanager
def _on_interrupt(stop: Event) -> Iterator[None]:
    """Ctrl-C asks the trainings to write a checkpoint and end; a second one interrupts at once."""

    def ask(_signal: int, _frame: FrameType | None) -> None:
        stop.set()
        signal.signal(signal.SIGINT, signal.default_int_handler)

    previous = signal.signal(signal.SIGINT, ask)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)


# --- in the processes ---

_told: Any
_stop: Event


def _start(told: Any, stop: Event, parent: int) -> None:
    global _told, _stop
    die_with_parent(parent)
    # Ctrl-C reaches the whole terminal; ending in order is the campaign's decision.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _told, _stop = told, stop


def _work(index: int, folder: Path, row: Row, seed: int, effort: float) -> SeedDone | None:
    # Only here: the process that waits for the others needs no torch.
    from workers.reproduction.training import train_in

    def tell(progress: Progress) -> None:
        _told[_TOLD * index : _TOLD * (index + 1)] = [progress.before, progress.done, progress.seconds]

    if _stop.is_set():
        return None
    try:
        trained = train_in(folder, scaled(row.training, effort), seed, tell, _stop.is_set)
    except (TrainingError, SimError) as error:
        return SeedDone(row=row.id, seed=seed, trained=None, error=str(error))
    if trained is None:
        return None
    if not _told[_TOLD * index + 2]:
        tell(Progress(before=1.0, done=1.0, seconds=0.0))
    return SeedDone(row=row.id, seed=seed, trained=trained)

"""The campaign on this machine: every row with every seed, several side by side, continued where it was interrupted."""

import os
import signal
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
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
from workers.reproduction.outcome import Outcome, SeedDone, Tick
from workers.reproduction.pace import Share, seconds_left
from workers.reproduction.results import Progress
from workers.reproduction.rows import ROWS, Row, scaled
from workers.reproduction.widths import seeds_wanted

_TIME = "campaign.json"
# Numbers that a process tells of its training: before, done, seconds.
_TOLD = 3
_TICK_SECONDS = 0.5


class _Time(Frozen):
    seconds: float = 0.0


def reproduce(
    directory: Path,
    seeds: int,
    jobs: int,
    *,
    at_most: int | None = None,
    known: Sequence[SeedDone] = (),
    effort: float = 1.0,
    rows: Sequence[Row] = ROWS,
    on_done: Callable[[SeedDone], None] = lambda _: None,
    on_tick: Callable[[Tick], None] = lambda _: None,
) -> Outcome:
    """Runs every row with seeds 0 to `seeds` - 1, and then with more where intervals are wide.

    Args:
        directory: of the campaign; one that was interrupted goes on where it was.
        seeds: of each row.
        jobs: trainings side by side, one process and one thread each.
        at_most: seeds of a row: those whose comparisons are wider than their margins get five at a time up to this.
        known: trainings that are not done again.
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
    found = {(one.row, one.seed): one for one in known}
    counts: Mapping[str, int] = {row.id: seeds for row in rows}
    try:
        while counts:
            # Seed by seed: the first intervals can be looked at early.
            tasks = [
                (row, seed)
                for seed in range(max(counts.values()))
                for row in rows
                if seed < counts.get(row.id, 0) and (row.id, seed) not in found
            ]
            earlier = [row.seconds * effort for row in rows for one in found if one[0] == row.id]
            for one in _run(directory, tasks, earlier, effort, jobs, on_done, on_tick):
                found[one.row, one.seed] = one
            counts = _more(found.values(), rows, at_most) if at_most is not None else {}
    finally:
        spent.write_text(_Time(seconds=before.seconds + time.monotonic() - begun).model_dump_json())
    return Outcome(
        done=tuple(found[key] for row in rows for key in sorted(found) if key[0] == row.id),
        effort=effort,
        seconds=before.seconds + time.monotonic() - begun,
    )


def _more(found: Collection[SeedDone], rows: Sequence[Row], at_most: int) -> dict[str, int]:
    results = {row.id: [one.trained.result for one in found if one.row == row.id and one.trained] for row in rows}
    return seeds_wanted(results, Counter(one.row for one in found), at_most)


def _run(
    directory: Path,
    tasks: Sequence[tuple[Row, int]],
    earlier: Sequence[float],
    effort: float,
    jobs: int,
    on_done: Callable[[SeedDone], None],
    on_tick: Callable[[Tick], None],
) -> Iterator[SeedDone]:
    if not tasks:
        return
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
            on_tick(_tick(told, [row.seconds * effort for row, _ in tasks], earlier, finished, jobs))
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


def _tick(told: Any, expected: Sequence[float], earlier: Sequence[float], finished: int, jobs: int) -> Tick:
    """How the trainings of this round stand, those before it counted in, of which the expected seconds are known."""
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
    done = sum(earlier) + sum(one.done * seconds for one, seconds in zip(trainings, expected, strict=True))
    return Tick(
        finished=len(earlier) + finished,
        trainings=len(earlier) + len(trainings),
        done=done / (sum(earlier) + sum(expected)),
        seconds_left=seconds_left(shares, jobs),
    )


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

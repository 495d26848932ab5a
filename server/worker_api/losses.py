"""When as many attempts were lost as may be: the rule that runs and jobs share.

Too many are three by each worker that there is, or one by each of three workers: a sick machine alone fails nothing that a
healthy one would finish.
"""

from collections.abc import Collection

from server.database import tables

MAX_LOSSES = 3
"""Attempts in a row that one worker may lose while others wait; and workers that may lose one."""

Lost = tables.Run | tables.Job


def count_loss(row: Lost) -> None:
    """Its worker has lost it once more."""
    row.losses += 1
    if row.worker is not None:
        name = machine_of(row.worker)
        row.lost_by = {**(row.lost_by or {}), name: (row.lost_by or {}).get(name, 0) + 1}


def too_many(row: Lost, others: Collection[str]) -> bool:
    """Whether another attempt would be one too many.

    Args:
        row: what was lost.
        others: the workers that would take it up now.
    """
    return len(row.lost_by or {}) >= MAX_LOSSES or (row.losses >= MAX_LOSSES and not hopeful(row, others))


def exhausted(row: Lost, worker: str) -> bool:
    """Whether this worker has lost it so often that another one should try."""
    return (row.lost_by or {}).get(machine_of(worker), 0) >= MAX_LOSSES


def hopeful(row: Lost, workers: Collection[str]) -> bool:
    """Whether one of these workers has not lost it that often."""
    return any(not exhausted(row, worker) for worker in workers)


def machine_of(worker: str) -> str:
    """A worker without the number of its process: what fails one of its attempts fails the others too."""
    return worker.partition("/")[0]

"""What a job that waits stands behind, and about how long."""

from collections.abc import Sequence
from dataclasses import dataclass

from server.database import tables
from server.jobs.board import Board
from server.jobs.views import seconds_left


@dataclass(frozen=True)
class Turn:
    """Where an evaluation stands in the queue.

    Attributes:
        behind: titles of the evaluations under way that keep its places, then of those that go before it.
        starts_in: seconds until the first of the places is free; None where others go first, or that is not known yet.
    """

    behind: tuple[str, ...]
    starts_in: float | None


def turns_of(running: Sequence[tables.Job], queued: Sequence[tables.Job], board: Board) -> dict[str, Turn]:
    """Of each evaluation that waits, by its id.

    Args:
        running: evaluations that workers have.
        queued: evaluations that wait, in the order of their turn.
        board: knows how far those under way are.
    """
    found: dict[str, Turn] = {}
    for index, job in enumerate(queued):
        ahead = queued[:index]
        left = [seconds_left(one, board.progress(one.id)) for one in running]
        known = [one for one in left if one is not None]
        starts_in = min(known) if known and not ahead else None
        found[job.id] = Turn(tuple(one.title for one in (*running, *ahead)), starts_in)
    return found

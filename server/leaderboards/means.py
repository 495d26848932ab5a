"""Figures beside success, of several seeds together."""

from collections.abc import Sequence

from server.checkpoints.repository import decode_episodes
from server.database import tables
from server.recent import Recent
from workers.shipped.figures import figures

# Reading an evaluation's episodes takes about a millisecond, and a board asks for hundreds of them at every look.
_SPL: Recent[float] = Recent(8_192)


def spl_of(evaluation: tables.Evaluation, arrival_distance: float) -> float:
    """Success weighted by path length of a checkpoint's evaluation, which never changes.

    Args:
        evaluation: with its episodes.
        arrival_distance: of its task, metres.
    """
    return _SPL.get(evaluation.id, lambda: figures(decode_episodes(evaluation), arrival_distance).spl)


def mean_of(values: Sequence[float | None]) -> float | None:
    """Mean over the seeds that have a value; None where none has."""
    known = [value for value in values if value is not None]
    return sum(known) / len(known) if known else None

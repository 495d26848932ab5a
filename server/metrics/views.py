"""What a run's row says of its curves."""

from server.database import tables
from server.metrics.schemas import Thinned
from server.runs.repository import PointsState


def thinned_view(run: tables.Run | PointsState) -> Thinned | None:
    """What was done to the curves of a run; None where every point is kept."""
    if run.thinned_at is None or run.thinned_from is None or run.thinned_to is None:
        return None
    return Thinned(since=run.thinned_at, points=run.thinned_from, kept=run.thinned_to)

"""How long a campaign still takes, told from what its trainings have taken so far (no imports beyond pydantic)."""

from collections.abc import Sequence

from sim.config import Frozen

# Before this much of the expected work is done, start-up times would pass for slowness.
_TRUSTED_SECONDS = 20.0


class Share(Frozen):
    """One training of a campaign.

    Attributes:
        expected: seconds that it takes, as known beforehand.
        done: part of it, 0 to 1.
        spent: seconds on it so far; None where they can't be told (an interrupted one).
    """

    expected: float
    done: float
    spent: float | None = None


def seconds_left(shares: Sequence[Share], side_by_side: int) -> float:
    """Wall time to the end of all trainings.

    What was known beforehand is corrected by how long the work done so far has taken; the last training runs alone.

    Args:
        shares: of every training, done or not.
        side_by_side: trainings at a time, at least 1.
    """
    known = [share for share in shares if share.spent is not None and share.done > 0.0]
    foreseen = sum(share.expected * share.done for share in known)
    pace = sum(share.spent or 0.0 for share in known) / foreseen if foreseen >= _TRUSTED_SECONDS else 1.0
    left = [share.expected * (1.0 - share.done) for share in shares]
    return pace * max(sum(left) / side_by_side, max(left, default=0.0))

"""What a campaign tells while it goes on, and what it leaves (pydantic only)."""

from sim.config import Frozen
from workers.reproduction.results import Trained


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
        effort: part of the rows' training steps.
        seconds: wall time, that of interrupted attempts included.
    """

    done: tuple[SeedDone, ...]
    effort: float
    seconds: float

    def of_row(self, row: str) -> list[Trained]:
        """The row's trainings that did not fail, by seed."""
        return [one.trained for one in self.done if one.row == row and one.trained is not None]

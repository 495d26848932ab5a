"""How long an experiment still takes, from how its running runs get on and how many wait behind them."""

from collections.abc import Sequence
from typing import Protocol

from server.database.tables import RunState


class Paced(Protocol):
    """How far a run is, and how quick."""

    @property
    def state(self) -> RunState:
        """That it is in."""

    @property
    def step(self) -> int:
        """Environment steps done."""

    @property
    def total_steps(self) -> int:
        """That it was given."""

    @property
    def steps_per_second(self) -> float | None:
        """None unless it runs."""

    @property
    def seconds_left(self) -> float | None:
        """None unless it runs."""


def seconds_left(runs: Sequence[Paced]) -> float | None:
    """Seconds until the last run is through; None where none runs, or none has said yet how quick it is.

    Those that wait are taken to be as quick as the mean of those that run, and to be trained as many at a time as now: the
    work that is left over what does it, and never less than the slowest one's own.
    """
    going = [run for run in runs if run.seconds_left is not None and run.steps_per_second]
    if not going:
        return None
    speed = sum(run.steps_per_second or 0.0 for run in going) / len(going)
    left = [run.seconds_left or 0.0 for run in going]
    waiting = [(run.total_steps - run.step) / speed for run in runs if run.state == "queued"]
    return max(*left, *waiting, (sum(left) + sum(waiting)) / len(going))

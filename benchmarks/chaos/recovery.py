"""When a run has recovered from a fault: something that was reported after it is in the database."""

import time
from dataclasses import dataclass

from benchmarks.chaos.progress import Progress


@dataclass
class Recovery:
    """Waits for one run.

    Attributes:
        before: the row when the fault's cause had gone.
        new_attempt: whether only another attempt's reports count.
        begun_at: then, on the monotonic clock.
        seconds: from then to the first new report in the database; None while there is none.
    """

    before: Progress
    new_attempt: bool
    begun_at: float
    seconds: float | None = None

    def __post_init__(self) -> None:
        self._base = self.before

    def look(self, now: Progress) -> bool:
        """Whether the run has recovered, seen as it stands now."""
        if self.seconds is not None:
            return True
        if now.attempt != self._base.attempt:
            # What the lost attempt had on its way may have come after the fault; a claim takes none of it.
            self._base = now
        fresh = now.attempt > self.before.attempt or not self.new_attempt
        if now.state == "completed" or (fresh and now.state == "running" and now.last_seq > self._base.last_seq):
            self.seconds = time.monotonic() - self.begun_at
            return True
        return False

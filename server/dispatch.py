"""How the service reaches workers: what the rest of it may ask, whoever answers."""

from typing import Protocol

from workers.protocol import Queue


class Doorbell(Protocol):
    """Wakes a worker. A ring may be lost or heard twice: the rows say what is to be done, the sweeper rings again."""

    def ring(self, run_id: str, attempt: int, queue: Queue) -> None:
        """Say that a run is queued at `attempt`, to the workers of `queue`. Never raises for a broker that is away."""


class Links(Protocol):
    """The open links to workers. Calls come from any thread, return at once, and do nothing where there is no link."""

    def stop(self, run_id: str) -> None:
        """Ask the run's worker to write a checkpoint and end; the run's state is `stopping` already."""

    def cut(self, run_id: str) -> None:
        """Fence the run's worker out at once: the run has been deleted."""


class NoDoorbell:
    """No worker is to be woken: for the API on its own, and for tests."""

    def ring(self, run_id: str, attempt: int, queue: Queue) -> None:
        """Do nothing: the run stays queued."""


class NoLinks:
    """No worker is linked."""

    def stop(self, run_id: str) -> None:
        """Do nothing."""

    def cut(self, run_id: str) -> None:
        """Do nothing."""

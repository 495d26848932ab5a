"""The one way out of a training: what the trainer tells, and what it is told, whoever listens."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Annotated, Literal, Protocol

from pydantic import Field

from sim.config import Frozen
from workers.frames import Frame, ViewMode

EventLevel = Literal["info", "warning", "error"]
Outcome = Literal["arrival", "collision", "timeout"]
Figure = Annotated[float, Field(ge=-1e30, le=1e30)]
"""A number of an episode; sums over episodes stay finite."""


class WatchRequest(Frozen):
    """What somebody wants to see of a training.

    Attributes:
        mode: the training robots, or the newest policy on its own.
        robots: how many, 1 to 64.
        speed: simulated seconds per wall second in policy mode: 1, 2, 5 or 10.
    """

    mode: ViewMode = "policy"
    robots: int = 8
    speed: float = 1.0


class EpisodeResult(Frozen):
    """One scenario of an evaluation: one target attempt.

    Attributes:
        outcome: arrival, collision or time-out.
        steps: control steps driven.
        reward: summed reward.
        path_length: metres driven.
        shortest_path: metres from start to target as the crow flies, or around obstacles where that is known.
        min_clearance: smallest distance between the robot's body and anything else, metres.
    """

    outcome: Outcome
    steps: int = Field(ge=0, le=2**31 - 1)
    reward: Figure
    path_length: Figure
    shortest_path: Figure
    min_clearance: Figure

    def path_efficiency(self, arrival_distance: float) -> float:
        """Shortest path over the driven one, 0 to 1; both end at the arrival circle. Of arrivals, its mean is their SPL.

        SPL is success weighted by path length (Anderson et al. 2018, 'On Evaluation of Embodied Navigation Agents').

        Args:
            arrival_distance: of the task, metres: nobody drives the last bit to the target's middle.
        """
        shortest = max(self.shortest_path - arrival_distance, 0.0)
        return shortest / max(self.path_length, shortest, 1e-9)


class EvaluationResult(Frozen):
    """A policy on a suite: one row per episode, in the suite's order."""

    suite: str = Field(min_length=1, max_length=64, pattern=r"^[^\x00-\x1f\x7f]+$")
    suite_hash: str = Field(min_length=1, max_length=64, pattern=r"^[!-~]+$")
    episodes: tuple[EpisodeResult, ...] = Field(min_length=1)

    @property
    def success_rate(self) -> float:
        """Arrivals over episodes, 0 to 1."""
        return sum(episode.outcome == "arrival" for episode in self.episodes) / len(self.episodes)


class Reporter(Protocol):
    """Where a training reports. Calls return at once; what they carry is kept until it has arrived."""

    def metrics(self, step: int, values: Mapping[str, float]) -> None:
        """Numbers at an environment step, under their standard names; steps only grow."""

    def event(self, step: int, level: EventLevel, message: str) -> None:
        """One line for the run's event log."""

    def checkpoint(self, step: int, archive: Path, evaluation: EvaluationResult | None) -> None:
        """A checkpoint archive that is complete on disk; `evaluation` belongs to exactly these weights."""

    def frames(self, frames: Sequence[Frame]) -> None:
        """Moments for whoever watches, oldest first; only what is newest need arrive, and nothing is kept."""

    @property
    def watch(self) -> WatchRequest | None:
        """What somebody wants to see now; None while nobody watches, and then no frame is made."""

    @property
    def stop_requested(self) -> bool:
        """True once the training should write a checkpoint and return."""

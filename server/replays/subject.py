"""Whose episodes are replayed, and what was recorded of them."""

from dataclasses import dataclass

from sim.config import TaskConfig
from workers.job_protocol import ArchivedPolicy
from workers.reporting import EvaluationResult


@dataclass(frozen=True)
class Subject:
    """A policy on a suite.

    Attributes:
        title: of the policy, for people.
        file_name: of its archive, for a browser.
        task: robot, LiDAR and limits; the arenas are the suite's.
        sha256: of its archive.
        suite: by name, where it is not that of its own task.
        recorded: how its episodes ended when they counted.
        policy: where a worker gets it from.
    """

    title: str
    file_name: str
    task: TaskConfig
    sha256: str
    suite: str | None
    recorded: EvaluationResult
    policy: ArchivedPolicy

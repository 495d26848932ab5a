"""Whose episodes are replayed, and what was recorded of them."""

import hashlib
from dataclasses import dataclass

from sim.config import TaskConfig
from workers.job_protocol import AnyPolicy, SuiteChoice
from workers.reporting import EvaluationResult


@dataclass(frozen=True)
class Subject:
    """A policy on a suite.

    Attributes:
        title: of the policy, for people.
        file_name: of its archive, for a browser.
        task: robot, LiDAR and limits; the arenas are the suite's.
        sha256: of its archive; None for a baseline.
        suite: which one, as a worker finds it.
        recorded: how its episodes ended when they counted.
        policy: where a worker gets it from.
        step: of its training; 0 where that is not a checkpoint's.
    """

    title: str
    file_name: str
    task: TaskConfig
    sha256: str | None
    suite: SuiteChoice
    recorded: EvaluationResult
    policy: AnyPolicy
    step: int = 0

    @property
    def identity(self) -> str:
        """Hexadecimal digits of what drives: an archive's bytes, or a baseline's name and robot."""
        return self.sha256 or hashlib.sha256(self.policy.model_dump_json().encode()).hexdigest()

"""What is measured: a policy's name for people, its archive's hash, and its task."""

from dataclasses import dataclass

from sqlalchemy.orm import Session

from server.checkpoints.repository import CheckpointRepository
from server.experiments.stored import training_of
from server.policies.service import find, shipped_hash
from server.runs.repository import RunRepository
from sim.config import TaskConfig
from workers.job_protocol import AnyPolicy, BaselineName, CheckpointPolicy


@dataclass(frozen=True)
class Measured:
    """A policy or a baseline.

    Attributes:
        title: for people.
        sha256: of its archive; None for a baseline.
        task: robot, LiDAR and limits.
    """

    title: str
    sha256: str | None
    task: TaskConfig


def measured(session: Session, policy: AnyPolicy) -> Measured:
    """What is known of a policy.

    Raises:
        NotFoundError: there is no such policy.
    """
    if isinstance(policy, BaselineName):
        return Measured(policy.name, None, policy.task)
    if isinstance(policy, CheckpointPolicy):
        checkpoint = CheckpointRepository(session).get(policy.id)
        run = RunRepository(session).get(checkpoint.run_id)
        title = f"{run.experiment.name}, seed {run.seed}, step {checkpoint.step:,}"
        return Measured(title, checkpoint.sha256, training_of(run.experiment).task)
    shipped = find(policy.name)
    return Measured(shipped.card.title, shipped_hash(policy.name), shipped.card.training.task)

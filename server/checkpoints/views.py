"""Checkpoints' rows as JSON shows them."""

from collections import Counter
from collections.abc import Sequence
from typing import Protocol

from server.checkpoints.schemas import Checkpoint, Evaluation
from server.database import tables
from server.estimates import success_estimate
from server.schemas import Estimate
from workers.wording import counted


class Evaluated(Protocol):
    """What an evaluation says of success."""

    @property
    def suite_hash(self) -> str:
        """Of the suite."""

    @property
    def arrivals(self) -> int:
        """Episodes that arrived."""

    @property
    def episode_count(self) -> int:
        """Episodes in all."""


def success_over_runs(evaluations: Sequence[Evaluated]) -> Estimate | None:
    """Success rate over runs, one evaluation each, of those on the suite that most of them were measured on."""
    if not evaluations:
        return None
    (suite_hash, _), *_ = Counter(evaluation.suite_hash for evaluation in evaluations).most_common(1)
    alike = [evaluation for evaluation in evaluations if evaluation.suite_hash == suite_hash]
    return success_estimate(
        [evaluation.arrivals for evaluation in alike], [evaluation.episode_count for evaluation in alike]
    )


def policy_title(run: tables.Run, checkpoint: tables.Checkpoint) -> str:
    """What a checkpoint's policy is called where it stands alone."""
    return f"{run.experiment.name}, seed {run.seed}, step {counted(checkpoint.step)}"


def evaluation_view(evaluation: tables.Evaluation) -> Evaluation:
    """A checkpoint's evaluation in JSON."""
    return Evaluation(
        suite=evaluation.suite,
        suite_hash=evaluation.suite_hash,
        episodes=evaluation.episode_count,
        arrivals=evaluation.arrivals,
        success=success_estimate([evaluation.arrivals], [evaluation.episode_count]),
        steps_mean=evaluation.steps_mean,
        reward_mean=evaluation.reward_mean,
    )


def checkpoint_view(checkpoint: tables.Checkpoint, evaluation: tables.Evaluation | None, *, best: bool) -> Checkpoint:
    """A checkpoint in JSON."""
    return Checkpoint(
        id=checkpoint.id,
        step=checkpoint.step,
        size=checkpoint.size,
        sha256=checkpoint.sha256,
        created_at=checkpoint.created_at,
        damaged=checkpoint.damaged_at is not None,
        goes_at=checkpoint.goes_at,
        best=best,
        evaluation=evaluation_view(evaluation) if evaluation else None,
    )

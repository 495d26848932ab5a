"""Checkpoints' rows as JSON shows them."""

from collections import Counter
from collections.abc import Sequence

from server import statistics
from server.checkpoints.schemas import Checkpoint, Evaluation
from server.database import tables
from server.schemas import Estimate


def estimate(interval: statistics.Interval, *, seeds: int, episodes: int) -> Estimate:
    """An interval with what stands behind it."""
    return Estimate(value=interval.value, low=interval.low, high=interval.high, seeds=seeds, episodes=episodes)


def success_over_runs(evaluations: Sequence[tables.Evaluation]) -> Estimate | None:
    """Success rate over runs, one evaluation each, of those on the suite that most of them were measured on."""
    if not evaluations:
        return None
    (suite_hash, _), *_ = Counter(evaluation.suite_hash for evaluation in evaluations).most_common(1)
    alike = [evaluation for evaluation in evaluations if evaluation.suite_hash == suite_hash]
    counts = [evaluation.episode_count for evaluation in alike]
    interval = statistics.success_rate([evaluation.arrivals for evaluation in alike], counts)
    return estimate(interval, seeds=len(alike), episodes=sum(counts))


def evaluation_view(evaluation: tables.Evaluation) -> Evaluation:
    """A checkpoint's evaluation in JSON."""
    interval = statistics.wilson_interval(evaluation.arrivals, evaluation.episode_count)
    return Evaluation(
        suite=evaluation.suite,
        suite_hash=evaluation.suite_hash,
        episodes=evaluation.episode_count,
        arrivals=evaluation.arrivals,
        success=estimate(interval, seeds=1, episodes=evaluation.episode_count),
        steps_mean=evaluation.steps_mean,
        reward_mean=evaluation.reward_mean,
    )


def checkpoint_views(rows: Sequence[tuple[tables.Checkpoint, tables.Evaluation | None]]) -> list[Checkpoint]:
    """A run's checkpoints in JSON, the best marked."""
    best = _best_evaluated(rows)
    return [
        Checkpoint(
            id=checkpoint.id,
            step=checkpoint.step,
            size=checkpoint.size,
            sha256=checkpoint.sha256,
            created_at=checkpoint.created_at,
            damaged=checkpoint.damaged_at is not None,
            best=checkpoint.id == best,
            evaluation=evaluation_view(evaluation) if evaluation else None,
        )
        for checkpoint, evaluation in rows
    ]


def best_checkpoint(rows: Sequence[tuple[tables.Checkpoint, tables.Evaluation | None]]) -> str | None:
    """The id of a run's best whole checkpoint; of its last where none was evaluated, None where there is none."""
    whole = [checkpoint.id for checkpoint, _ in rows if checkpoint.damaged_at is None]
    return _best_evaluated(rows) or (whole[-1] if whole else None)


def _best_evaluated(rows: Sequence[tuple[tables.Checkpoint, tables.Evaluation | None]]) -> str | None:
    """The id with the highest success rate; of equal ones that with the fewest steps to the target, then the newest."""

    def merit(row: tuple[tables.Checkpoint, tables.Evaluation]) -> tuple[float, float, int]:
        checkpoint, evaluation = row
        steps = evaluation.steps_mean if evaluation.steps_mean is not None else float("inf")
        return evaluation.arrivals / evaluation.episode_count, -steps, checkpoint.step

    evaluated = [
        (checkpoint, evaluation)
        for checkpoint, evaluation in rows
        if evaluation is not None and checkpoint.damaged_at is None
    ]
    return max(evaluated, key=merit)[0].id if evaluated else None

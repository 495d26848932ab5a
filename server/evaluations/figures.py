"""An evaluation's figures, from what a worker has measured."""

from collections.abc import Sequence

from server.estimates import success_estimate
from server.evaluations.schemas import EvaluationFigures, TermReturn
from sim.config import TaskConfig
from workers.job_protocol import Measurement
from workers.reporting import EpisodeResult
from workers.shipped.figures import figures as usual_figures
from workers.shipped.figures import worst_tenth


def figures_of(measurement: Measurement, *, trained: bool) -> EvaluationFigures:
    """The figures of one policy on one suite.

    Args:
        measurement: what a worker has brought.
        trained: whether another seed could have failed, as none of a baseline can.
    """
    episodes, task = measurement.result.episodes, measurement.task
    usual = usual_figures(episodes, task.arrival_distance)
    arrived = [episode for episode in episodes if episode.outcome == "arrival"]
    return EvaluationFigures(
        episodes=usual.episodes,
        success=success_estimate([usual.arrivals], [usual.episodes], trained=trained),
        collision=usual.collision,
        timeout=usual.timeout,
        spl=usual.spl,
        worst_tenth_spl=worst_tenth(merits(episodes, task)),
        steps=usual.steps,
        seconds=None if usual.steps is None else usual.steps * task.control_period,
        path_length=sum(episode.path_length for episode in arrived) / len(arrived) if arrived else None,
        min_clearance=usual.min_clearance,
        jerk=sum(measurement.jerks) / len(measurement.jerks),
        reward=sum(episode.reward for episode in episodes) / len(episodes),
        terms=[
            TermReturn(name=name, value=sum(row[column] for row in measurement.returns) / len(episodes))
            for column, name in enumerate(measurement.terms)
        ]
        or None,
    )


def merits(episodes: Sequence[EpisodeResult], task: TaskConfig) -> list[float]:
    """What each episode counts in the SPL, 0 to 1."""
    return [episode.path_efficiency(task.arrival_distance) if episode.outcome == "arrival" else 0.0 for episode in episodes]

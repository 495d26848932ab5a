"""An experiment's final figures: of its runs' last evaluations, seed by seed and scenario by scenario."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from server.checkpoints.repository import decode_episodes
from server.comparison.schemas import ComparedExperiment
from server.database import tables
from server.estimates import mean_estimate, success_estimate
from server.experiments.stored import read_training
from workers.reporting import EpisodeResult
from workers.statistics.intervals import Floats


@dataclass(frozen=True)
class SeedEpisodes:
    """The last evaluation of one seed, an entry for each scenario in the suite's order.

    Attributes:
        arrived: 1 where the robot arrived, else 0.
        steps: control steps to the target; nan where it did not arrive.
        reward: summed.
        score: path efficiency of an arrival, 0 to 1, else 0: its mean is the SPL.
    """

    arrived: Floats
    steps: Floats
    reward: Floats
    score: Floats

    @classmethod
    def of(cls, episodes: Sequence[EpisodeResult], arrival_distance: float) -> "SeedEpisodes":
        """Of episodes as they are stored."""
        told = [(one.outcome == "arrival", one.steps, one.reward, one.path_efficiency(arrival_distance)) for one in episodes]
        arrived, steps, reward, efficiency = np.array(told, np.float64).T
        return cls(arrived, np.where(arrived, steps, np.nan), reward, np.where(arrived, efficiency, 0.0))


@dataclass(frozen=True)
class FinalFigures:
    """What the last evaluations of an experiment's runs say, all on one suite.

    Attributes:
        id, name: of the experiment.
        suite, suite_hash: None before the first evaluation.
        driven: of each seed.
    """

    id: str
    name: str
    suite: str | None
    suite_hash: str | None
    driven: Sequence[SeedEpisodes]

    @property
    def seeds(self) -> int:
        """Runs that were evaluated on the suite."""
        return len(self.driven)

    @cached_property
    def arrivals(self) -> list[int]:
        """Of each seed."""
        return [int(seed.arrived.sum()) for seed in self.driven]

    @cached_property
    def episodes(self) -> list[int]:
        """Of each seed."""
        return [seed.arrived.size for seed in self.driven]

    @cached_property
    def steps(self) -> list[Floats]:
        """Control steps of each arrival, of each seed."""
        return [seed.steps[np.isfinite(seed.steps)] for seed in self.driven]

    def view(self) -> ComparedExperiment:
        """In JSON."""
        return ComparedExperiment(
            id=self.id,
            name=self.name,
            seeds=self.seeds,
            episodes=sum(self.episodes),
            suite=self.suite,
            suite_hash=self.suite_hash,
            success=success_estimate(self.arrivals, self.episodes) if self.seeds else None,
            steps_per_target=mean_estimate(self.steps, least=0.0),
            reward=mean_estimate([seed.reward for seed in self.driven]),
        )


def final_figures(experiment: tables.Experiment, final: dict[str, tables.Evaluation]) -> FinalFigures:
    """The figures of an experiment whose runs have these last evaluations, by run."""
    evaluations = _alike([final[run.id] for run in experiment.runs if run.id in final])
    arrival_distance = read_training(experiment.training).training.task.arrival_distance if evaluations else 0.0
    return FinalFigures(
        id=experiment.id,
        name=experiment.name,
        suite=evaluations[0].suite if evaluations else None,
        suite_hash=evaluations[0].suite_hash if evaluations else None,
        driven=[SeedEpisodes.of(decode_episodes(evaluation), arrival_distance) for evaluation in evaluations],
    )


def _alike(final: Sequence[tables.Evaluation]) -> list[tables.Evaluation]:
    """Those on the suite that most of the runs were measured on: others can't be counted together with them."""
    if not final:
        return []
    (suite_hash, _), *_ = Counter(evaluation.suite_hash for evaluation in final).most_common(1)
    return [evaluation for evaluation in final if evaluation.suite_hash == suite_hash]

"""An experiment's final figures: of its runs' last evaluations, seed by seed."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from server.checkpoints.repository import decode_episodes
from server.comparison.schemas import ComparedExperiment
from server.database import tables
from server.estimates import mean_estimate, success_estimate


@dataclass(frozen=True)
class FinalFigures:
    """What the last evaluations of an experiment's runs say, all on one suite.

    Attributes:
        id, name: of the experiment.
        suite, suite_hash: None before the first evaluation.
        arrivals, episodes: of each seed.
        steps: control steps of each arrival, of each seed.
        rewards: summed, of each episode, of each seed.
    """

    id: str
    name: str
    suite: str | None
    suite_hash: str | None
    arrivals: Sequence[int]
    episodes: Sequence[int]
    steps: Sequence[NDArray[np.float64]]
    rewards: Sequence[NDArray[np.float64]]

    @property
    def seeds(self) -> int:
        """Runs that were evaluated on the suite."""
        return len(self.episodes)

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
            steps_per_target=mean_estimate(self.steps),
            reward=mean_estimate(self.rewards),
        )


def final_figures(experiment: tables.Experiment, final: dict[str, tables.Evaluation]) -> FinalFigures:
    """The figures of an experiment whose runs have these last evaluations, by run."""
    evaluations = _alike([final[run.id] for run in experiment.runs if run.id in final])
    driven = [decode_episodes(evaluation) for evaluation in evaluations]
    return FinalFigures(
        id=experiment.id,
        name=experiment.name,
        suite=evaluations[0].suite if evaluations else None,
        suite_hash=evaluations[0].suite_hash if evaluations else None,
        arrivals=[evaluation.arrivals for evaluation in evaluations],
        episodes=[len(episodes) for episodes in driven],
        steps=[np.array([float(e.steps) for e in episodes if e.outcome == "arrival"]) for episodes in driven],
        rewards=[np.array([e.reward for e in episodes]) for episodes in driven],
    )


def _alike(final: Sequence[tables.Evaluation]) -> list[tables.Evaluation]:
    """Those on the suite that most of the runs were measured on: others can't be counted together with them."""
    if not final:
        return []
    (suite_hash, _), *_ = Counter(evaluation.suite_hash for evaluation in final).most_common(1)
    return [evaluation for evaluation in final if evaluation.suite_hash == suite_hash]

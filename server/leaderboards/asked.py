"""Evaluations that people asked for, put together: the seeds of one training on one suite are one entry."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from server.database import tables
from server.estimates import success_estimate
from server.evaluations.schemas import EvaluationFigures
from server.leaderboards.means import mean_of
from server.leaderboards.repository import Seed
from server.schemas import Estimate


@dataclass(frozen=True)
class AskedTogether:
    """A policy, or a training by one checkpoint of each of its seeds, on a suite.

    Attributes:
        rows: one a seed, in the seeds' order; of what has no seeds a single one.
        training: id and name of the training that they are of; None for what is none's.
    """

    rows: tuple[tables.PolicyEvaluation, ...]
    training: tuple[str, str] | None

    @cached_property
    def figures(self) -> list[EvaluationFigures]:
        """Of each row."""
        return [EvaluationFigures.model_validate(row.figures) for row in self.rows]

    @property
    def title(self) -> str:
        """A training's name where several of its seeds were measured, else what the policy is called."""
        return self.training[1] if self.training and len(self.rows) > 1 else self.rows[0].title

    @property
    def trained(self) -> bool:
        """Whether another seed could do otherwise, as none of a baseline can."""
        return bool(self.rows[0].policy["source"] != "baseline")

    @property
    def episodes(self) -> list[int]:
        """Of each seed."""
        return [each.episodes for each in self.figures]

    @property
    def arrivals(self) -> list[int]:
        """Of each seed."""
        return [round(each.success.value * each.episodes) for each in self.figures]

    @property
    def success(self) -> Estimate:
        """Over its seeds, or over the episodes of the only policy."""
        return success_estimate(self.arrivals, self.episodes, trained=self.trained)

    @property
    def spl(self) -> float | None:
        """Mean over its seeds."""
        return mean_of([each.spl for each in self.figures])

    @property
    def steps(self) -> float | None:
        """Mean over the seeds of which any episode arrived."""
        return mean_of([each.steps for each in self.figures])


def together(rows: Sequence[tables.PolicyEvaluation], seeds: Mapping[str, Seed]) -> list[AskedTogether]:
    """The evaluations on one suite, those of a training's seeds put together.

    Where several checkpoints of a run were measured the one that was asked for last stands for it, whatever it achieved:
    the best of several is the luckiest too.

    Args:
        rows: the newest first.
        seeds: by checkpoint.
    """
    alone: list[AskedTogether] = []
    trainings: dict[str, dict[str, tuple[Seed, tables.PolicyEvaluation]]] = {}
    for row in rows:
        seed = seeds.get(row.checkpoint_id or "")
        if seed is None:
            alone.append(AskedTogether((row,), None))
        else:
            trainings.setdefault(seed.experiment_id, {}).setdefault(seed.run_id, (seed, row))
    found = []
    for experiment_id, runs in trainings.items():
        each = sorted(runs.values(), key=lambda one: one[0].seed)
        found.append(AskedTogether(tuple(row for _, row in each), (experiment_id, each[0][0].experiment)))
    return found + alone

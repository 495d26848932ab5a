"""What is compared, read once for all that a page asks of it: experiments, their runs and their last evaluations."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

from server.checkpoints.repository import CheckpointRepository
from server.comparison.figures import FinalFigures, final_figures
from server.database import tables
from server.database.engine import Database
from server.experiments.repository import ExperimentRepository
from server.experiments.told import state_of

MADE_OF = ("experiments", "runs", "checkpoints", "evaluations")
"""The tables that it is read from: as long as none of them is written, it is the same."""

KEPT = 8
"""So many comparisons are kept: those of the pages that are being opened."""


@dataclass(frozen=True, eq=False)
class Compared:
    """Experiments as they were at a moment. Shared between requests: nothing of it may be changed.

    Attributes:
        experiments: with their runs, in the order asked for.
        state: a digest of what an answer about them depends on.
    """

    experiments: Sequence[tables.Experiment]
    state: str
    _database: Database
    _final: Mapping[str, tables.Evaluation]

    @property
    def run_ids(self) -> list[str]:
        """Of all of them, in order."""
        return [run.id for experiment in self.experiments for run in experiment.runs]

    @cached_property
    def episodes(self) -> Mapping[str, int]:
        """How many are behind the last evaluation of each run that has one."""
        return {run_id: evaluation.episode_count for run_id, evaluation in self._final.items()}

    @cached_property
    def figures(self) -> Sequence[FinalFigures]:
        """The final figures of each, in order."""
        with self._database.read() as session:
            final = CheckpointRepository(session).final_evaluations(self.run_ids, with_episodes=True)
        return [final_figures(experiment, final) for experiment in self.experiments]


def read_compared(database: Database, experiment_ids: Sequence[str]) -> Compared:
    """Read them as they are now.

    Raises:
        NotFoundError: one of the experiments is missing.
    """
    with database.read() as session:
        experiments = ExperimentRepository(session).get_many(experiment_ids)
        run_ids = [run.id for experiment in experiments for run in experiment.runs]
        final = CheckpointRepository(session).final_evaluations(run_ids)
        # As a digest: it is asked for once a request, and is made of hundreds of values.
        state = hashlib.sha256(repr(state_of(session, experiments)).encode()).hexdigest()
        return Compared(experiments, state, database, final)

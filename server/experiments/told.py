"""What every answer about some experiments depends on, beside the points of their curves' later values."""

from collections.abc import Sequence

from sqlalchemy import inspect
from sqlalchemy.orm import Session

from server.checkpoints.repository import CheckpointRepository
from server.database import tables


def state_of(session: Session, experiments: Sequence[tables.Experiment]) -> tuple[object, ...]:
    """As long as it is the same, so are these experiments, their runs, their curves and their evaluations.

    Reports move a run's last number and step, so that no curve need be read.
    """
    return state_of_runs(session, experiments, [run for experiment in experiments for run in experiment.runs])


def state_of_runs(
    session: Session, experiments: Sequence[tables.Experiment], runs: Sequence[tables.Run]
) -> tuple[object, ...]:
    """The same of some of their runs."""
    evaluated = CheckpointRepository(session).evaluated([run.id for run in runs])
    return [_columns(each) for each in experiments], [_columns(each) for each in runs], evaluated


def _columns(row: tables.Base) -> list[object]:
    return [getattr(row, column.key) for column in inspect(type(row)).column_attrs]

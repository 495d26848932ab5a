"""What the checkpoints of an experiment take together, kept beside it: lists of many experiments add nothing up."""

from sqlalchemy import update
from sqlalchemy.orm import Session

from server.database import tables


def add_to_sums(
    session: Session,
    experiment_id: str,
    *,
    checkpoint_count: int = 0,
    checkpoint_bytes: int = 0,
    going_count: int = 0,
    going_bytes: int = 0,
) -> None:
    """Change the sums of an experiment by so much, in the transaction that changes its checkpoints.

    Args:
        session: the transaction.
        experiment_id: of the experiment.
        checkpoint_count: of its checkpoints.
        checkpoint_bytes: of their archives.
        going_count: of those that a rule has taken.
        going_bytes: of their archives.
    """
    session.flush()
    experiment = tables.Experiment
    # By the database, not by what was read: two runs of it may get checkpoints at once.
    changed = update(experiment).where(experiment.id == experiment_id).execution_options(synchronize_session=False)
    session.execute(
        changed.values(
            checkpoint_count=experiment.checkpoint_count + checkpoint_count,
            checkpoint_bytes=experiment.checkpoint_bytes + checkpoint_bytes,
            going_count=experiment.going_count + going_count,
            going_bytes=experiment.going_bytes + going_bytes,
        )
    )

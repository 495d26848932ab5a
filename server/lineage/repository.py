"""Where trainings begin, in SQL: a training's settings, key by key, say which checkpoint it began with."""

from collections.abc import Collection, Sequence

from sqlalchemy import func, select, true
from sqlalchemy.orm import Session, joinedload

from server.database import tables


class LineageRepository:
    """Reads within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def checkpoint(self, checkpoint_id: str) -> tuple[tables.Checkpoint, tables.Run] | None:
        """A checkpoint and its run with the experiment, unless that was deleted."""
        query = (
            select(tables.Checkpoint, tables.Run)
            .join(tables.Run, tables.Run.id == tables.Checkpoint.run_id)
            .join(tables.Run.experiment)
            .where(tables.Checkpoint.id == checkpoint_id, tables.Experiment.deleted_at.is_(None))
            .options(joinedload(tables.Run.experiment))
        )
        row = self._session.execute(query).first()
        return (row[0], row[1]) if row else None

    def children(
        self, run_ids: Collection[str], visible: Collection[str] | None, limit: int
    ) -> list[tuple[tables.Experiment, int, int]]:
        """Experiments of `visible` projects (None: all) that began with a checkpoint of these runs, with seed and step."""
        key = tables.ExperimentKey
        query = (
            select(tables.Experiment, tables.Run.seed, tables.Checkpoint.step)
            .join(key, key.experiment_id == tables.Experiment.id)
            .join(tables.Checkpoint, tables.Checkpoint.id == key.text)
            .join(tables.Run, tables.Run.id == tables.Checkpoint.run_id)
            .where(
                key.key == tables.START_KEY,
                tables.Run.id.in_(run_ids),
                tables.Experiment.deleted_at.is_(None),
                tables.Experiment.project_id.in_(visible) if visible is not None else true(),
            )
            .order_by(tables.Experiment.created_at.desc(), tables.Experiment.id)
            .limit(limit)
        )
        return [(row[0], row[1], row[2]) for row in self._session.execute(query)]

    def runs_with_checkpoints(self, part: str, visible: Collection[str] | None, limit: int) -> Sequence[tables.Run]:
        """Runs that have a whole checkpoint, of experiments whose name contains `part` in any case, the newest first."""
        kept = select(tables.Checkpoint.id).where(
            tables.Checkpoint.run_id == tables.Run.id, tables.Checkpoint.damaged_at.is_(None)
        )
        query = (
            select(tables.Run)
            .join(tables.Run.experiment)
            .where(
                kept.exists(),
                tables.Experiment.deleted_at.is_(None),
                func.lower(tables.Experiment.name).contains(part.lower(), autoescape=True),
                tables.Experiment.project_id.in_(visible) if visible is not None else true(),
            )
            .options(joinedload(tables.Run.experiment))
            .order_by(tables.Experiment.created_at.desc(), tables.Run.seed)
            .limit(limit)
        )
        return self._session.scalars(query).all()

"""What a project's archive is made of, and what it becomes, in SQL."""

from collections.abc import Sequence

from sqlalchemy import select
from sqlalchemy.orm import Session

from server.database import tables


class ProjectArchiveRepository:
    """Reads within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def experiments(self, project_id: str) -> Sequence[str]:
        """The ids of a project's experiments that are not in the trash, the oldest first."""
        row = tables.Experiment
        query = select(row.id).where(row.project_id == project_id, row.deleted_at.is_(None))
        return self._session.scalars(query.order_by(row.created_at, row.id)).all()

    def studies(self, project_id: str) -> Sequence[str]:
        """The ids of a project's studies, the oldest first."""
        row = tables.Study
        return self._session.scalars(
            select(row.id).where(row.project_id == project_id).order_by(row.created_at, row.id)
        ).all()

    def trials(self, study_id: str) -> Sequence[tables.StudyTrial]:
        """A study's trials, by number."""
        row = tables.StudyTrial
        return self._session.scalars(select(row).where(row.study_id == study_id).order_by(row.number)).all()

    def runs(self, experiment_id: str) -> Sequence[str]:
        """The ids of an experiment's runs, by seed."""
        query = select(tables.Run.id).where(tables.Run.experiment_id == experiment_id)
        return self._session.scalars(query.order_by(tables.Run.seed, tables.Run.id)).all()

    def checkpoints(self, run_id: str) -> Sequence[tables.Checkpoint]:
        """A run's whole checkpoints, the first one first."""
        row = tables.Checkpoint
        query = select(row).where(row.run_id == run_id, row.damaged_at.is_(None))
        return self._session.scalars(query.order_by(row.step, row.created_at)).all()

    def evaluated(self, run_id: str) -> set[str]:
        """The ids of a run's checkpoints that were evaluated."""
        query = select(tables.Evaluation.checkpoint_id).join(tables.Checkpoint)
        return set(self._session.scalars(query.where(tables.Checkpoint.run_id == run_id)))

    def taken(self, archive_ids: Sequence[str]) -> set[str]:
        """Those of the ids under which the store has, or is about to have, an archive."""
        found: set[str] = set()
        for start in range(0, len(archive_ids), 500):
            some = archive_ids[start : start + 500]
            for table in (tables.Checkpoint, tables.LooseArchive):
                found.update(self._session.scalars(select(table.id).where(table.id.in_(some))))
        return found

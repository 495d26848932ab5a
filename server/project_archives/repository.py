"""What a project's archive is made of, and what it becomes, in SQL."""

from collections.abc import Sequence

from sqlalchemy import and_, or_, select
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

    def arenas(self, project_id: str) -> set[str]:
        """The hashes of the imported arenas that the project's experiments train on."""
        row = tables.Experiment
        used = row.training["task"]["arena"]["sha256"].as_string()
        query = select(used).where(row.project_id == project_id, row.deleted_at.is_(None), used.is_not(None))
        return {sha256 for sha256 in self._session.scalars(query.distinct()) if sha256}

    def policies(self, project_id: str) -> Sequence[str]:
        """The ids of the policies that were uploaded into a project, the oldest first."""
        row = tables.UploadedPolicy
        return self._session.scalars(
            select(row.id).where(row.project_id == project_id).order_by(row.created_at, row.id)
        ).all()

    def recordings(self, project_id: str) -> Sequence[str]:
        """The ids of a project's recordings of robots, the oldest first."""
        row = tables.Bag
        return self._session.scalars(
            select(row.id).where(row.project_id == project_id).order_by(row.created_at, row.id)
        ).all()

    def evaluations(self, project_id: str) -> Sequence[str]:
        """The ids of the evaluations that stand beside one another in a project, the oldest first.

        Those of its whole checkpoints and uploads, and those of shipped policies and baselines, which are everybody's.
        """
        row, experiment = tables.PolicyEvaluation, tables.Experiment
        trained = (
            select(tables.Checkpoint.id)
            .join(tables.Run, tables.Run.id == tables.Checkpoint.run_id)
            .join(experiment, experiment.id == tables.Run.experiment_id)
            .where(experiment.project_id == project_id, experiment.deleted_at.is_(None))
            .where(tables.Checkpoint.damaged_at.is_(None))
        )
        uploaded = select(tables.UploadedPolicy.id).where(tables.UploadedPolicy.project_id == project_id)
        everybodys = and_(row.checkpoint_id.is_(None), row.upload_id.is_(None))
        query = select(row.id).where(or_(row.checkpoint_id.in_(trained), row.upload_id.in_(uploaded), everybodys))
        return self._session.scalars(query.order_by(row.created_at, row.id)).all()

    def has_policy(self, project_id: str, policy_id: str, *, of_checkpoint: bool) -> bool:
        """Whether the checkpoint, or the uploaded policy, of that id is the project's."""
        if not of_checkpoint:
            uploaded = self._session.get(tables.UploadedPolicy, policy_id)
            return uploaded is not None and uploaded.project_id == project_id
        checkpoint = self._session.get(tables.Checkpoint, policy_id)
        run = self._session.get(tables.Run, checkpoint.run_id) if checkpoint is not None else None
        return run is not None and run.experiment.project_id == project_id

    def taken(self, archive_ids: Sequence[str]) -> set[str]:
        """Those of the ids under which the store has, or is about to have, an archive."""
        found: set[str] = set()
        for start in range(0, len(archive_ids), 500):
            some = archive_ids[start : start + 500]
            for table in (tables.Checkpoint, tables.LooseArchive):
                found.update(self._session.scalars(select(table.id).where(table.id.in_(some))))
        return found

"""Projects in SQL."""

from collections.abc import Collection
from typing import Any

from sqlalchemy import Select, func, select, true
from sqlalchemy.orm import Session

from server.database import tables
from server.errors import NotFoundError
from server.http.paging import Window


class ProjectRepository:
    """Reads and writes projects within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def add(self, project: tables.Project) -> None:
        """Add a project."""
        self._session.add(project)

    def get(self, project_id: str) -> tables.Project:
        """The project.

        Raises:
            NotFoundError: there is none.
        """
        project = self._session.get(tables.Project, project_id)
        if project is None:
            raise NotFoundError.of("project", project_id)
        return project

    def named(self, name: str) -> tables.Project | None:
        """The project of that name, in any case."""
        return self._session.scalar(select(tables.Project).where(func.lower(tables.Project.name) == name.lower()))

    def page(self, window: Window, visible: Collection[str] | None = None) -> tuple[list[tuple[tables.Project, int]], int]:
        """The `visible` projects (None: all) by name, each with the number of its experiments; how many there are."""
        seen = tables.Project.id.in_(visible) if visible is not None else true()
        total = self._session.scalar(select(func.count()).select_from(tables.Project).where(seen)) or 0
        query = (
            select(tables.Project)
            .where(seen)
            .order_by(func.lower(tables.Project.name), tables.Project.id)
            .limit(window.limit)
            .offset(window.offset)
        )
        found = self._session.scalars(query).all()
        counted = self.experiments([project.id for project in found])
        return [(project, counted.get(project.id, 0)) for project in found], total

    def experiments(self, project_ids: list[str]) -> dict[str, int]:
        """How many experiments are in each of the projects; one without any is absent."""
        query = (
            select(tables.Experiment.project_id, func.count())
            .where(tables.Experiment.project_id.in_(project_ids))
            .group_by(tables.Experiment.project_id)
        )
        return {row[0]: row[1] for row in self._session.execute(query)}

    def of_projects(self, project_ids: Collection[str]) -> dict[str, set[str]]:
        """Each project that there is, as its own."""
        row = tables.Project
        return self._grouped(select(row.id, row.id.label("own")).where(row.id.in_(project_ids)))

    def of_experiments(self, experiment_ids: Collection[str]) -> dict[str, set[str]]:
        """The project of each of the experiments that there are, as a set."""
        row = tables.Experiment
        return self._grouped(select(row.id, row.project_id).where(row.id.in_(experiment_ids)))

    def of_runs(self, run_ids: Collection[str]) -> dict[str, set[str]]:
        """The project of each of the runs that there are, as a set."""
        query = select(tables.Run.id, tables.Experiment.project_id).join(tables.Experiment)
        return self._grouped(query.where(tables.Run.id.in_(run_ids)))

    def of_checkpoints(self, checkpoint_ids: Collection[str]) -> dict[str, set[str]]:
        """The project of each of the checkpoints that there are, as a set."""
        query = select(tables.Checkpoint.id, tables.Experiment.project_id)
        query = query.join(tables.Run, tables.Run.id == tables.Checkpoint.run_id).join(tables.Experiment)
        return self._grouped(query.where(tables.Checkpoint.id.in_(checkpoint_ids)))

    def of_campaigns(self, campaign_ids: Collection[str]) -> dict[str, set[str]]:
        """The projects of each of the campaigns that there are: their experiments may have been moved."""
        row = tables.Experiment
        return self._grouped(select(row.campaign, row.project_id).where(row.campaign.in_(campaign_ids)).distinct())

    def of_uploads(self, upload_ids: Collection[str]) -> dict[str, set[str]]:
        """The project of each of the uploaded policies that there are, as a set."""
        row = tables.UploadedPolicy
        return self._grouped(select(row.id, row.project_id).where(row.id.in_(upload_ids)))

    def of_bags(self, bag_ids: Collection[str]) -> dict[str, set[str]]:
        """The project of each of the robots' recordings that there are, as a set."""
        row = tables.Bag
        return self._grouped(select(row.id, row.project_id).where(row.id.in_(bag_ids)))

    def of_studies(self, study_ids: Collection[str]) -> dict[str, set[str]]:
        """The project of each of the studies that there are, as a set."""
        row = tables.Study
        return self._grouped(select(row.id, row.project_id).where(row.id.in_(study_ids)))

    def of_evaluations(self, evaluation_ids: Collection[str]) -> dict[str, set[str]]:
        """The project of each of the evaluations that there are; none where its policy is everybody's.

        That of a checkpoint or an upload that was deleted is in a project that nobody is in.
        """
        row = tables.PolicyEvaluation
        upload = tables.UploadedPolicy
        owner = func.coalesce(tables.Experiment.project_id, upload.project_id)
        query = select(row.id, func.coalesce(row.checkpoint_id, row.upload_id), owner).where(row.id.in_(evaluation_ids))
        query = query.outerjoin(upload, upload.id == row.upload_id)
        query = query.outerjoin(tables.Checkpoint, tables.Checkpoint.id == row.checkpoint_id)
        query = query.outerjoin(tables.Run, tables.Run.id == tables.Checkpoint.run_id)
        query = query.outerjoin(tables.Experiment, tables.Experiment.id == tables.Run.experiment_id)
        return {each[0]: set() if each[1] is None else {each[2] or ""} for each in self._session.execute(query)}

    def _grouped(self, query: Select[Any, Any]) -> dict[str, set[str]]:
        found: dict[str, set[str]] = {}
        for identifier, project_id in self._session.execute(query):
            found.setdefault(identifier, set()).add(project_id)
        return found

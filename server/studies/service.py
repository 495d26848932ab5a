"""What a person may do with studies: launch, look at, stop, resume, extend and delete them."""

from collections.abc import Sequence

from sqlalchemy.orm import Session

from server.audit.repository import AuditRepository
from server.checkpoints.repository import CheckpointRepository
from server.database import tables
from server.errors import ConflictError, RefusedFieldError
from server.experiments.repository import ExperimentRepository
from server.experiments.service import ExperimentService, launchable
from server.http.paging import Window
from server.ids import new_id
from server.projects.repository import ProjectRepository
from server.runs import states
from server.runs.service import RunService, resume_run, stop_run
from server.security.principal import Principal
from server.services import Services
from server.studies.advance import space_of, spec_of
from server.studies.designs import MAX_GRID, grid_size
from server.studies.repository import StudyRepository
from server.studies.schemas import MAX_TRIALS, Study, StudyLaunch, StudyPage, StudySpec
from server.studies.space import UnusableSettingError
from server.studies.views import listed_view, study_view
from workers.wording import counted


class StudyService:
    """Launches, reads, stops, resumes, extends and deletes studies."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._runs = RunService(services)

    def launch(self, request: StudyLaunch, principal: Principal) -> Study:
        """Write a study down; its first trials are asked for in a moment.

        Args:
            request: what to search.
            principal: who launches it, and so may begin with the policies that they may see.

        Raises:
            NotFoundError: there is no such project.
            UnusableArenaError: it trains on an imported arena that is not here.
            RefusedFieldError: a setting can't be searched so, or the training could not be launched.
        """
        training = launchable(self._services, request.training, principal)
        spec = StudySpec.model_validate(request.model_dump(include=set(StudySpec.model_fields)) | {"training": training})
        try:
            space_of(spec).check()
        except UnusableSettingError as error:
            raise RefusedFieldError(("body", "training", *error.path.split(".")), error.message) from error
        study = tables.Study(
            id=new_id(),
            project_id=request.project_id,
            launched_by=principal.user_id,
            name=request.name,
            spec=spec.model_dump(mode="json"),
            budget=min(request.trials, _most_trials(spec)),
        )
        with self._services.database.write() as session:
            ProjectRepository(session).get(request.project_id)
            StudyRepository(session).add(study)
            _note(session, "study.launched", study, f"{study.budget} trials")
        return self.get(study.id)

    def page(self, window: Window, principal: Principal) -> StudyPage:
        """Some of the studies that may be seen, the newest first."""
        with self._services.database.read() as session:
            repository = StudyRepository(session)
            studies, total = repository.page(window, principal.visible)
            ids = [study.id for study in studies]
            counts, best = repository.counts(ids), repository.best_success(ids)
        return StudyPage(items=[listed_view(each, counts[each.id], best.get(each.id)) for each in studies], total=total)

    def get(self, study_id: str) -> Study:
        """The study as it is now.

        Raises:
            NotFoundError: there is none.
        """
        with self._services.database.read() as session:
            repository = StudyRepository(session)
            study = repository.get(study_id)
            trials = repository.trials(study_id)
            open_ones = [trial.experiment_id for trial in trials if trial.state in ("running", "stopped")]
            experiments = repository.experiments([each for each in (*open_ones, study.judgement_id) if each])
            judged = experiments.get(study.judgement_id or "")
            finals = CheckpointRepository(session).final_evaluations([run.id for run in judged.runs] if judged else [])
        return study_view(study, trials, experiments, finals)

    def stop(self, study_id: str) -> Study:
        """Ask for no more trials, and stop those that go on.

        Raises:
            NotFoundError: there is no such study.
            ConflictError: it goes on no longer.
        """
        stopped: list[tables.Run] = []
        with self._services.database.write() as session:
            repository = StudyRepository(session)
            study = repository.get(study_id, for_update=True)
            if study.state not in ("running", "judging"):
                raise ConflictError(f"This study goes on no longer: it is {study.state}.")
            study.state = "stopped"
            session.flush()
            for trial in repository.trials(study_id, "running"):
                trial.state = "stopped"
            for run in _runs_of(session, study, "stopped"):
                if states.allows(run.state, "stop"):
                    stop_run(session, run)
                    stopped.append(run)
            _note(session, "study.stopped", study)
        for run in stopped:
            self._runs.announce_stopped(run)
        return self.get(study_id)

    def resume(self, study_id: str) -> Study:
        """Go on with a study that was stopped: its trials go on from their last checkpoints.

        Raises:
            NotFoundError: there is no such study.
            ConflictError: it was not stopped, or its runs are not through with stopping.
        """
        resumed: list[tables.Run] = []
        with self._services.database.write() as session:
            repository = StudyRepository(session)
            study = repository.get(study_id, for_update=True)
            if study.state != "stopped":
                raise ConflictError(f"Only a study that was stopped can be resumed; this one is {study.state}.")
            runs = _runs_of(session, study, "stopped")
            if any(run.state == "stopping" for run in runs):
                raise ConflictError("Its runs are still saving what they have: try again in a moment.")
            for trial in repository.trials(study_id, "stopped"):
                trial.state = "running"
            study.state = "running"
            for run in runs:
                if states.allows(run.state, "resume"):
                    resume_run(session, run)
                    resumed.append(run)
            _note(session, "study.resumed", study)
        for run in resumed:
            self._runs.announce_queued(run)
        return self.get(study_id)

    def extend(self, study_id: str, trials: int) -> Study:
        """Give a study more trials; one that was done goes on.

        Raises:
            NotFoundError: there is no such study.
            ConflictError: it has as many as it may, or the best is being judged.
        """
        with self._services.database.write() as session:
            study = StudyRepository(session).get(study_id, for_update=True)
            if study.state == "judging":
                raise ConflictError("The best is being judged: extend the study after that, or stop it first.")
            most = _most_trials(spec_of(study))
            if study.budget >= most:
                raise ConflictError(f"It has {study.budget} trials, which is as many as there may be.")
            study.budget = min(most, study.budget + trials)
            if study.state == "done":
                study.state, study.finished_at = "running", None
            _note(session, "study.extended", study, f"to {study.budget} trials")
        return self.get(study_id)

    def delete(self, study_id: str) -> None:
        """Forget a study; its trials go into the trash, the training that judged the best stays.

        Raises:
            NotFoundError: there is no such study.
        """
        with self._services.database.write() as session:
            repository = StudyRepository(session)
            study = repository.get(study_id, for_update=True)
            ids = [trial.experiment_id for trial in repository.trials(study_id) if trial.experiment_id]
            _note(session, "study.deleted", study)
            repository.delete(study)
        ExperimentService(self._services).delete_those_of(ids)


def _most_trials(spec: StudySpec) -> int:
    """As many as a study may have: a grid no more than it has points.

    Raises:
        RefusedFieldError: the grid is too large.
    """
    if spec.sampler != "grid":
        return MAX_TRIALS
    if (size := grid_size(space_of(spec))) > MAX_GRID:
        raise RefusedFieldError(
            ("body", "sampler"),
            f"this grid has {counted(size)} points, {counted(MAX_GRID)} are taken: search fewer settings or values",
        )
    return min(MAX_TRIALS, size)


def _runs_of(session: Session, study: tables.Study, state: tables.TrialState) -> Sequence[tables.Run]:
    """The runs of trials in a state and of the judgement, locked where the database has row locks."""
    repository = StudyRepository(session)
    ids = [trial.experiment_id for trial in repository.trials(study.id, state)] + [study.judgement_id]
    there = repository.experiments([each for each in ids if each])
    return [run for experiment_id in sorted(there) for run in ExperimentRepository(session).lock_runs(experiment_id)]


def _note(session: Session, action: str, study: tables.Study, details: str | None = None) -> None:
    AuditRepository(session).add(action, target=study.id, name=study.name, project_id=study.project_id, details=details)

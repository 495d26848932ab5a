"""Studies of a project, out and in: a study comes once, and does not go on by itself where it comes to."""

from pydantic import ValidationError
from sqlalchemy.orm import Session

from server.database import tables
from server.errors import ConflictError
from server.project_archives.repository import ProjectArchiveRepository
from server.project_archives.schemas import ArchivedStudy, ArchivedTrial
from server.studies.schemas import StudySpec


def archived_study(session: Session, study_id: str) -> ArchivedStudy | None:
    """A study with its trials; None where it is gone."""
    study = session.get(tables.Study, study_id)
    if study is None:
        return None
    trials = [
        ArchivedTrial(**{name: getattr(trial, name) for name in ArchivedTrial.model_fields})
        for trial in ProjectArchiveRepository(session).trials(study_id)
    ]
    own = {name: getattr(study, name) for name in ArchivedStudy.model_fields if name != "trials"}
    return ArchivedStudy(**own, trials=trials)


def take_study(session: Session, project_id: str, archived: ArchivedStudy) -> None:
    """Add a study as it was told, unless it is there, or its settings are not known here: its trainings come all the same.

    Raises:
        ConflictError: there is another one of its id.
    """
    try:
        StudySpec.model_validate(archived.spec)
    except ValidationError:
        return
    known = session.get(tables.Study, archived.id)
    if known is not None:
        if known.project_id != project_id or known.created_at != archived.created_at:
            raise ConflictError(f"This server has another study of the id {archived.id}.")
        return
    own = archived.model_dump(exclude={"trials", "state"})
    # Nobody asked here for the trials that it would go on with.
    state = "done" if archived.state == "done" else "stopped"
    session.add(tables.Study(**own, state=state, project_id=project_id))
    session.flush()
    for trial in archived.trials:
        told = trial.model_dump(exclude={"state"})
        ended = trial.state if trial.state != "running" else "stopped"
        session.add(tables.StudyTrial(**told, state=ended, study_id=archived.id))

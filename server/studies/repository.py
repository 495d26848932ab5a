"""Studies and their trials in SQL."""

from collections.abc import Collection, Sequence
from typing import Any

from sqlalchemy import func, select, true, update
from sqlalchemy.orm import Session, selectinload

from server.database import tables
from server.database.tables import StudyState, TrialState
from server.errors import NotFoundError
from server.http.paging import Window

_Study = tables.Study
_Trial = tables.StudyTrial


# How sure its importances are was never asked: an older version has ended it, or it came from another server.
_UNWEIGHED = _Study.importances.is_not(None) & _Study.importance_intervals.is_(None)


class StudyRepository:
    """Reads and writes studies within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def add(self, study: tables.Study) -> None:
        """Add a study, without trials yet."""
        self._session.add(study)
        self._session.flush()

    def get(self, study_id: str, *, for_update: bool = False) -> tables.Study:
        """The study; `for_update` locks the row where the database has row locks.

        Raises:
            NotFoundError: there is none.
        """
        query = select(_Study).where(_Study.id == study_id)
        found = self._session.scalar(query.with_for_update() if for_update else query)
        if found is None:
            raise NotFoundError.of("study", study_id)
        return found

    def page(self, window: Window, visible: Collection[str] | None) -> tuple[Sequence[tables.Study], int]:
        """Some of them, the newest first, and how many there are in the `visible` projects (None: all)."""
        seen = _Study.project_id.in_(visible) if visible is not None else true()
        total = self._session.scalar(select(func.count()).select_from(_Study).where(seen)) or 0
        query = select(_Study).where(seen).order_by(_Study.created_at.desc(), _Study.id)
        return self._session.scalars(query.offset(window.offset).limit(window.limit)).all(), total

    def going_on(self) -> list[str]:
        """The ids of those that have something to do, the oldest first."""
        query = select(_Study.id).where(_Study.state.in_(("running", "judging")) | _UNWEIGHED).order_by(_Study.created_at)
        return list(self._session.scalars(query))

    def trials(self, study_id: str, state: TrialState | None = None) -> Sequence[tables.StudyTrial]:
        """All trials of a study, or those in a state, by number."""
        query = select(_Trial).where(_Trial.study_id == study_id)
        if state is not None:
            query = query.where(_Trial.state == state)
        return self._session.scalars(query.order_by(_Trial.number)).all()

    def counts(self, study_ids: Collection[str]) -> dict[str, dict[str, int]]:
        """How many trials of each study are in each state; a state without any is absent."""
        query = select(_Trial.study_id, _Trial.state, func.count()).where(_Trial.study_id.in_(study_ids))
        found: dict[str, dict[str, int]] = {study_id: {} for study_id in study_ids}
        for study_id, state, count in self._session.execute(query.group_by(_Trial.study_id, _Trial.state)):
            found[study_id][state] = count
        return found

    def best_success(self, study_ids: Collection[str]) -> dict[str, float]:
        """Success of the best trial of each study that has one."""
        best = (
            select(_Trial.study_id, func.max(_Trial.score).label("score"))
            .where(_Trial.study_id.in_(study_ids), _Trial.state == "complete")
            .group_by(_Trial.study_id)
            .subquery()
        )
        query = select(_Trial.study_id, _Trial.success).join(
            best, (best.c.study_id == _Trial.study_id) & (best.c.score == _Trial.score)
        )
        return {study_id: success or 0.0 for study_id, success in self._session.execute(query)}

    def experiments(self, experiment_ids: Collection[str]) -> dict[str, tables.Experiment]:
        """Those of the experiments that are there and not in the trash, with their runs, by id."""
        query = select(tables.Experiment).where(
            tables.Experiment.id.in_(experiment_ids), tables.Experiment.deleted_at.is_(None)
        )
        found = self._session.scalars(query.options(selectinload(tables.Experiment.runs)))
        return {experiment.id: experiment for experiment in found}

    def evaluations(self, run_ids: Collection[str]) -> dict[str, list[tuple[int, float]]]:
        """Step and success rate of every evaluation of these runs, by run and step."""
        query = (
            select(
                tables.Checkpoint.run_id,
                tables.Checkpoint.step,
                tables.Evaluation.arrivals,
                tables.Evaluation.episode_count,
            )
            .join(tables.Evaluation, tables.Evaluation.checkpoint_id == tables.Checkpoint.id)
            .where(tables.Checkpoint.run_id.in_(run_ids))
            .order_by(tables.Checkpoint.step)
        )
        found: dict[str, list[tuple[int, float]]] = {run_id: [] for run_id in run_ids}
        for run_id, step, arrivals, episodes in self._session.execute(query):
            found[run_id].append((step, arrivals / episodes))
        return found

    def claim_trial(self, study_id: str, asked: int) -> bool:
        """Take the next number, if nobody else has meanwhile and the study still goes on."""
        return self._changed(
            update(_Study)
            .where(_Study.id == study_id, _Study.state == "running", _Study.asked == asked, _Study.budget > asked)
            .values(asked=asked + 1)
        )

    def move(self, study: tables.Study, to: StudyState, **columns: Any) -> bool:
        """Bring a study into another state, if it still is as it was read."""
        was = (_Study.id == study.id, _Study.state == study.state, _Study.asked == study.asked)
        return self._changed(update(_Study).where(*was, _Study.budget == study.budget).values(state=to, **columns))

    def settle(self, trial: tables.StudyTrial, to: TrialState, **columns: Any) -> bool:
        """Bring a trial that goes on into another state, if nobody else has."""
        mine = (_Trial.study_id == trial.study_id, _Trial.number == trial.number, _Trial.state == "running")
        return self._changed(update(_Trial).where(*mine).values(state=to, **columns))

    def note_rungs(self, trial: tables.StudyTrial, rungs: dict[str, list[float | None]]) -> None:
        """How a trial gets on."""
        mine = (_Trial.study_id == trial.study_id, _Trial.number == trial.number)
        self._session.execute(update(_Trial).where(*mine).values(rungs=rungs))

    def note(self, study_id: str, **columns: Any) -> None:
        """Other columns of a study."""
        self._session.execute(update(_Study).where(_Study.id == study_id).values(**columns))

    def delete(self, study: tables.Study) -> None:
        """Remove a study and its trials; their trainings stay."""
        self._session.delete(study)

    def _changed(self, statement: Any) -> bool:
        done: Any = self._session.execute(statement.execution_options(synchronize_session=False))
        return bool(done.rowcount)

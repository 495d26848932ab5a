"""What is done to several experiments at once, and to what hangs beside one: tags, stars, notes, archive, trash, seeds."""

import time
from collections.abc import Callable, Collection, Sequence

from server.database import tables
from server.database.tables import RunState
from server.errors import ConflictError, ForbiddenError, NotFoundError
from server.events.changes import Change
from server.experiments.repository import ExperimentRepository
from server.experiments.service import ExperimentService
from server.ids import new_id
from server.projects.repository import ProjectRepository
from server.runs import states
from server.runs.service import RunService, resume_run
from server.security.principal import Principal
from server.services import Services
from server.workbench.marks import MarkRepository
from server.workbench.schemas import MAX_TAGS, Action, ActionDone, ExperimentMarks, LeftOut

_FAILED: frozenset[RunState] = frozenset({"failed"})


class ActionService:
    """Changes many experiments; each in a transaction of its own, so that others may write in between."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self._experiments = ExperimentService(services)
        self._runs = RunService(services)

    def act(self, action: Action, principal: Principal) -> ActionDone:
        """Do one thing to several experiments; what can't be done to one is no reason to leave the others out.

        Raises:
            ConflictError: a tag is missing, or superfluous.
        """
        if (action.tag is not None) != (action.action in ("tag", "untag")):
            raise ConflictError("A tag belongs to the actions tag and untag, and to no other.")
        do = self._one(action)
        with self._services.database.read() as session:
            projects = ProjectRepository(session).of_experiments(action.experiments)
        done: list[str] = []
        left_out: list[LeftOut] = []
        for experiment_id in dict.fromkeys(action.experiments):
            try:
                _allow(principal, experiment_id, projects.get(experiment_id, set()))
                do(experiment_id)
            except (NotFoundError, ForbiddenError, ConflictError) as error:
                left_out.append(LeftOut(id=experiment_id, reason=error.message))
            else:
                done.append(experiment_id)
        return ActionDone(done=done, left_out=left_out)

    def marks(self, experiment_id: str) -> ExperimentMarks:
        """Tags, star and notes.

        Raises:
            NotFoundError: there is no such experiment.
        """
        with self._services.database.read() as session:
            experiment = ExperimentRepository(session).get(experiment_id)
            return ExperimentMarks(
                tags=MarkRepository(session).tags(experiment_id),
                starred=experiment.starred_at is not None,
                archived=experiment.archived_at is not None,
                notes=experiment.notes or "",
            )

    def write_notes(self, experiment_id: str, notes: str) -> ExperimentMarks:
        """Replace an experiment's notes.

        Raises:
            NotFoundError: there is no such experiment.
        """
        with self._services.database.write() as session:
            ExperimentRepository(session).get(experiment_id).notes = notes or None
        self._changed(experiment_id)
        return self.marks(experiment_id)

    def add_seeds(self, experiment_id: str, seeds: Sequence[int]) -> None:
        """Queue one more run for each seed that the experiment does not have.

        Raises:
            NotFoundError: there is no such experiment.
            ConflictError: it has all of these seeds.
        """
        with self._services.database.write() as session:
            experiment = ExperimentRepository(session).get(experiment_id)
            there = {run.seed for run in experiment.runs}
            runs = [tables.Run(id=new_id(), seed=seed) for seed in sorted(set(seeds) - there)]
            if not runs:
                raise ConflictError("The training has these seeds already: two runs with the same seed are the same run.")
            experiment.runs.extend(runs)
        for run in runs:
            self._runs.announce_queued(run)
        self._changed(experiment_id)

    def _one(self, action: Action) -> Callable[[str], object]:
        tag = action.tag or ""
        return {
            "stop": self._experiments.stop,
            "resume": self._experiments.resume,
            "repeat": self._repeat,
            "star": lambda one: self._mark(one, lambda row: setattr(row, "starred_at", row.starred_at or time.time())),
            "unstar": lambda one: self._mark(one, lambda row: setattr(row, "starred_at", None)),
            "archive": lambda one: self._mark(one, lambda row: setattr(row, "archived_at", row.archived_at or time.time())),
            "unarchive": lambda one: self._mark(one, lambda row: setattr(row, "archived_at", None)),
            "tag": lambda one: self._tag(one, tag),
            "untag": lambda one: self._untag(one, tag),
            "delete": self._experiments.delete,
            "restore": self._experiments.restore,
            "remove": self._experiments.remove,
        }[action.action]

    def _repeat(self, experiment_id: str) -> None:
        with self._services.database.write() as session:
            runs = [run for run in ExperimentRepository(session).lock_runs(experiment_id) if run.state in _FAILED]
            if not runs:
                raise ConflictError("No run of this experiment has failed.")
            for run in runs:
                assert states.allows(run.state, "resume")
                resume_run(session, run)
        for run in runs:
            self._runs.announce_queued(run)

    def _mark(self, experiment_id: str, change: Callable[[tables.Experiment], None]) -> None:
        with self._services.database.write() as session:
            change(ExperimentRepository(session).get(experiment_id))
        self._changed(experiment_id)

    def _tag(self, experiment_id: str, tag: str) -> None:
        with self._services.database.write() as session:
            ExperimentRepository(session).get(experiment_id)
            marks = MarkRepository(session)
            tags = marks.tags(experiment_id)
            if tag in tags:
                return
            if len(tags) >= MAX_TAGS:
                raise ConflictError(f"A training has at most {MAX_TAGS} tags.")
            marks.add_tag(experiment_id, tag)
        self._changed(experiment_id)

    def _untag(self, experiment_id: str, tag: str) -> None:
        with self._services.database.write() as session:
            ExperimentRepository(session).get(experiment_id)
            MarkRepository(session).remove_tag(experiment_id, tag)
        self._changed(experiment_id)

    def _changed(self, experiment_id: str) -> None:
        self._services.bus.publish(Change(experiment_id=experiment_id, run_id=None, kind="experiment"))


def _allow(principal: Principal, experiment_id: str, projects: Collection[str]) -> None:
    """Whether somebody may change an experiment of these projects; what may not be seen is not there.

    Raises:
        NotFoundError, ForbiddenError: it may not be changed.
    """
    if not projects or any(principal.role_in(project) is None for project in projects):
        raise NotFoundError.of("experiment", experiment_id)
    for project in projects:
        principal.require("editor", project)

"""What a person may do with a run."""

import time
from collections.abc import Sequence

from sqlalchemy.orm import Session

from server.audit.repository import AuditRepository
from server.database import tables
from server.events.changes import Change
from server.experiments.stored import training_of
from server.http.paging import Window
from server.runs import states, views
from server.runs.repository import RunRepository
from server.runs.schemas import RunDetail, RunEvent
from server.services import Services
from server.system.repository import SILENCE_SECONDS, WorkerRepository
from workers.config import TrainingConfig
from workers.protocol import queues_of


class RunService:
    """Reads, stops and resumes runs."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def get(self, run_id: str) -> RunDetail:
        """The run as it is now.

        Raises:
            NotFoundError: there is none.
        """
        with self._services.database.read() as session:
            repository = RunRepository(session)
            run = repository.get(run_id)
            latest = repository.latest_metrics([run_id], views.SHOWN).get(run_id, {})
            return views.run_detail(run, latest, lambda training: takers(session, run, training))

    def events(self, run_id: str, window: Window) -> tuple[list[RunEvent], int]:
        """A part of the run's event log, oldest first, and how long all of it is.

        Raises:
            NotFoundError: there is no such run.
        """
        with self._services.database.read() as session:
            repository = RunRepository(session)
            repository.check(run_id)
            events = [
                RunEvent(id=event.id, at=event.at, step=event.step, level=event.level, message=event.message)
                for event in repository.events(run_id, window)
            ]
            return events, repository.count_events(run_id)

    def stop(self, run_id: str) -> RunDetail:
        """Ask the run to end: at once if it waits, after a checkpoint if a worker has it.

        Raises:
            NotFoundError: there is none.
            TransitionError: it has ended already.
        """
        with self._services.database.write() as session:
            run = RunRepository(session).get(run_id, for_update=True)
            stop_run(session, run)
            _note(session, "run.stopped", run)
        self.announce_stopped(run)
        return self.get(run_id)

    def resume(self, run_id: str) -> RunDetail:
        """Queue a run that was stopped or failed; it goes on from its last checkpoint.

        Raises:
            NotFoundError: there is none.
            TransitionError: it has not ended, or has done all its steps.
        """
        with self._services.database.write() as session:
            run = RunRepository(session).get(run_id, for_update=True)
            resume_run(session, run)
            _note(session, "run.resumed", run)
        self.announce_queued(run)
        return self.get(run_id)

    def announce_stopped(self, run: tables.Run) -> None:
        """After the commit of `stop_run`: tell the worker, and whoever looks on."""
        if run.state == "stopping":
            self._services.links.stop(run.id)
        self._services.bus.publish(Change(experiment_id=run.experiment_id, run_id=run.id, kind="run"))

    def announce_queued(self, run: tables.Run) -> None:
        """After the commit of a run that waits for a worker: wake one, and tell whoever looks on."""
        for queue in queues_of(training_of(run.experiment), run.device):
            self._services.doorbell.ring(run.id, run.attempt, queue)
        self._services.bus.publish(Change(experiment_id=run.experiment_id, run_id=run.id, kind="run"))


def _note(session: Session, action: str, run: tables.Run) -> None:
    name = f"{run.experiment.name}, seed {run.seed}"
    AuditRepository(session).add(action, target=run.id, name=name, project_id=run.experiment.project_id)


def takers(session: Session, run: tables.Run, training: TrainingConfig) -> Sequence[str]:
    """The workers that would take up a run now."""
    now = time.time()
    queues = queues_of(training, run.device)
    return WorkerRepository(session).fit(queues, now - SILENCE_SECONDS, now, training.extensions)


def stop_run(session: Session, run: tables.Run) -> None:
    """Move the row as `stop` says."""
    before, run.state = run.state, states.next_state(run.state, "stop")
    if run.state == before:
        return
    if run.state in states.FINISHED:
        run.finished_at = time.time()
    message = "Stopped before a worker took it up." if run.state == "stopped" else "Stop requested."
    RunRepository(session).add_event(run.id, "info", message, run.step)


def resume_run(session: Session, run: tables.Run) -> None:
    """Move the row as `resume` says, with a clean slate of losses."""
    run.state = states.next_state(run.state, "resume")
    run.error = None
    run.losses, run.lost_by = 0, None
    run.finished_at = None
    run.queued_at = time.time()
    run.thins_at = run.thin_enough = None
    RunRepository(session).add_event(run.id, "info", "Resume requested.", run.step)

"""The queue and its workers, and what people may do with them."""

import time
from collections import defaultdict
from collections.abc import Collection, Mapping
from statistics import median

from sqlalchemy.orm import Session

from server.audit.repository import AuditRepository
from server.database import tables
from server.errors import ConflictError, ForbiddenError, NotFoundError
from server.events.changes import Change
from server.experiments.stored import StoredTraining, read_training
from server.http.paging import Window
from server.jobs.repository import JobRepository
from server.queueing.activity import strip
from server.queueing.forecast import Place, Turn, forecast
from server.queueing.placing import Standing, placed
from server.queueing.repository import QueueRepository
from server.queueing.schemas import (
    EDITORS_PRIORITY,
    MAX_PRIORITY,
    QueuePage,
    QueuePlace,
    WaitingRun,
    WaitsFor,
    Worker,
    Workers,
    WorkersRun,
)
from server.runs import views
from server.runs.repository import RunRepository
from server.runs.schemas import Run
from server.runs.shares import ShareRepository, Shares
from server.security.principal import Principal
from server.services import Services
from server.system.repository import SILENCE_SECONDS, WorkerRepository, extensions_on, versions_on
from server.worker_api.losses import exhausted
from sim.extending.discovery import missing
from workers.protocol import Machine, Queue, queues_of


class QueueService:
    """Reads and orders the queue."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def page(self, window: Window, visible: Collection[str] | None) -> QueuePage:
        """A part of the queue, as far as it may be seen.

        Args:
            window: which part.
            visible: projects; None for all.
        """
        now = time.time()
        with self._services.database.read() as session:
            shares = self._shares(session)
            queued = shares.in_turn(RunRepository(session).queued())
            workers = [worker for worker in QueueRepository(session).workers() if _takes_runs(worker, now)]
            places = _places(session, workers)
            speeds = _speeds(session)
            jobs = JobRepository(session).count_queued()
            seen = [(at, run) for at, run in enumerate(queued, start=1) if _may_see(run, visible)]
            shown = seen[window.offset : window.offset + window.limit]
            # Nobody behind the last one that is shown changes when it begins.
            ahead = queued[: shown[-1][0]] if shown else []
            stored = _read_once(ahead)
            able = {
                run.id: frozenset[str]() if shares.waits_for(run) else _able(run, stored[run.experiment_id], workers)
                for run in ahead
            }
            turns = [Turn(max(stored[run.experiment_id].training.steps - run.step, 0), able[run.id]) for run in ahead]
            begins = forecast(places, turns, speeds)
            items = [
                _waiting(
                    run,
                    stored[run.experiment_id],
                    at,
                    begins[at - 1],
                    shares.waits_for(run) or _waits_for(run, stored[run.experiment_id], workers),
                )
                for at, run in shown
            ]
        return QueuePage(items=items, total=len(seen), hidden=len(queued) - len(seen), jobs=jobs)

    def workers(self, visible: Collection[str] | None) -> Workers:
        """All workers, with the runs that may be seen."""
        now = time.time()
        with self._services.database.read() as session:
            repository = QueueRepository(session)
            rows = repository.workers()
            runs = {run.worker: run for run in repository.active()}
            latest = RunRepository(session).latest_metrics([run.id for run in runs.values()], views.SHOWN)
            gone = [worker.name for worker in rows if not _there(worker, now)]
            words = repository.last_words(gone, visible) if gone else {}
            items = [_worker(worker, now, runs.get(worker.name), latest, visible, words.get(worker.name)) for worker in rows]
        return Workers(items=sorted(items, key=lambda worker: not worker.there))

    def prioritise(self, run_id: str, priority: int, principal: Principal) -> None:
        """Give a run that waits a priority.

        Raises:
            NotFoundError: there is no such run.
            ConflictError: it does not wait.
            ForbiddenError: so much takes more rights.
        """
        with self._services.database.write() as session:
            run = _queued(session, run_id)
            self._give(session, run, priority, principal)
        self._tell(run)

    def place(self, run_id: str, place: QueuePlace, principal: Principal) -> None:
        """Bring a run to the place before or after another one, by priorities.

        Raises:
            NotFoundError: there is no such run, or the other one may not be seen.
            ConflictError: one of them does not wait.
            ForbiddenError: priorities of others would have to change that one may not change.
        """
        with self._services.database.write() as session:
            run = _queued(session, run_id)
            other = RunRepository(session).get(place.beside)
            if not _may_see(other, principal.visible):
                raise NotFoundError.of("run", place.beside)
            waiting = {each.id: each for each in RunRepository(session).queued()}
            if other.id not in waiting or other.id == run.id:
                raise ConflictError("The other run does not wait any more: look at the queue again.")
            order = [Standing(each.id, each.priority) for each in self._shares(session).in_turn(waiting.values())]
            at = [each.run_id for each in order if each.run_id != run.id].index(other.id) + (place.side == "after")

            def allowed(one: str, priority: int) -> bool:
                most = MAX_PRIORITY if principal.administrates else EDITORS_PRIORITY
                mine = principal.has("editor", waiting[one].experiment.project_id)
                return mine and -MAX_PRIORITY <= priority <= max(most, waiting[one].priority)

            given = placed(order, run.id, at, allowed)
            if given is None:
                raise ForbiddenError(
                    "To stand there, priorities would have to change that you may not change: give it a number instead."
                )
            moved = [waiting[each] for each in given]
            for each in moved:
                self._give(session, each, given[each.id], principal)
        for each in moved:
            self._tell(each)

    def to_front(self, run_id: str, principal: Principal) -> None:
        """Give a run the next turn.

        Raises:
            NotFoundError: there is no such run.
            ConflictError: it does not wait.
            ForbiddenError: so much takes more rights.
        """
        with self._services.database.write() as session:
            run = _queued(session, run_id)
            first = next(RunRepository(session).in_turn(self._shares(session)), run)
            if first.id != run.id:
                self._give(session, run, first.priority + 1, principal)
        self._tell(run)

    def remove(self, worker: str) -> None:
        """Forget a worker that has gone, all of its processes.

        Raises:
            NotFoundError: no such worker is known.
            ConflictError: it is still there.
        """
        now = time.time()
        with self._services.database.write() as session:
            known = [row for row in QueueRepository(session).workers() if worker in (row.name, row.name.partition("/")[0])]
            if not known:
                raise NotFoundError.of("worker", worker)
            if any(_there(row, now) for row in known):
                raise ConflictError(f"{worker} is still there: drain it first.")
            WorkerRepository(session).remove([row.name for row in known])
            AuditRepository(session).add("worker.removed", name=worker)

    def _shares(self, session: Session) -> Shares:
        return ShareRepository(session).read(self._services.settings.limits)

    @staticmethod
    def _give(session: Session, run: tables.Run, priority: int, principal: Principal) -> None:
        if priority > EDITORS_PRIORITY and not principal.administrates:
            raise ForbiddenError(f"Priorities above {EDITORS_PRIORITY} take an administrator of the installation.")
        run.priority = min(priority, MAX_PRIORITY)
        name = f"{run.experiment.name}, seed {run.seed}"
        AuditRepository(session).add(
            "run.prioritised",
            target=run.id,
            name=name,
            project_id=run.experiment.project_id,
            details=f"priority {run.priority}",
        )

    def _tell(self, run: tables.Run) -> None:
        self._services.bus.publish(Change(experiment_id=run.experiment_id, run_id=run.id, kind="run"))


def _queued(session: Session, run_id: str) -> tables.Run:
    run = RunRepository(session).get(run_id, for_update=True)
    if run.state != "queued":
        raise ConflictError(f"Run {run.id} is {run.state}: only one that waits has a turn.")
    return run


def _may_see(run: tables.Run, visible: Collection[str] | None) -> bool:
    return visible is None or run.experiment.project_id in visible


def _there(worker: tables.Worker, now: float) -> bool:
    return now - SILENCE_SECONDS <= worker.last_seen <= now


def _takes_runs(worker: tables.Worker, now: float) -> bool:
    return _there(worker, now) and worker.trouble is None and worker.drained_at is None


def _read_once(runs: Collection[tables.Run]) -> dict[str, StoredTraining]:
    """Their trainings, by experiment."""
    stored: dict[str, StoredTraining] = {}
    for run in runs:
        if run.experiment_id not in stored:
            stored[run.experiment_id] = read_training(run.experiment.training)
    return stored


def _able(run: tables.Run, stored: StoredTraining, workers: Collection[tables.Worker]) -> frozenset[str]:
    """The names of the workers that could train it."""
    queues = queues_of(stored.training, run.device)
    return frozenset(
        worker.name
        for worker in workers
        if worker.queue in queues
        and not missing(stored.training.extensions, versions_on(worker))
        and not exhausted(run, worker.name)
    )


def _waits_for(run: tables.Run, stored: StoredTraining, workers: Collection[tables.Worker]) -> WaitsFor:
    if _able(run, stored, workers):
        return "turn"
    queues = queues_of(stored.training, run.device)
    of_queue = [worker for worker in workers if worker.queue in queues]
    if not of_queue:
        return "gpu" if queues == ("gpu",) else "worker"
    if all(missing(stored.training.extensions, versions_on(worker)) for worker in of_queue):
        return "extension"
    return "other worker"


def _places(session: Session, workers: Collection[tables.Worker]) -> list[Place]:
    runs = {run.worker: run for run in QueueRepository(session).active()}
    latest = RunRepository(session).latest_metrics([run.id for run in runs.values()], views.SHOWN)

    def free_in(worker: tables.Worker) -> float | None:
        run = runs.get(worker.name)
        return 0.0 if run is None else _view(run, latest).seconds_left

    return [Place(worker.name, worker.queue, free_in(worker)) for worker in workers]


def _speeds(session: Session) -> dict[Queue, float]:
    speeds: dict[Queue, list[float]] = defaultdict(list)
    for queue, speed in QueueRepository(session).recent_speeds():
        speeds[queue].append(speed)
    return {queue: median(found) for queue, found in speeds.items()}


def _view(run: tables.Run, latest: Mapping[str, Mapping[str, float]]) -> Run:
    return views.run_view(run, read_training(run.experiment.training).training, latest.get(run.id, {}))


def _waiting(
    run: tables.Run, stored: StoredTraining, position: int, starts_in: float | None, waits_for: WaitsFor
) -> WaitingRun:
    return WaitingRun(
        id=run.id,
        experiment_id=run.experiment_id,
        experiment_name=run.experiment.name,
        project_id=run.experiment.project_id,
        seed=run.seed,
        algorithm=stored.training.algorithm.name,
        step=run.step,
        total_steps=stored.training.steps,
        priority=run.priority,
        queued_at=run.queued_at,
        position=position,
        waits_for=waits_for,
        parallel_runs=run.experiment.parallel_runs,
        extensions=[extension.name for extension in stored.training.extensions],
        starts_in=starts_in,
    )


def _worker(
    worker: tables.Worker,
    now: float,
    run: tables.Run | None,
    latest: Mapping[str, Mapping[str, float]],
    visible: Collection[str] | None,
    last_words: str | None,
) -> Worker:
    trained = None
    if run is not None and _may_see(run, visible):
        view = _view(run, latest)
        trained = WorkersRun(
            id=run.id,
            experiment_id=run.experiment_id,
            experiment_name=run.experiment.name,
            seed=run.seed,
            progress=min(view.step / view.total_steps, 1.0),
            steps_per_second=view.steps_per_second,
            seconds_left=view.seconds_left,
        )
    return Worker(
        name=worker.name,
        queue=worker.queue,
        last_seen=worker.last_seen,
        there=_there(worker, now),
        draining=worker.drained_at is not None,
        trouble=worker.trouble,
        machine=Machine.model_validate(worker.machine) if worker.machine is not None else None,
        extensions=list(extensions_on(worker)),
        busy=run is not None,
        run=trained,
        activity=strip(worker.activity or {}, now),
        last_words=last_words,
    )

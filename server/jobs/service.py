"""What may happen to jobs, each in one transaction: asked for, claimed, told of, ended, lost, cancelled."""

import logging
import time
from collections.abc import Iterable, Iterator, Sequence
from typing import BinaryIO

from pydantic import ValidationError
from sqlalchemy.exc import IntegrityError
from sqlalchemy.orm import Session

from server.arenas.store import ArenaStore
from server.bags.repository import BagRepository
from server.database import tables
from server.errors import BusyError, NotFoundError
from server.evaluations.repository import PolicyEvaluationRepository
from server.http.paging import Window
from server.ids import new_id
from server.jobs.asked import Asked
from server.jobs.names import result_name
from server.jobs.needed import needed_by, needed_by_each
from server.jobs.repository import AHEAD, LONG, OPEN, JobRepository
from server.jobs.schemas import JobPage
from server.jobs.turns import Turn, turns_of
from server.jobs.views import job_view
from server.policies.service import find
from server.services import Services
from server.uploads.repository import UploadRepository
from server.worker_api.attempts import FencedError
from server.worker_api.losses import count_loss, exhausted, hopeful, too_many
from sim.config import ImportedArenaConfig
from sim.extending.discovery import UsedExtension, missing
from workers.job_protocol import (
    JOB_SPEC,
    KINDS,
    ArenaSuite,
    BagJob,
    BaselineName,
    CheckpointPolicy,
    EvaluateJob,
    FilmJob,
    JobClaim,
    JobClaimRequest,
    JobEnd,
    JobKind,
    JobSpec,
    Measurement,
    ReplayJob,
    ScenarioSuite,
    UploadedPolicy,
    is_long,
)

logger = logging.getLogger(__name__)

MAX_QUEUED = 200
"""Jobs that may wait; whoever asks for one more is told to come again."""
KEPT_SECONDS = 24 * 3_600.0
"""Of a job that has ended, for people to look at."""
MAX_AHEAD = 32
"""Jobs that nobody waits for yet; more are not put into the queue."""

# What has come since may be taken up by a free place in this moment.
_MAKE_WAY_SECONDS = 0.5

_COME_AGAIN = 10.0


class JobService:
    """The transactions. Synchronous: call it on a thread."""

    def __init__(self, services: Services) -> None:
        self._services = services
        self.board = services.board
        self.lane = services.lanes.jobs

    # -- those who ask ----------------------------------------------------------------------------------------------------

    def ask(self, asked: Asked) -> str:
        """Put a job into the queue; the id of the one that is open already where it was asked for before.

        Raises:
            BusyError: as many wait as may.
        """
        try:
            with self._services.database.write() as session:
                job_id = queue(session, asked)
        except IntegrityError:
            # Somebody has asked for the same in the same moment.
            with self._services.database.read() as session:
                job = JobRepository(session).open_of(asked.key)
            if job is None:
                raise
            return job.id
        self.board.ring()
        return job_id

    def find(self, job_id: str) -> tables.Job:
        """The job.

        Raises:
            NotFoundError: there is none.
        """
        with self._services.database.read() as session:
            return JobRepository(session).get(job_id)

    def lacking(self, job: tables.Job) -> tuple[UsedExtension, ...]:
        """The extensions that a queued job waits for; none where it does not wait, or a worker is there that has them."""
        return self.lacking_each([job]).get(job.id, ())

    def lacking_each(self, jobs: Iterable[tables.Job]) -> dict[str, tuple[UsedExtension, ...]]:
        """The same of several by their ids, in one query; who lacks nothing is absent."""
        queued = [job for job in jobs if job.state == "queued"]
        if not queued:
            return {}
        with self._services.database.read() as session:
            each = needed_by_each(session, [job.spec for job in queued])
        return {
            job.id: needed for job, needed in zip(queued, each, strict=True) if needed and not self.board.workers(needed)
        }

    def turns(self, jobs: Iterable[tables.Job]) -> dict[str, Turn]:
        """What each of the evaluations that wait stands behind, by its id, in two queries; none where none waits."""
        if not any(job.state == "queued" for job in jobs):
            return {}
        with self._services.database.read() as session:
            running, queued = JobRepository(session).evaluations(MAX_QUEUED)
            return turns_of(running, queued, self.board)

    def current(self, job_id: str, attempt: int) -> tables.Job:
        """The job, where this attempt has it.

        Raises:
            FencedError: the attempt is over.
        """
        with self._services.database.read() as session:
            return _unfenced(session.get(tables.Job, job_id), job_id, attempt)

    def page(self, window: Window) -> JobPage:
        """Some of the jobs, and how many workers take them up."""
        with self._services.database.read() as session:
            rows, total = JobRepository(session).page(window)
        lacking = self.lacking_each(rows)
        items = [job_view(row, self.board, lacking.get(row.id, ())) for row in rows]
        return JobPage(items=items, total=total, workers=self.board.machines())

    def cancel(self, job_id: str) -> tables.Job:
        """Nobody wants it any more; its worker hears of it at its next report.

        Raises:
            NotFoundError: there is no such job.
        """
        with self._services.database.write() as session:
            job = JobRepository(session).get(job_id, for_update=True)
            if job.state in OPEN:
                _end(session, job, "cancelled", "Cancelled.")
        self.board.end(job_id)
        return job

    # -- workers ----------------------------------------------------------------------------------------------------------

    def claim(self, request: JobClaimRequest) -> JobClaim | None:
        """Give the next job to a worker; None where none waits that it may have."""
        with self._services.database.read() as session:
            repository = JobRepository(session)
            if not repository.claimed_under(request.claim_id) and not repository.queued(request.kinds, 1, long=request.long):
                return None
        ended: list[str] = []
        with self._services.database.write() as session:
            claim = self._claim(session, request, ended)
        for job_id in ended:
            self.board.end(job_id)
        if claim is not None:
            self._services.job_leases.renew(claim.id, claim.attempt)
            self.board.take(claim.id, claim.attempt, ahead=claim.ahead)
        return claim

    def _claim(self, session: Session, request: JobClaimRequest, ended: list[str]) -> JobClaim | None:
        repository = JobRepository(session)
        job = repository.claimed_under(request.claim_id)
        if job is not None:
            return self._granted(job)
        others = [name for name in self.board.workers() if name != request.worker]
        there = {one.name: one.version for one in request.extensions}
        for waiting in repository.queued(request.kinds, MAX_QUEUED, long=request.long):
            if waiting.priority == AHEAD and repository.awaited(time.time()):
                return None
            if exhausted(waiting, request.worker) and hopeful(waiting, others):
                continue
            if missing(needed_by(session, waiting.spec), there):
                continue
            # One by one: who locked all of them would leave nothing to whoever asks in the same moment.
            if (job := repository.take(waiting.id)) is None:
                continue
            job.state, job.attempt, job.worker, job.claim_id = "running", job.attempt + 1, request.worker, request.claim_id
            job.started_at = time.time()
            try:
                return self._granted(job)
            except (NotFoundError, ValidationError) as error:
                reason = error.message if isinstance(error, NotFoundError) else "This version can't read what was asked for."
                _end(session, job, "failed", reason)
                ended.append(job.id)
        return None

    def _granted(self, job: tables.Job) -> JobClaim:
        return JobClaim(
            id=job.id,
            attempt=job.attempt,
            spec=_with_geometry(JOB_SPEC.validate_python(job.spec), self._services.arenas),
            sha256=job.sha256,
            lease_seconds=self._services.settings.lease_seconds,
            ahead=job.priority == AHEAD,
        )

    def report(self, job_id: str, attempt: int, progress: float) -> None:
        """Its worker is there.

        Raises:
            FencedError: the attempt is over.
        """
        if not self.board.is_current(job_id, attempt):
            self.current(job_id, attempt)
        if progress < 1.0 and self.board.is_ahead(job_id):
            self._make_way(job_id, attempt)
        self._services.job_leases.renew(job_id, attempt)
        self.board.report(job_id, attempt, progress)

    def _make_way(self, job_id: str, attempt: int) -> None:
        """Take back what nobody waits for where somebody waits for its place; or for it, which then goes on with all speed.

        Raises:
            FencedError: it was taken back.
        """
        before = time.time() - _MAKE_WAY_SECONDS
        with self._services.database.read() as session:
            job = _unfenced(session.get(tables.Job, job_id), job_id, attempt)
            if job.priority == AHEAD and not JobRepository(session).awaited(before):
                return
        with self._services.database.write() as session:
            job = _unfenced(session.get(tables.Job, job_id, with_for_update=True), job_id, attempt)
            _requeue(job)
        self._told(job)
        raise FencedError(f"Job {job_id} makes way: somebody waits.")

    def archive(self, job_id: str, attempt: int) -> Iterator[bytes]:
        """The archive of the job's policy.

        Raises:
            FencedError: the attempt is over.
            NotFoundError: the archive is gone.
        """
        spec = JOB_SPEC.validate_python(self.current(job_id, attempt).spec)
        if isinstance(spec, FilmJob):
            raise NotFoundError("A film is made of recordings: it has no archive.")
        policy = spec.policy
        if isinstance(policy, CheckpointPolicy):
            return self._services.files.read(policy.id)
        if isinstance(policy, UploadedPolicy):
            with self._services.database.read() as session:
                return iter([UploadRepository(session).graph(policy.id)])
        if policy is None:
            raise NotFoundError("This job needs no policy.")
        if isinstance(policy, BaselineName):
            raise NotFoundError(f"The baseline {policy.name} has no archive.")
        return iter([find(policy.name).archive.read_bytes()])

    def recording(self, job_id: str, attempt: int, number: int) -> BinaryIO:
        """What a film's policy of that number did, open: removed meanwhile, it can be read to its end.

        Raises:
            FencedError: the attempt is over.
            NotFoundError: it is not kept any more, or the job needs none of that number.
        """
        job = self.current(job_id, attempt)
        spec = JOB_SPEC.validate_python(job.spec)
        if not isinstance(spec, FilmJob) or not 0 <= number < len(spec.film.policies):
            raise NotFoundError(f"Job {job_id} needs no recording {number}.")
        policy = spec.film.policies[number]
        results = self._services.results
        look = results.peek if job.priority == AHEAD else results.find
        path = look(result_name("replay", policy.recording))
        try:
            if path is not None:
                return path.open("rb")
        except FileNotFoundError:
            pass  # it went in this moment
        raise NotFoundError(f"What {policy.title} did is not kept any more.")

    def bag(self, job_id: str, attempt: int) -> bytes:
        """The robot's recording that the job reads.

        Raises:
            FencedError: the attempt is over.
            NotFoundError: the recording was deleted, or the job reads none.
        """
        spec = JOB_SPEC.validate_python(self.current(job_id, attempt).spec)
        if not isinstance(spec, BagJob):
            raise NotFoundError("This job reads no recording.")
        with self._services.database.read() as session:
            return BagRepository(session).get(spec.bag).content

    def end(self, job_id: str, attempt: int, end: JobEnd) -> None:
        """The worker has said its last word; said again, because the answer got lost, it changes nothing.

        Raises:
            FencedError: the attempt is over.
        """
        with self._services.database.write() as session:
            row = session.get(tables.Job, job_id, with_for_update=True)
            if row is not None and row.attempt == attempt and row.state in ("done", "failed"):
                return
            job = _unfenced(row, job_id, attempt)
            match end.outcome:
                case "done":
                    _end(session, job, "done", None)
                case "failed":
                    _end(session, job, "failed", end.error or "It failed.")
                case "released":
                    _requeue(job)
                case "lost":
                    _lose(session, job, end.error or "Its process died.", self.board.workers())
        self._told(job)

    def evaluated(self, job_id: str, attempt: int, measurement: Measurement) -> None:
        """Keep what came out of an evaluation.

        Raises:
            FencedError: the attempt is over.
        """
        with self._services.database.write() as session:
            job = _unfenced(session.get(tables.Job, job_id), job_id, attempt)
            PolicyEvaluationRepository(session).measured(job.id, measurement)

    # -- the sweeper ------------------------------------------------------------------------------------------------------

    def lose_expired(self) -> None:
        """Put jobs whose worker has fallen silent back into the queue, or give them up."""
        leases = self._services.job_leases
        with self._services.database.read() as session:
            running = [(job.id, job.attempt) for job in JobRepository(session).running()]
        silent = [job_id for job_id, _ in leases.expired(running)]
        if not silent:
            return
        with self._services.database.write() as session:
            jobs = [
                job
                for job in JobRepository(session).running(for_update=True, ids=silent)
                if leases.is_expired(job.id, job.attempt)
            ]
            for job in jobs:
                reason = f"worker {job.worker} was not heard of for {self._services.settings.lease_seconds:g} s."
                _lose(session, job, reason, self.board.workers())
        for job in jobs:
            self._told(job)

    def forget_old(self) -> None:
        """Forget what ended long ago."""
        with self._services.database.write() as session:
            JobRepository(session).forget(time.time() - KEPT_SECONDS)

    def cancel_all(self, kind: JobKind) -> None:
        """Cancel all jobs of a kind: of a server that was started anew nobody has a view open."""
        with self._services.database.write() as session:
            for job in JobRepository(session).open_of_kind(kind):
                _end(session, job, "cancelled", "The server was started anew.")

    def _told(self, job: tables.Job) -> None:
        """After a change: tell whoever waits."""
        if job.state == "queued":
            self.board.leave(job.id)
            self.board.ring()
        else:
            self.board.end(job.id)


def queue(session: Session, asked: Asked) -> str:
    """Put a job into the queue, in the caller's transaction; see `JobService.ask`."""
    repository = JobRepository(session)
    priority = AHEAD if asked.ahead else LONG if is_long(asked.spec) else KINDS.index(asked.spec.kind)
    if (job := repository.open_of(asked.key)) is not None:
        if priority < job.priority:
            # It was to be made ahead, and is waited for now.
            job.priority, job.title = priority, asked.title[:200]
        return job.id
    if asked.ahead and repository.count_ahead() >= MAX_AHEAD:
        raise BusyError(f"{MAX_AHEAD} jobs that nobody waits for are to be done already.", retry_after=_COME_AGAIN)
    if repository.count_queued() >= MAX_QUEUED:
        raise BusyError(f"{MAX_QUEUED} jobs wait for a worker already. Try again in a moment.", retry_after=_COME_AGAIN)
    job = tables.Job(
        id=new_id(),
        kind=asked.spec.kind,
        key=asked.key,
        title=asked.title[:200],
        spec=asked.spec.model_dump(mode="json"),
        sha256=asked.sha256,
        priority=priority,
    )
    session.add(job)
    session.flush()
    return job.id


def _unfenced(job: tables.Job | None, job_id: str, attempt: int) -> tables.Job:
    if job is None:
        raise FencedError(NotFoundError.of("job", job_id).message)
    if job.attempt != attempt or job.state != "running":
        raise FencedError(f"Attempt {attempt} of job {job.id} is over: it is {job.state} at attempt {job.attempt}.")
    return job


def _requeue(job: tables.Job) -> None:
    job.state, job.worker, job.claim_id = "queued", None, None


def _lose(session: Session, job: tables.Job, reason: str, others: Sequence[str]) -> None:
    """The attempt was lost: another one may do better, unless too many were."""
    count_loss(job)
    lost = f"Attempt {job.attempt}: {reason}"
    job.error = f"{job.error}\n{lost}" if job.error else lost
    if too_many(job, others):
        _end(session, job, "failed", f"{job.losses} attempts were lost.\n{job.error}")
    else:
        _requeue(job)


def _end(session: Session, job: tables.Job, state: tables.JobState, error: str | None) -> None:
    job.state, job.error, job.finished_at = state, error, time.time()
    job.claim_id = None
    if job.kind == "evaluate" and state != "done":
        PolicyEvaluationRepository(session).given_up(job.id, error or "It failed.")


def _with_geometry(spec: JobSpec, arenas: ArenaStore) -> JobSpec:
    """The job as a worker needs it: imported arenas with what stands in them.

    Raises:
        NotFoundError: the arena's file is gone.
    """
    if not isinstance(spec, EvaluateJob | ReplayJob):
        return spec
    if isinstance(spec.suite, ScenarioSuite):
        documents = tuple(arenas.get(sha256).document for sha256 in spec.suite.arenas)
        return spec.model_copy(update={"suite": spec.suite.model_copy(update={"documents": documents})})
    if not isinstance(spec.suite, ArenaSuite):
        return spec
    arena = spec.suite.arena
    if not isinstance(arena, ImportedArenaConfig) or arena.arena is not None:
        return spec
    whole = arena.model_copy(update={"arena": arenas.get(arena.sha256).document})
    return spec.model_copy(update={"suite": ArenaSuite(arena=whole)})

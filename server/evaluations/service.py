"""What a person may do with evaluations: ask for one, look at it, delete it."""

import hashlib

from pydantic import TypeAdapter

from server.database import tables
from server.errors import ConflictError, NotFoundError, UnusableArenaError
from server.estimates import success_estimate
from server.evaluations.repository import PolicyEvaluationRepository, episodes_of
from server.evaluations.schemas import (
    AskedEpisodes,
    AskedEvaluation,
    AskedEvaluationPage,
    EvaluationFigures,
    EvaluationRequest,
)
from server.evaluations.subjects import measured
from server.ids import new_id
from server.jobs.asked import Asked
from server.jobs.repository import OPEN, JobRepository
from server.jobs.service import queue
from server.jobs.views import seconds_left
from server.paging import Window
from server.replays.simulator import simulator
from server.services import Services
from sim.config import ImportedArenaConfig
from workers.job_protocol import AnyPolicy, ArenaSuite, EvaluateJob, SuiteChoice
from workers.shipped.figures import Figures

_POLICY: TypeAdapter[AnyPolicy] = TypeAdapter(AnyPolicy)
_CHOICE: TypeAdapter[SuiteChoice] = TypeAdapter(SuiteChoice)


def ask(services: Services, request: EvaluationRequest) -> AskedEvaluation:
    """Put an evaluation into the queue; one that is measured, or under way, already is that one.

    Raises:
        NotFoundError: there is no such policy.
        UnusableArenaError: the imported arena is not here.
        BusyError: as many jobs wait as may.
    """
    choice = _with_stored_arena(services, request.suite)
    spec = EvaluateJob(policy=request.policy, suite=choice)
    with services.database.write() as session:
        subject = measured(session, request.policy)
        key = f"evaluate-{_digest(spec, subject.sha256)}"
        repository = PolicyEvaluationRepository(session)
        evaluation = repository.alike(key)
        if evaluation is None:
            evaluation = tables.PolicyEvaluation(
                id=new_id(),
                job_id=queue(session, Asked(spec, key, subject.title, subject.sha256)),
                key=key,
                title=subject.title[:200],
                policy=request.policy.model_dump(mode="json"),
                choice=choice.model_dump(mode="json"),
                arrival_distance=subject.task.arrival_distance,
            )
            session.add(evaluation)
            session.flush()
        job = session.get(tables.Job, evaluation.job_id)
    services.board.ring()
    return _view(services, evaluation, job)


def some(services: Services, window: Window) -> AskedEvaluationPage:
    """Some of them, the newest first."""
    with services.database.read() as session:
        rows, total = PolicyEvaluationRepository(session).page(window)
        jobs = JobRepository(session).several([row.job_id for row in rows])
    return AskedEvaluationPage(items=[_view(services, row, jobs.get(row.job_id)) for row in rows], total=total)


def one(services: Services, evaluation_id: str) -> AskedEvaluation:
    """One of them.

    Raises:
        NotFoundError: there is no such evaluation.
    """
    with services.database.read() as session:
        evaluation = PolicyEvaluationRepository(session).get(evaluation_id)
        job = session.get(tables.Job, evaluation.job_id)
    return _view(services, evaluation, job)


def episodes(services: Services, evaluation_id: str) -> AskedEpisodes:
    """Every episode behind its figures.

    Raises:
        NotFoundError: there is no such evaluation.
    """
    with services.database.read() as session:
        evaluation = PolicyEvaluationRepository(session).get(evaluation_id, with_episodes=True)
        found = episodes_of(evaluation)
    return AskedEpisodes(suite=evaluation.suite, suite_hash=evaluation.suite_hash, episodes=found)


def delete(services: Services, evaluation_id: str) -> None:
    """Forget an evaluation that has ended.

    Raises:
        NotFoundError: there is no such evaluation.
        ConflictError: it is under way.
    """
    with services.database.write() as session:
        evaluation = PolicyEvaluationRepository(session).get(evaluation_id)
        job = session.get(tables.Job, evaluation.job_id)
        if job is not None and job.state in OPEN:
            raise ConflictError("This evaluation is under way: cancel its job first.")
        session.delete(evaluation)


def _view(services: Services, evaluation: tables.PolicyEvaluation, job: tables.Job | None) -> AskedEvaluation:
    ended: tables.JobState = "done" if evaluation.suite is not None else "failed"
    is_open = job is not None and job.state in OPEN
    return AskedEvaluation(
        id=evaluation.id,
        title=evaluation.title,
        policy=_POLICY.validate_python(evaluation.policy),
        choice=_CHOICE.validate_python(evaluation.choice),
        created_at=evaluation.created_at,
        job_id=evaluation.job_id,
        state=ended if job is None else job.state,
        progress=services.board.progress(evaluation.job_id) if is_open else float(evaluation.suite is not None),
        seconds_left=seconds_left(job, services.board.progress(evaluation.job_id)) if job is not None else None,
        error=evaluation.error,
        suite=evaluation.suite,
        suite_hash=evaluation.suite_hash,
        figures=_figures(evaluation),
    )


def _figures(evaluation: tables.PolicyEvaluation) -> EvaluationFigures | None:
    if evaluation.figures is None:
        return None
    found = Figures.model_validate(evaluation.figures)
    trained = evaluation.policy["source"] != "baseline"
    return EvaluationFigures(
        episodes=found.episodes,
        success=success_estimate([found.arrivals], [found.episodes], trained=trained),
        collision=found.collision,
        timeout=found.timeout,
        spl=found.spl,
        steps=found.steps,
        min_clearance=found.min_clearance,
    )


def _with_stored_arena(services: Services, choice: SuiteChoice) -> SuiteChoice:
    """The choice as the database keeps it: an imported arena by its hash."""
    if not isinstance(choice, ArenaSuite) or not isinstance(choice.arena, ImportedArenaConfig):
        return choice
    if choice.arena.arena is not None:
        services.arenas.add(choice.arena.arena)
        return ArenaSuite(arena=choice.arena.model_copy(update={"arena": None}))
    try:
        services.arenas.get(choice.arena.sha256)
    except NotFoundError as error:
        raise UnusableArenaError(
            "This imported arena is not here: choose one in the gallery, or import its file there first."
        ) from error
    return choice


def _digest(spec: EvaluateJob, sha256: str | None) -> str:
    """What decides how an evaluation ends: the policy's bytes, the suite, and what drives.

    A checkpoint's id says nothing that its archive's hash does not.
    """
    policy = spec.policy.model_dump_json() if sha256 is None else sha256
    return hashlib.sha256(f"{policy}\n{spec.suite.model_dump_json()}\n{simulator()}".encode()).hexdigest()

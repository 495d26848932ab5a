"""What a person may do with evaluations: ask for some, look at them, call them off, delete them."""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from pydantic import TypeAdapter
from sqlalchemy.orm import Session

from server.database import tables
from server.errors import ConflictError, InvalidRequestError, NotFoundError, UnusableArenaError
from server.evaluations.export import EvaluationFile, ExportFormat, exported
from server.evaluations.figures import merits
from server.evaluations.pairings import refuse_impossible
from server.evaluations.repository import PolicyEvaluationRepository, Wanted, episodes_of
from server.evaluations.schemas import (
    MAX_AT_ONCE,
    MAX_BEHIND,
    AskedEpisodes,
    AskedEvaluation,
    AskedEvaluationPage,
    EvaluationFigures,
    EvaluationRequest,
    EvaluationWays,
)
from server.evaluations.subjects import Measured, measured, suite_title, wanted_policies
from server.evaluations.ways import unpacked, ways_in
from server.http.paging import Window
from server.ids import new_id
from server.jobs.asked import Asked
from server.jobs.repository import OPEN, JobRepository
from server.jobs.service import JobService, queue
from server.jobs.turns import Turn
from server.jobs.views import seconds_left
from server.replays.simulator import simulator
from server.replays.subject import Subject
from server.security.principal import Principal
from server.services import Services
from server.suites.repository import SuiteRepository
from sim.config import ImportedArenaConfig, TaskConfig
from sim.extending.discovery import UsedExtension
from workers.job_protocol import (
    AnyPolicy,
    ArenaSuite,
    CheckpointPolicy,
    EvaluateJob,
    ScenarioSuite,
    SuiteChoice,
    UploadedPolicy,
)
from workers.reporting import EvaluationResult

_POLICY: TypeAdapter[AnyPolicy] = TypeAdapter(AnyPolicy)
_CHOICE: TypeAdapter[SuiteChoice] = TypeAdapter(SuiteChoice)


def ask(services: Services, request: EvaluationRequest, principal: Principal) -> list[AskedEvaluation]:
    """Put evaluations into the queue, all or none; one that is measured, or under way, already is that one.

    Raises:
        NotFoundError: there is no such policy, or it may not be seen; or no such suite.
        UnusableArenaError: the imported arena is not here.
        InvalidRequestError: these are too many at once, a suite has no scenario, or is for another robot than a policy's.
        BusyError: as many jobs wait as may.
    """
    choices = [_with_scenarios(services, _with_stored_arena(services, suite)) for suite in request.suites]
    asked: list[tuple[tables.PolicyEvaluation, tables.Job | None, str | None]] = []
    with services.database.write() as session:
        policies = wanted_policies(session, request.policies, principal)
        if len(policies) * len(choices) > MAX_AT_ONCE:
            raise InvalidRequestError(
                f"These are {len(policies) * len(choices)} evaluations, one for each run of a training: "
                f"ask for at most {MAX_AT_ONCE} at once."
            )
        refuse_impossible([subject for _, subject in policies], choices)
        for policy, subject in policies:
            for choice in choices:
                evaluation = _queued(session, subject, EvaluateJob(policy=policy, suite=choice))
                job = session.get(tables.Job, evaluation.job_id)
                asked.append((evaluation, job, PolicyEvaluationRepository(session).run_of(evaluation)))
    services.board.ring()
    waiting = _waiting(services, [job for _, job, _ in asked if job is not None])
    return [_view(services, *each, waiting) for each in asked]


def _queued(session: Session, subject: Measured, spec: EvaluateJob) -> tables.PolicyEvaluation:
    key = f"evaluate-{_digest(spec, subject.sha256)}"
    evaluation = PolicyEvaluationRepository(session).alike(key)
    if evaluation is None:
        evaluation = tables.PolicyEvaluation(
            id=new_id(),
            job_id=queue(session, Asked(spec, key, f"{subject.title} on {suite_title(spec.suite)}", subject.sha256)),
            key=key,
            title=subject.title[:200],
            policy=spec.policy.model_dump(mode="json"),
            choice=spec.suite.model_dump(mode="json"),
            checkpoint_id=spec.policy.id if isinstance(spec.policy, CheckpointPolicy) else None,
            upload_id=spec.policy.id if isinstance(spec.policy, UploadedPolicy) else None,
        )
        session.add(evaluation)
        session.flush()
    return evaluation


def some(services: Services, window: Window, wanted: Wanted) -> AskedEvaluationPage:
    """Some of them, the newest first."""
    with services.database.read() as session:
        rows, total = PolicyEvaluationRepository(session).page(window, wanted)
        jobs = JobRepository(session).several([row.job_id for row, _ in rows])
    waiting = _waiting(services, list(jobs.values()))
    return AskedEvaluationPage(
        items=[_view(services, row, jobs.get(row.job_id), run_id, waiting) for row, run_id in rows], total=total
    )


def one(services: Services, evaluation_id: str) -> AskedEvaluation:
    """One of them.

    Raises:
        NotFoundError: there is no such evaluation.
    """
    with services.database.read() as session:
        repository = PolicyEvaluationRepository(session)
        evaluation = repository.get(evaluation_id)
        job, run_id = session.get(tables.Job, evaluation.job_id), repository.run_of(evaluation)
    return _view(services, evaluation, job, run_id, _waiting(services, [job] if job is not None else []))


def measured_on(services: Services, evaluation_id: str) -> str | None:
    """The hash of the suite that it was measured on, which it is once; None before.

    Raises:
        NotFoundError: there is no such evaluation.
    """
    with services.database.read() as session:
        return PolicyEvaluationRepository(session).get(evaluation_id).suite_hash


def episodes(services: Services, evaluation_id: str) -> AskedEpisodes:
    """Every episode behind its figures.

    Raises:
        NotFoundError: there is no such evaluation.
    """
    evaluation = _whole(services, evaluation_id)
    found = episodes_of(evaluation)
    kept = unpacked(evaluation.ways) if evaluation.ways else None
    return AskedEpisodes(
        suite=evaluation.suite,
        suite_hash=evaluation.suite_hash,
        episodes=found,
        maps=tuple(kept.arenas[index].name for index in kept.arena_indices) if kept else (),
        spl=tuple(merits(found, TaskConfig.model_validate(evaluation.task))) if evaluation.task else (),
    )


def export(services: Services, evaluation_id: str, wanted: ExportFormat) -> EvaluationFile:
    """One of its files.

    Raises:
        NotFoundError: there is no such evaluation, or it is not measured.
    """
    return exported(_whole(services, evaluation_id), wanted)


def ways(services: Services, evaluation_id: str, arena: int | None) -> EvaluationWays:
    """Where its robots drove in one of the suite's arenas; the one with the lowest success where none is named.

    Raises:
        NotFoundError: there is no such evaluation, or no such arena, or it is not measured.
    """
    evaluation = _whole(services, evaluation_id)
    if evaluation.ways is None:
        raise NotFoundError("Where the robots drove is not known: it is not measured yet, or takes too much room to keep.")
    return ways_in(evaluation.ways, episodes_of(evaluation), arena)


def replayed(services: Services, evaluation_id: str) -> Subject:
    """Whose episodes are to be driven again.

    Raises:
        NotFoundError: there is no such evaluation, or it is not measured.
    """
    evaluation = _whole(services, evaluation_id)
    if evaluation.suite is None or evaluation.suite_hash is None or evaluation.task is None:
        raise NotFoundError("This evaluation is not measured yet: it has no episodes.")
    policy = _POLICY.validate_python(evaluation.policy)
    with services.database.read() as session:
        subject = measured(session, policy)
    return Subject(
        title=evaluation.title,
        file_name=f"mapless-evaluation-{evaluation.id}.zip",
        task=TaskConfig.model_validate(evaluation.task),
        sha256=subject.sha256,
        suite=_CHOICE.validate_python(evaluation.choice),
        recorded=EvaluationResult(
            suite=evaluation.suite, suite_hash=evaluation.suite_hash, episodes=episodes_of(evaluation)
        ),
        policy=policy,
    )


def cancel(services: Services, evaluation_id: str) -> AskedEvaluation:
    """Nobody wants it any more; one that has ended stays as it is.

    Raises:
        NotFoundError: there is no such evaluation.
    """
    asked = one(services, evaluation_id)
    if asked.state in OPEN:
        JobService(services).cancel(asked.job_id)
    return one(services, evaluation_id)


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
            raise ConflictError("This evaluation is under way: cancel it first.")
        session.delete(evaluation)


def _whole(services: Services, evaluation_id: str) -> tables.PolicyEvaluation:
    with services.database.read() as session:
        return PolicyEvaluationRepository(session).get(evaluation_id, whole=True)


@dataclass(frozen=True)
class _Waiting:
    """Why jobs wait, by their ids: for extensions, and behind others."""

    lacking: Mapping[str, tuple[UsedExtension, ...]]
    turns: Mapping[str, Turn]


def _waiting(services: Services, jobs: Sequence[tables.Job]) -> _Waiting:
    service = JobService(services)
    return _Waiting(service.lacking_each(jobs), service.turns(jobs))


def _view(
    services: Services,
    evaluation: tables.PolicyEvaluation,
    job: tables.Job | None,
    run_id: str | None,
    waiting: _Waiting,
) -> AskedEvaluation:
    turn = waiting.turns.get(evaluation.job_id)
    ended: tables.JobState = "done" if evaluation.suite is not None else "failed"
    is_open = job is not None and job.state in OPEN
    return AskedEvaluation(
        id=evaluation.id,
        title=evaluation.title,
        policy=_POLICY.validate_python(evaluation.policy),
        choice=_CHOICE.validate_python(evaluation.choice),
        run_id=run_id,
        created_at=evaluation.created_at,
        job_id=evaluation.job_id,
        state=ended if job is None else job.state,
        progress=services.board.progress(evaluation.job_id) if is_open else float(evaluation.suite is not None),
        seconds_left=seconds_left(job, services.board.progress(evaluation.job_id)) if job is not None else None,
        error=evaluation.error,
        waits_for=list(waiting.lacking.get(evaluation.job_id, ())),
        behind=list(turn.behind[:MAX_BEHIND]) if turn else [],
        starts_in=turn.starts_in if turn else None,
        suite=evaluation.suite,
        suite_hash=evaluation.suite_hash,
        figures=None if evaluation.figures is None else EvaluationFigures.model_validate(evaluation.figures),
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


def _with_scenarios(services: Services, choice: SuiteChoice) -> SuiteChoice:
    """The choice as the database keeps it: a suite of one's own with the scenarios that it has now, by their hashes."""
    if not isinstance(choice, ScenarioSuite):
        return choice
    with services.database.read() as session:
        suite = SuiteRepository(session).get(choice.id)
        if not suite.scenarios:
            raise InvalidRequestError(f"The suite {suite.name!r} has no scenario yet: add one first.")
        return ScenarioSuite(id=suite.id, name=suite.name, arenas=tuple(one["sha256"] for one in suite.scenarios))


def _digest(spec: EvaluateJob, sha256: str | None) -> str:
    """What decides how an evaluation ends and who may see it: the policy and its bytes, the suite, and what drives."""
    policy = spec.policy.model_dump_json()
    return hashlib.sha256(f"{policy} {sha256}\n{spec.suite.model_dump_json()}\n{simulator()}".encode()).hexdigest()

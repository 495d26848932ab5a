"""What a project has beside its runs, out and in: arenas, uploaded policies, robots' recordings, evaluations asked for.

Each is taken whole or not at all. Where one of its id is here already it is left as it is.
"""

import hashlib
import zlib
from collections.abc import Iterator

from pydantic import TypeAdapter
from sqlalchemy.orm import Session

from server.arenas.store import ArenaStore
from server.bags.repository import BagRepository
from server.bags.service import MAX_BAGS
from server.database import tables
from server.errors import ConflictError, CorruptUploadError, NotFoundError
from server.evaluations.repository import PolicyEvaluationRepository, encode_episodes, episodes_of
from server.evaluations.schemas import EvaluationFigures
from server.evaluations.ways import unpacked
from server.ids import new_id
from server.project_archives.repository import ProjectArchiveRepository
from server.project_archives.schemas import ArchivedAskedEvaluation, ArchivedPolicy, ArchivedRecording
from server.uploads.repository import UploadRepository
from server.uploads.service import MAX_UPLOADS
from sim.config import ArenaFile, ImportedArenaConfig, TaskConfig
from workers.job_protocol import (
    AnyPolicy,
    ArenaSuite,
    CheckpointPolicy,
    ScenarioSuite,
    ShippedPolicyName,
    SuiteChoice,
    UploadedPolicy,
)
from workers.reporting import EvaluationResult
from workers.shipped.library import shipped_policies

_CHOICE: TypeAdapter[SuiteChoice] = TypeAdapter(SuiteChoice)


def arenas_of(session: Session, store: ArenaStore, project_id: str) -> Iterator[ArenaFile]:
    """The imported arenas that a project's trainings and evaluations use, as far as they are there; each once."""
    repository = ProjectArchiveRepository(session)
    hashes = set(repository.arenas(project_id))
    for evaluation_id in repository.evaluations(project_id):
        choice = _CHOICE.validate_python(PolicyEvaluationRepository(session).get(evaluation_id).choice)
        if isinstance(choice, ArenaSuite) and isinstance(choice.arena, ImportedArenaConfig):
            hashes.add(choice.arena.sha256)
        elif isinstance(choice, ScenarioSuite):
            hashes.update(choice.arenas)
    for sha256 in sorted(hashes):
        try:
            yield store.get(sha256).document
        except NotFoundError:
            continue


def take_arena(store: ArenaStore, sha256: str, arena: ArenaFile) -> bool:
    """Keep an arena; False where it was here.

    Raises:
        CorruptUploadError: it is not that of the hash.
        ConflictError: there are too many.
    """
    if arena.sha256 != sha256:
        raise CorruptUploadError("it is not the arena of its hash")
    if store.name(sha256) is not None:
        return False
    store.add(arena)
    return True


def archived_policy(row: tables.UploadedPolicy) -> ArchivedPolicy:
    """An uploaded policy without its file."""
    return ArchivedPolicy(
        id=row.id,
        name=row.name,
        task=TaskConfig.model_validate(row.task),
        sha256=row.sha256,
        size=row.size,
        created_at=row.created_at,
    )


def take_policy(session: Session, project_id: str, archived: ArchivedPolicy, graph: bytes) -> bool:
    """Add an uploaded policy; False where it was here.

    Raises:
        CorruptUploadError: the file is not the one that was announced.
        ConflictError: there is another one of its id, or there are too many.
    """
    if len(graph) != archived.size or hashlib.sha256(graph).hexdigest() != archived.sha256:
        raise CorruptUploadError("its SHA-256 is not the one that was announced")
    known = session.get(tables.UploadedPolicy, archived.id)
    if known is not None:
        if known.project_id != project_id or known.sha256 != archived.sha256:
            raise ConflictError(f"This server has another policy of the id {archived.id}.")
        return False
    repository = UploadRepository(session)
    if repository.count() >= MAX_UPLOADS:
        raise ConflictError(f"There are {MAX_UPLOADS} uploaded policies already: delete some first.")
    told = archived.model_dump(exclude={"task"})
    task = archived.task.model_dump(mode="json")
    repository.add(tables.UploadedPolicy(**told, task=task, project_id=project_id, graph=graph))
    return True


def archived_recording(row: tables.Bag) -> ArchivedRecording:
    """What a robot recorded, without its file."""
    return ArchivedRecording(id=row.id, name=row.name, sha256=row.sha256, size=row.size, created_at=row.created_at)


def take_recording(session: Session, project_id: str, archived: ArchivedRecording, content: bytes) -> bool:
    """Add what a robot recorded; False where it was here.

    Raises:
        CorruptUploadError: the file is not the one that was announced.
        ConflictError: there is another one of its id, or there are too many.
    """
    if len(content) != archived.size or hashlib.sha256(content).hexdigest() != archived.sha256:
        raise CorruptUploadError(f"{archived.name} is damaged: its SHA-256 is not the one that was announced")
    known = session.get(tables.Bag, archived.id)
    if known is not None:
        if known.project_id != project_id or known.sha256 != archived.sha256:
            raise ConflictError(f"This server has another recording of the id {archived.id}.")
        return False
    repository = BagRepository(session)
    if repository.count() >= MAX_BAGS:
        raise ConflictError(f"There are {MAX_BAGS} recordings already: delete some first.")
    repository.add(tables.Bag(**archived.model_dump(), project_id=project_id, content=content))
    return True


def archived_evaluation(session: Session, evaluation_id: str) -> ArchivedAskedEvaluation | None:
    """An evaluation that was asked for; None where it is gone, or not measured yet."""
    try:
        row = PolicyEvaluationRepository(session).get(evaluation_id, whole=True)
    except NotFoundError:
        return None
    episodes = episodes_of(row)
    if row.error is None and not (episodes and row.suite and row.suite_hash):
        return None
    result = None
    if episodes and row.suite and row.suite_hash:
        result = EvaluationResult(suite=row.suite, suite_hash=row.suite_hash, episodes=episodes)
    return ArchivedAskedEvaluation.model_validate(
        {
            "id": row.id,
            "title": row.title,
            "policy": row.policy,
            "choice": row.choice,
            "created_at": row.created_at,
            "error": row.error,
            "figures": row.figures and EvaluationFigures.model_validate(row.figures),
            "task": row.task,
            "result": result,
            "ways": unpacked(row.ways) if row.ways else None,
        }
    )


def take_evaluation(session: Session, project_id: str, archived: ArchivedAskedEvaluation, *, of_everybodys: bool) -> bool:
    """Add an evaluation that was asked for; False where it was here.

    Args:
        session: a transaction that writes.
        project_id: of the project that it comes with.
        archived: the evaluation.
        of_everybodys: whether it may be of a shipped policy or a baseline, which everybody sees.

    Raises:
        ConflictError: there is another one of its id, its policy is none of the project, or may not be measured so.
    """
    known = session.get(tables.PolicyEvaluation, archived.id)
    if known is not None:
        if known.created_at != archived.created_at:
            raise ConflictError(f"This server has another evaluation of the id {archived.id}.")
        return False
    checkpoint_id, upload_id = _measured_in(session, project_id, archived.policy, of_everybodys=of_everybodys)
    result = archived.result
    session.add(
        tables.PolicyEvaluation(
            id=archived.id,
            # Its job was another server's, with the simulator of that time: who asks here is answered by a new one.
            job_id=new_id(),
            key=f"imported-{archived.id}",
            title=archived.title,
            policy=archived.policy.model_dump(mode="json"),
            choice=archived.choice.model_dump(mode="json"),
            checkpoint_id=checkpoint_id,
            upload_id=upload_id,
            created_at=archived.created_at,
            error=archived.error,
            suite=result.suite if result else None,
            suite_hash=result.suite_hash if result else None,
            figures=archived.figures.model_dump(mode="json") if archived.figures else None,
            task=archived.task.model_dump(mode="json") if archived.task else None,
            episodes=encode_episodes(result.episodes) if result else None,
            ways=zlib.compress(archived.ways.model_dump_json().encode()) if archived.ways else None,
        )
    )
    return True


def _measured_in(
    session: Session, project_id: str, policy: AnyPolicy, *, of_everybodys: bool
) -> tuple[str | None, str | None]:
    """The ids of the checkpoint and of the upload that a policy is, where it is one of these.

    Raises:
        ConflictError: it is none of the project, or is not here.
    """
    if isinstance(policy, CheckpointPolicy | UploadedPolicy):
        of_checkpoint = isinstance(policy, CheckpointPolicy)
        if not ProjectArchiveRepository(session).has_policy(project_id, policy.id, of_checkpoint=of_checkpoint):
            raise ConflictError(f"The policy {policy.id} that it measures is not in this project.")
        return (policy.id, None) if of_checkpoint else (None, policy.id)
    if not of_everybodys:
        raise ConflictError("It measures what is everybody's: an administrator of the installation brings it in.")
    if isinstance(policy, ShippedPolicyName) and all(policy.name != each.card.name for each in shipped_policies()):
        raise ConflictError(f"The policy {policy.name} that it measures does not come with this version.")
    return None, None

"""Opens playgrounds: which policy, and where."""

from pydantic import ValidationError
from sqlalchemy.orm import Session

from server.checkpoints.repository import CheckpointRepository
from server.errors import MisplacedError, NotFoundError, UnusableArenaError
from server.evaluations.subjects import wanted_policies
from server.experiments.stored import training_of
from server.ids import new_id
from server.playground.ground import Ground
from server.playground.registry import PLAY_PREFIX, owner_of
from server.playground.schemas import PlaygroundRequest
from server.policies.service import find
from server.runs.repository import RunRepository
from server.security.principal import Principal
from server.services import Services
from sim.arenas import arena_clearance, build_arena, with_maps_of
from sim.arenas.document import check_free_space, to_document
from sim.config import AnyArenaConfig, ArenaFile, ImportedArenaConfig, TaskConfig
from sim.errors import ArenaError, NoFreeSpaceError
from workers.job_protocol import BaselineName, CheckpointPolicy, PlayedPolicy, UploadedPolicy
from workers.play_protocol import MAX_OBSTACLES


def open_playground(services: Services, request: PlaygroundRequest, principal: Principal) -> Ground:
    """A playground of somebody's own.

    Raises:
        NotFoundError: there is no such policy or arena, or it may not be seen.
        UnusableArenaError: too much stands in the arena.
        BusyError: too many are open.
    """
    with services.database.read() as session:
        ((policy, subject),) = wanted_policies(session, [request.policy], principal)
        assert not isinstance(policy, BaselineName)
        task = _task_of(session, policy)
    assert subject.sha256 is not None
    ground = Ground(
        id=f"{PLAY_PREFIX}{new_id()}",
        owner=owner_of(principal),
        title=subject.title,
        policy=policy,
        sha256=subject.sha256,
        task=task,
        arena=_arena(services, request.arena or task.arena, task),
    )
    services.playgrounds.add(ground)
    return ground


def keep_arena(services: Services, ground: Ground, name: str) -> ImportedArenaConfig:
    """The arena as it stands now, in the gallery.

    Raises:
        MisplacedError: nothing has driven yet, or it is not an arena.
        ConflictError: there are too many arenas.
    """
    try:
        document = ArenaFile.model_validate({**ground.moment().model_dump(), "name": name})
        check_free_space(document)
    except (ValidationError, NoFreeSpaceError) as error:
        reason = error.errors()[0]["msg"] if isinstance(error, ValidationError) else str(error)
        raise MisplacedError(f"This can't be kept: {reason}") from error
    return ImportedArenaConfig(sha256=services.arenas.add(document))


def _task_of(session: Session, policy: PlayedPolicy) -> TaskConfig:
    if isinstance(policy, UploadedPolicy):
        return policy.task or TaskConfig()
    if isinstance(policy, CheckpointPolicy):
        run = RunRepository(session).get(CheckpointRepository(session).get(policy.id).run_id)
        return with_maps_of(training_of(run.experiment).task, run.seed)
    shipped = find(policy.name)
    return with_maps_of(shipped.card.training.task, shipped.card.seed)


def _arena(services: Services, config: AnyArenaConfig, task: TaskConfig) -> ArenaFile:
    if isinstance(config, ImportedArenaConfig) and config.arena is None:
        if not config.sha256:
            raise NotFoundError("Choose an arena first.")
        config = config.model_copy(update={"arena": services.arenas.get(config.sha256).document})
    try:
        document = to_document(build_arena(config, 0, clearance=arena_clearance(task)))
    except (ArenaError, ValidationError) as error:
        raise UnusableArenaError(f"This arena can't be played in: {error}") from error
    count = len(document.circles) + len(document.boxes)
    if count > MAX_OBSTACLES:
        raise UnusableArenaError(
            f"{count} obstacles stand in this arena, and a playground takes {MAX_OBSTACLES}: choose another one."
        )
    return document

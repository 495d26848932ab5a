"""Imported arenas in configurations: the database keeps the hash, a worker and its checkpoints carry the geometry.

So rows and lists stay small, and yet no worker, no checkpoint and nobody who downloads one needs the server's files.
"""

from server.arenas.store import ArenaStore
from server.errors import NotFoundError, UnusableArenaError
from sim.config import AnyArenaConfig, ImportedArenaConfig
from workers.config import TrainingConfig


def without_geometry(training: TrainingConfig, store: ArenaStore) -> TrainingConfig:
    """The training as the database keeps it; geometry that comes along is put into the store.

    Raises:
        UnusableArenaError: the arena is neither there nor comes along.
    """
    arena = training.task.arena
    if not isinstance(arena, ImportedArenaConfig):
        return training
    if arena.arena is not None:
        store.add(arena.arena)
        return _with_arena(training, arena.model_copy(update={"arena": None}))
    try:
        store.get(arena.sha256)
    except NotFoundError as error:
        raise UnusableArenaError(
            "This imported arena is not here: choose one in the gallery, or import its file there first."
        ) from error
    return training


def with_geometry(training: TrainingConfig, store: ArenaStore) -> TrainingConfig:
    """The training as a worker needs it.

    Raises:
        NotFoundError: the arena's file is gone.
    """
    arena = training.task.arena
    if not isinstance(arena, ImportedArenaConfig) or arena.arena is not None:
        return training
    return _with_arena(training, ImportedArenaConfig.of(store.get(arena.sha256).document))


def _with_arena(training: TrainingConfig, arena: AnyArenaConfig) -> TrainingConfig:
    return training.model_copy(update={"task": training.task.model_copy(update={"arena": arena})})

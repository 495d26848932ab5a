"""From a configuration to the arenas that it names."""

from dataclasses import replace

from sim.arenas.builtin import BUILTIN
from sim.arenas.document import to_arena
from sim.arenas.families import CLEARANCE, generate_arena, pool_seeds
from sim.arenas.geometry import Arena
from sim.arenas.mover import Mover
from sim.config import AddedArenaPool, AnyArenaConfig, ArenaConfig, ArenaPool, GeneratedArenaConfig, MoversConfig, TaskConfig
from sim.errors import ArenaError
from sim.streams import MAPS, stream_seed

_ROOM = 0.05  # m between what a robot keeps from obstacles and the way that is left for it: what the default one has


def build_arenas(config: AnyArenaConfig, *, clearance: float = CLEARANCE) -> tuple[Arena, ...]:
    """The arenas that a configuration names: one, or the pool of a family; 1 to 8 ms for each of a pool at 10 x 10 m.

    Args:
        config: built in, generated, or imported with its geometry.
        clearance: what the robot needs around its centre in a generated arena, metres.

    Raises:
        ArenaError: an imported arena comes without its geometry or gets too many movers, or the robot is too large for a
            family.
    """
    if isinstance(config, ArenaConfig):
        return (with_movers(BUILTIN[config.name](), config.movers),)
    if isinstance(config, ArenaPool):
        return tuple(build_arena(config, index, clearance=clearance) for index in range(config.maps))
    if config.arena is None:
        raise ArenaError(
            f"the imported arena {config.sha256[:12] or '(none)'} is here by its hash only: read its file with "
            "sim.arenas.files.load_arena and pass ImportedArenaConfig.of(...)"
        )
    return (with_movers(to_arena(config.arena), config.movers),)


def arena_clearance(task: TaskConfig) -> float:
    """What a task's robot needs around its centre in a generated arena, metres: at least what the default one needs."""
    return max(CLEARANCE, task.passable_clearance + _ROOM)


def build_task_arenas(task: TaskConfig) -> tuple[Arena, ...]:
    """The arenas in which a task's robots drive: `build_arenas` with the room that the robot needs.

    Raises:
        ArenaError: as there.
    """
    return build_arenas(task.arena, clearance=arena_clearance(task))


def with_maps_of(task: TaskConfig, seed: int) -> TaskConfig:
    """The task as one training seed meets it: with the pool of maps that is its own, where seeds have pools of their own.

    Args:
        task: of a training; an environment that is made from it as it is has the pool of its map seed.
        seed: of the training.
    """
    arena = task.arena
    if not isinstance(arena, ArenaPool) or not arena.own_maps:
        return task
    own = stream_seed(seed, (*MAPS, arena.seed), bits=31)
    return task.model_copy(update={"arena": arena.model_copy(update={"seed": own, "own_maps": False})})


def build_arena(config: AnyArenaConfig, index: int, *, clearance: float = CLEARANCE) -> Arena:
    """One of the arenas of `build_arenas`, without the trouble of building the others.

    Raises:
        ArenaError: as there.
        IndexError: there are not as many.
    """
    if isinstance(config, ArenaPool):
        return pooled_arena(config, pool_seeds(config.seed, config.maps)[index], clearance=clearance)
    return build_arenas(config, clearance=clearance)[index]


def pooled_arena(config: GeneratedArenaConfig | AddedArenaPool, seed: int, *, clearance: float = CLEARANCE) -> Arena:
    """The arena of a pool's family, difficulty and movers that a seed gives, whether it is in the pool or not.

    Raises:
        ArenaError: as `build_arenas`.
    """
    family = config if isinstance(config, AddedArenaPool) else config.name
    return with_movers(generate_arena(family, config.difficulty, seed, clearance=clearance), config.movers)


def with_movers(arena: Arena, config: MoversConfig) -> Arena:
    """An arena with the movers of a configuration in it, besides those that it has.

    Raises:
        ArenaError: they are too many.
    """
    if not config.count:
        return arena
    added = (Mover(config.kind, config.radius, config.speed, sees_robots=config.sees_robots),) * config.count
    return replace(arena, movers=arena.movers + added)

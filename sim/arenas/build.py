"""From a configuration to the arenas that it names."""

from sim.arenas.builtin import BUILTIN
from sim.arenas.document import to_arena
from sim.arenas.families import CLEARANCE, generate_arena, pool_seeds
from sim.arenas.geometry import Arena
from sim.config import AnyArenaConfig, ArenaConfig, GeneratedArenaConfig
from sim.errors import ArenaError


def build_arenas(config: AnyArenaConfig, *, clearance: float = CLEARANCE) -> tuple[Arena, ...]:
    """The arenas that a configuration names: one, or the pool of a family; 1 to 4 ms for each of a pool.

    Args:
        config: built in, generated, or imported with its geometry.
        clearance: what the robot needs around its centre in a generated arena, metres.

    Raises:
        ArenaError: an imported arena comes without its geometry, or the robot is too large for a family.
    """
    if isinstance(config, ArenaConfig):
        return (BUILTIN[config.name](),)
    if isinstance(config, GeneratedArenaConfig):
        return tuple(build_arena(config, index, clearance=clearance) for index in range(config.maps))
    if config.arena is None:
        raise ArenaError(
            f"the imported arena {config.sha256[:12] or '(none)'} is here by its hash only: read its file with "
            "sim.arenas.files.load_arena and pass ImportedArenaConfig.of(...)"
        )
    return (to_arena(config.arena),)


def build_arena(config: AnyArenaConfig, index: int, *, clearance: float = CLEARANCE) -> Arena:
    """One of the arenas of `build_arenas`, without the trouble of building the others.

    Raises:
        ArenaError: as there.
        IndexError: there are not as many.
    """
    if isinstance(config, GeneratedArenaConfig):
        seed = pool_seeds(config.seed, config.maps)[index]
        return generate_arena(config.name, config.difficulty, seed, clearance=clearance)
    return build_arenas(config, clearance=clearance)[index]

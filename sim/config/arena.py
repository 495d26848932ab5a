"""Where robots drive: built-in arenas, pools that are drawn from a seed, and arenas from files (pydantic only)."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from sim.config.arena_file import ArenaFile
from sim.config.base import ADVANCED, HIDDEN, Frozen
from sim.config.movers import MoversConfig
from sim.extending.discovery import added, complete, with_added
from sim.extending.parts import ArenaFamily

ArenaName = Literal["simple", "complex"]
FamilyName = Literal[
    "clutter",
    "corridors",
    "rooms",
    "warehouse",
    "maze",
    "passages",
    "thicket",
    "mixed",
    "varied",
    "intricate",
    "barn",
    "people",
]


class ArenaConfig(Frozen):
    """The place in which the robots drive."""

    name: ArenaName = Field(
        "simple",
        title="Arena",
        description="Simple: 10 x 10 m with nothing but walls. Complex: the same with 17 obstacles.",
    )
    movers: MoversConfig = Field(default_factory=MoversConfig, title="Movers")


MAX_MAPS = 4096
"""Maps of the largest pool; pools of different seeds never share a map."""


class ArenaPool(Frozen):
    """A pool of arenas of a family, drawn from a seed; the robots are spread over all of them."""

    name: str
    difficulty: float = Field(
        0.5,
        ge=0.0,
        le=1.0,
        title="Difficulty",
        description="More obstacles and narrower passages: at 1 they are 0.9 m wide for the default robot.",
    )
    maps: int = Field(
        64,
        ge=1,
        le=MAX_MAPS,
        title="Maps",
        description="Different arenas of the training; with few of them the policy learns them by heart.",
        json_schema_extra=ADVANCED,
    )
    own_maps: bool = Field(
        True,
        title="Maps of its own for each seed",
        description="Results over seeds then tell what other maps would give; else all seeds train on the same ones.",
        json_schema_extra=ADVANCED,
    )
    map_sampling: Literal["uniform", "learnability"] = Field(
        "uniform",
        title="Map sampling",
        description="In which maps episodes begin. Uniform: in all as often. Learnability: half of them more often where "
        "some attempts arrive and some do not, since there is most to learn.",
        json_schema_extra=ADVANCED,
    )
    seed: int = Field(
        0,
        ge=0,
        le=2**31 - 1,
        title="Map seed",
        description="Which maps; the suites' maps are never among them.",
        json_schema_extra=ADVANCED,
    )
    movers: MoversConfig = Field(default_factory=MoversConfig, title="Movers")

    @model_validator(mode="before")
    @classmethod
    def _a_map_seed_was_that_of_one_pool(cls, arena: Any) -> Any:
        """Configurations written before seeds had maps of their own name a map seed and nothing else: they mean one pool."""
        if isinstance(arena, Mapping) and "seed" in arena and "own_maps" not in arena:
            return {**arena, "own_maps": False}
        return arena


class GeneratedArenaConfig(ArenaPool):
    """A pool of arenas of a family that is built in."""

    name: FamilyName = Field(
        "clutter",
        title="Arena",
        description="Drawn from a seed, 10 x 10 m, with a way to every target: random clutter, corridors, rooms with doors, "
        "warehouse aisles, a maze, narrow passages, a thicket of thin pillars, clutter and thickets mixed, or all of them. "
        "Or as in a benchmark, whatever the robot's size: fields of pillars as BARN's, scenes among people.",
    )


class ImportedArenaConfig(Frozen):
    """An arena from a file. A worker and a checkpoint carry its geometry; the service may leave it to the hash."""

    name: Literal["imported"] = Field("imported", title="Imported", description="Read from a file; see the gallery.")
    sha256: str = Field(
        "",
        pattern="^([0-9a-f]{64})?$",
        title="Imported arena",
        description="By the hash of its geometry; the form shows names.",
        json_schema_extra={"x-imported-arena": True},
    )
    arena: ArenaFile | None = Field(None, title="Geometry", json_schema_extra=HIDDEN)
    movers: MoversConfig = Field(default_factory=MoversConfig, title="Movers")

    @model_validator(mode="after")
    def _geometry_is_the_hashed_one(self) -> Self:
        if self.arena is not None and self.arena.sha256 != self.sha256:
            raise ValueError(f"the geometry's hash is {self.arena.sha256}, not {self.sha256!r}")
        return self

    @classmethod
    def of(cls, arena: ArenaFile) -> Self:
        """The configuration that carries this arena."""
        return cls(sha256=arena.sha256, arena=arena)


class AddedArenaPool(ArenaPool, ArenaFamily):
    """A pool of arenas of a family that an extension has added."""


ADDED_FAMILIES = tuple(complete(family, AddedArenaPool) for family in added(ArenaFamily))
"""The configurations of the families that extensions have added."""

if TYPE_CHECKING:
    AnyArenaConfig = ArenaConfig | GeneratedArenaConfig | AddedArenaPool | ImportedArenaConfig
else:
    AnyArenaConfig = Annotated[
        with_added(ArenaConfig | GeneratedArenaConfig | ImportedArenaConfig, ADDED_FAMILIES), Field(discriminator="name")
    ]

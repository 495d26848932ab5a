"""What an extension is made of: its declaration, and the kinds of parts that the simulator knows (pydantic only)."""

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, get_args

from pydantic import Field

from sim.extending.base import ADVANCED, Frozen
from sim.extending.expression import CONSTANTS, FUNCTIONS, QUANTITIES, parse

API_VERSION = 1
"""Of what extensions may use. An extension that was written for another version is refused."""

_DOTTED = re.compile(r"^[A-Za-z_]\w*(\.[A-Za-z_]\w*)*:[A-Za-z_]\w*$")


class Part(Frozen):
    """A configuration that an extension adds; its kinds are the classes below, and those of `workers.extending`.

    A part has a default for every field, and `name: Literal["<extension>.<part>"]`, whose `title` is what the form shows.

    Attributes:
        kind: what it is, for messages.
        implementation: where what it does lies, "package.module:name"; imported where it is run, not where it is declared.
    """

    kind: ClassVar[str] = ""
    implementation: ClassVar[str] = ""

    name: str

    @classmethod
    def part_name(cls) -> str:
        """The name that tells it from all others.

        Raises:
            ValueError: it has none, or more than one.
        """
        names = get_args(cls.model_fields["name"].annotation)
        if len(names) != 1 or cls.model_fields["name"].default != names[0]:
            raise ValueError(f'{cls.__name__} needs a field name: Literal["..."] with the same text as its default')
        return str(names[0])

    @classmethod
    def check(cls) -> None:
        """Look at what can be wrong with the declaration.

        Raises:
            ValueError: it can't be used; the message says why.
        """
        if not _DOTTED.match(cls.implementation):
            raise ValueError(f'{cls.__name__} needs implementation = "package.module:name", and has {cls.implementation!r}')


class RewardTerm(Part):
    """A term of a reward: its weight times a formula or a function, paid in every step.

    Its other fields are parameters: a formula may read them by their names, a function gets the whole term.

    Attributes:
        formula: of the quantities, constants and functions of `sim.extending.expression`, and of the term's own numbers.
        implementation: in place of a formula, "package.module:name" of a function (term, quantities, constants) to an array
            (robots,): `quantities` maps the names of `QUANTITIES` to arrays (robots,) float32 that must not be changed,
            `constants` those of `CONSTANTS` to numbers.
    """

    kind: ClassVar[str] = "reward term"
    formula: ClassVar[str] = ""

    weight: float = Field(1.0, title="Weight", description="Reward per unit.", json_schema_extra=ADVANCED)

    @classmethod
    def parameter_names(cls) -> frozenset[str]:
        """The fields that a formula may read besides what every formula may."""
        return frozenset(cls.model_fields) - {"name", "weight"}

    @property
    def parameters(self) -> dict[str, float]:
        """Their values."""
        return {name: float(getattr(self, name)) for name in self.parameter_names()}

    @classmethod
    def check(cls) -> None:
        """See `Part.check`."""
        if bool(cls.formula) == bool(cls.implementation):
            raise ValueError(f"{cls.__name__} needs a formula or an implementation, one of both")
        if cls.implementation:
            super().check()
            return
        if taken := cls.parameter_names() & (QUANTITIES.keys() | CONSTANTS.keys() | FUNCTIONS.keys()):
            raise ValueError(f"{cls.__name__} has a field {min(taken)!r}, which means something else in formulas")
        if any(field.annotation not in (float, int, bool) for name, field in cls.model_fields.items() if name != "name"):
            raise ValueError(f"{cls.__name__}: what a formula reads are numbers")
        parse(cls.formula, cls.parameter_names())


@dataclass(frozen=True)
class ObservationNumber:
    """One number of an observation.

    Attributes:
        name: what it is.
        formula: how it is computed; lengths in metres, angles in radians.
        low, high: the range that it stays in.
        unit: what 1 stands for; '' where it grows less than what it tells.
    """

    name: str
    formula: str
    low: float
    high: float
    unit: str = ""


class ObservationPart(Part):
    """A part of what a policy sees.

    At how many moments it is seen, `frames`, is added to its fields, as every part has it.

    Attributes:
        implementation: a function (part, task) to a function that turns a `sim.extending.observing.Sight` of n robots into
            (n, numbers); what it gives is cut at the numbers' ranges.
    """

    kind: ClassVar[str] = "observation part"

    def numbers(self) -> Sequence[ObservationNumber]:
        """What its numbers are at one moment, in order; how many they are may depend on its fields."""
        raise NotImplementedError

    @classmethod
    def check(cls) -> None:
        """See `Part.check`."""
        super().check()
        if cls.numbers is ObservationPart.numbers:
            raise ValueError(f"{cls.__name__} needs a method numbers(self) that says what its numbers are")
        check_numbers(cls(name=cls.part_name()))


def check_numbers(part: ObservationPart) -> None:
    """Look at what an observation part says of its numbers.

    Raises:
        ValueError: there are none, or their ranges are none.
    """
    numbers = tuple(part.numbers())
    if not numbers:
        raise ValueError(f"{part.name} has no numbers")
    for number in numbers:
        if not (math.isfinite(number.low) and math.isfinite(number.high) and number.low < number.high):
            raise ValueError(f"{part.name}: {number.name!r} goes from {number.low:g} to {number.high:g}, which is no range")


class ArenaFamily(Part):
    """A family of arenas that are drawn from seeds.

    Difficulty, number of maps, their seed and movers are added to its fields, as every family has them.

    Attributes:
        implementation: a function (plan, family) that fills a `sim.extending.arenas.Plan`; `family` is this configuration.
    """

    kind: ClassVar[str] = "arena family"


class Baseline(Part):
    """A controller that needs no training.

    Attributes:
        implementation: a function (baseline, task) to a controller, see `sim.extending.control`.
    """

    kind: ClassVar[str] = "baseline"


@dataclass(frozen=True)
class Extension:
    """What a package adds to Mapless.

    Attributes:
        name: of the extension; its parts are named "<name>.<part>". Small letters, digits and _.
        version: of the extension: a run waits for a worker that has this one.
        api: the version of Mapless's side that it was written for: `API_VERSION` of that day, as a number.
        parts: the classes of its configurations.
        source: how others get it, "pip install my_lab==1.0" for example; shown where it is missing.
    """

    name: str
    version: str
    api: int
    parts: tuple[type[Part], ...]
    source: str = ""

    def part(self, name: str) -> Any:
        """The class of the part of this name, without the extension's in front."""
        return next(part for part in self.parts if part.part_name() == f"{self.name}.{name}")

"""What a robot is rewarded for: a list of named terms with weights (pydantic only).

A step's reward is the sum of its terms. Arrival, collision and time-out are paid in the step in which they happen; all
other terms but formulas of one's own in every step that ends in neither arrival nor collision, as in the paper (section
'Reward function'). `d` is the distance to the target, `l` the length of the shortest path to it.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from sim.config.base import ADVANCED, Frozen
from sim.extending.discovery import added, with_added
from sim.extending.expression import MAX_CHARACTERS, parse
from sim.extending.parts import RewardTerm as AddedTerm
from sim.kernels.room import MAX_TERMS


def _weight(default: float, unit: str) -> Any:
    return Field(
        default, allow_inf_nan=False, title="Weight", description=f"Reward {unit}.", json_schema_extra=ADVANCED
    )  # fmt: skip


def _margin(default: float, what: str) -> Any:
    return Field(default, gt=0.0, le=10.0, title="Margin", description=f"{what}, metres.", json_schema_extra=ADVANCED)


class ArrivalTerm(Frozen):
    """The target is reached."""

    name: Literal["arrival"] = Field("arrival", title="Arrival")
    weight: float = _weight(120.0, "on arrival")


class CollisionTerm(Frozen):
    """The robot collides."""

    name: Literal["collision"] = Field("collision", title="Collision")
    weight: float = _weight(-100.0, "on a collision")


class TimeoutTerm(Frozen):
    """The attempt ends at its limit of steps."""

    name: Literal["timeout"] = Field("timeout", title="Time-out")
    weight: float = _weight(-50.0, "at the step limit")


class ProgressTerm(Frozen):
    """Metres by which the target came nearer: d before - d now."""

    name: Literal["progress"] = Field("progress", title="Progress")
    weight: float = _weight(500.0, "per metre gained")
    exponential: bool = Field(
        False,
        title="Exponential",
        description="Times 2^(d before / d now), as in the paper's advanced reward; the ratio is cut at 8.",
        json_schema_extra=ADVANCED,
    )


class PathProgressTerm(Frozen):
    """Metres by which the shortest path became shorter: l before - l now, around walls and obstacles, not movers."""

    name: Literal["path_progress"] = Field("path_progress", title="Progress along the shortest path")
    weight: float = _weight(500.0, "per metre gained")
    clearance: float | None = Field(
        None,
        gt=0.0,
        le=1.0,
        title="Clearance of paths",
        description="Metres from obstacles; empty: what the body needs. Gaps up to 0.25 m wider may be missed.",
        json_schema_extra=ADVANCED,
    )


class TimeTerm(Frozen):
    """Seconds that pass."""

    name: Literal["time"] = Field("time", title="Time")
    weight: float = _weight(-1.0, "per second")


class ClearanceTerm(Frozen):
    """Too little room ahead: 1 - free distance within 30 degrees of the heading / range of the LiDAR."""

    name: Literal["clearance"] = Field("clearance", title="Room ahead")
    weight: float = _weight(-5.0, "per step with no room ahead at all, less with more")


class ProximityTerm(Frozen):
    """Near to anything: max(0, 1 - distance from the body / margin)."""

    name: Literal["proximity"] = Field("proximity", title="Proximity")
    weight: float = _weight(-5.0, "per step in touch, less with more distance")
    margin: float = _margin(0.3, "Distance from which on nothing is paid")


class AlignmentTerm(Frozen):
    """Facing away from the target: |bearing of the target| / pi."""

    name: Literal["alignment"] = Field("alignment", title="Heading")
    weight: float = _weight(-5.0, "per step facing away, none facing the target")


class SmoothnessTerm(Frozen):
    """Changes of the command: the squared changes of its numbers, as fractions of their limits, added up."""

    name: Literal["smoothness"] = Field("smoothness", title="Smoothness")
    weight: float = _weight(-1.0, "per unit")


class SpeedTerm(Frozen):
    """Speed forwards, metres per second; less than nothing backwards."""

    name: Literal["speed"] = Field("speed", title="Speed")
    weight: float = _weight(1.0, "per step at 1 m/s")


class PeopleTerm(Frozen):
    """Passing movers too near: max(0, 1 - distance from the body to the nearest / margin)."""

    name: Literal["people"] = Field("people", title="Distance from movers")
    weight: float = _weight(-5.0, "per step in touch, less with more distance")
    margin: float = _margin(0.5, "Distance from which on nothing is paid")


class FormulaTerm(Frozen):
    """A formula of one's own, paid in every step; see docs/rewards.md for what it may read."""

    name: Literal["formula"] = Field("formula", title="Formula")
    label: str = Field(
        "mine",
        pattern="^[a-z][a-z0-9_]{0,29}$",
        title="Name",
        description="Under which it is logged: small letters, digits and _.",
        json_schema_extra=ADVANCED,
    )
    weight: float = _weight(1.0, "per unit of the formula")
    formula: str = Field(
        "min(0, clearance - 0.3) * speed",
        min_length=1,
        max_length=MAX_CHARACTERS,
        title="Formula",
        description="Of distance, previous_distance, bearing, speed, turning_rate, clearance, ahead, nearest, mover, steps, "
        "arrived, collided, timed_out and more.",
        json_schema_extra=ADVANCED,
        validate_default=True,
    )

    @field_validator("formula")
    @classmethod
    def _can_be_computed(cls, text: str) -> str:
        parse(text)
        return text


BuiltInTerm = (
    ArrivalTerm
    | CollisionTerm
    | TimeoutTerm
    | ProgressTerm
    | PathProgressTerm
    | TimeTerm
    | ClearanceTerm
    | ProximityTerm
    | AlignmentTerm
    | SmoothnessTerm
    | SpeedTerm
    | PeopleTerm
    | FormulaTerm
)

if TYPE_CHECKING:
    RewardTerm = BuiltInTerm | AddedTerm
else:
    RewardTerm = Annotated[with_added(BuiltInTerm, added(AddedTerm)), Field(discriminator="name")]

RewardPreset = Literal["basic", "clearance", "alignment"]
"""The paper's rewards. It leaves open what hd, the second factor of the advanced one's penalty, is: here the free distance
ahead over the LiDAR's range (`clearance`) or 1 - |bearing of the target| / pi (`alignment`)."""


PRESET_TITLES: dict[RewardPreset, str] = {
    "basic": "Basic (paper)",
    "clearance": "Advanced, room ahead (paper)",
    "alignment": "Advanced, heading (paper)",
}


def preset_terms(
    preset: RewardPreset,
    *,
    arrival: float = 120.0,
    collision: float = -100.0,
    progress: float = 500.0,
    penalty: float = 5.0,
) -> tuple[RewardTerm, ...]:
    """The terms of one of the paper's rewards: arrival, collision, progress and, of the advanced ones, a penalty."""
    terms: tuple[RewardTerm, ...] = (
        ArrivalTerm(weight=arrival),
        CollisionTerm(weight=collision),
        ProgressTerm(weight=progress, exponential=preset != "basic"),
    )
    if preset == "basic":
        return terms
    return (*terms, ClearanceTerm(weight=-penalty) if preset == "clearance" else AlignmentTerm(weight=-penalty))


def term_key(term: RewardTerm) -> str:
    """The name under which a term is logged, unique in its reward."""
    return term.label if isinstance(term, FormulaTerm) else term.name


class RewardConfig(Frozen):
    """The terms whose sum is the reward of a step."""

    terms: tuple[RewardTerm, ...] = Field(
        default_factory=lambda: preset_terms("basic"),
        min_length=1,
        max_length=MAX_TERMS,
        title="Terms",
        description="Their sum is the reward of a step; each is logged by itself.",
        json_schema_extra={
            "x-presets": {
                title: [term.model_dump(mode="json") for term in preset_terms(name)] for name, title in PRESET_TITLES.items()
            }
        },
    )

    @model_validator(mode="before")
    @classmethod
    def _first_rewards_had_a_name(cls, data: Any) -> Any:
        """Files written when there were three rewards and no terms name one of them and its four numbers."""
        if not isinstance(data, Mapping) or "terms" in data or not data:
            return data
        numbers = {key: data[key] for key in ("arrival", "collision", "progress", "penalty") if key in data}
        if data.keys() - numbers.keys() - {"name"} or data.get("name", "basic") not in ("basic", "clearance", "alignment"):
            return data
        if not all(isinstance(number, int | float) for number in numbers.values()):
            return data
        return {"terms": [term.model_dump() for term in preset_terms(data.get("name", "basic"), **numbers)]}

    @model_validator(mode="after")
    def _terms_are_told_apart(self) -> Self:
        keys = [term_key(term) for term in self.terms]
        if twice := sorted({key for key in keys if keys.count(key) > 1}):
            raise ValueError(f"there is more than one term {', '.join(twice)}: keep one of each, and name formulas apart")
        return self

    @classmethod
    def preset(cls, preset: RewardPreset, **numbers: float) -> Self:
        """One of the paper's rewards; `numbers` are those of `preset_terms`."""
        return cls(terms=preset_terms(preset, **numbers))

    @property
    def in_short(self) -> str:
        """Which of the paper's rewards it is by its terms, whatever their weights, or how many terms it has."""
        way = [term for term in self.terms if term.name not in ("arrival", "collision")]
        if way and isinstance(way[0], ProgressTerm):
            if len(way) == 1 and not way[0].exponential:
                return "basic"
            if len(way) == 2 and way[0].exponential and way[1].name in ("clearance", "alignment"):
                return way[1].name
        return f"{len(self.terms)} term{'s'[: len(self.terms) > 1]}"

    def weight(self, name: str) -> float:
        """The weight of the term of this kind; 0 where there is none."""
        return next((term.weight for term in self.terms if term.name == name), 0.0)

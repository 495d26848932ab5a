"""What a policy sees: a list of parts, each some numbers with a meaning (pydantic only).

A part may be seen as it was in the steps before, too: `frames` says at how many moments. An observation holds the newest
moment of all parts, in the list's order, then what they were a step before, and so on. docs/simulation.md has them all.
"""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import Field, field_validator, model_validator

from sim.config.base import ADVANCED, Frozen
from sim.extending.discovery import added, complete, with_added
from sim.extending.parts import ObservationPart as AddedPart
from sim.extending.parts import check_numbers
from sim.kernels.room import LONG_TRAIL_KINDS, MAX_FRAMES, MAX_LEADS, MAX_PARTS, OPENING_KINDS, SHORT_TRAIL_KINDS

MAX_NUMBERS = 4_000
"""Numbers of one observation, at most: all rays of a full scanner at all moments, and some more."""


MAX_ACTIONS = 3
"""Numbers of an action, at most."""


def _frames() -> Any:
    return Field(
        1,
        ge=1,
        le=MAX_FRAMES,
        title="Frames",
        description="Moments: now and the steps before.",
        json_schema_extra=ADVANCED,
    )


class RangesPart(Frozen):
    """What the LiDAR sees, from right to left: the nearest ray of each batch of neighbours."""

    name: Literal["ranges"] = Field("ranges", title="Ranges")
    batches: int = Field(
        10,
        ge=1,
        le=360,
        title="Batches",
        description="Numbers of each LiDAR's scan; must divide the rays. As many as rays: all of them.",
        json_schema_extra=ADVANCED,
    )
    inverse: bool = Field(
        True,
        title="Inverse",
        description="1 where a collision is, less with distance; otherwise ranges over the LiDAR's.",
        json_schema_extra=ADVANCED,
    )
    frames: int = _frames()


class SpeedsPart(Frozen):
    """How fast it drove and turned in the last step, as fractions of its limits."""

    name: Literal["speeds"] = Field("speeds", title="Speeds")
    frames: int = _frames()


class ActionsPart(Frozen):
    """What was commanded last, whether it was followed by then or not, as fractions of the limits."""

    name: Literal["actions"] = Field("actions", title="Last action")
    frames: int = _frames()


class DistancePart(Frozen):
    """How far the target is."""

    name: Literal["distance"] = Field("distance", title="Distance of the target")
    scaling: Literal["saturating", "diagonal"] = Field(
        "saturating",
        title="Scaling",
        description="Saturating: d / (d + 1 m). Diagonal: over the arena's, as in the paper.",
        json_schema_extra=ADVANCED,
    )
    frames: int = _frames()


class DirectionPart(Frozen):
    """Where the target is, in the arena's frame: part of a turn."""

    name: Literal["direction"] = Field("direction", title="Direction of the target")
    frames: int = _frames()


class BearingPart(Frozen):
    """Where the target is against the heading, left positive."""

    name: Literal["bearing"] = Field("bearing", title="Bearing of the target")
    encoding: Literal["angle", "sine_cosine"] = Field(
        "angle",
        title="Encoding",
        description="Angle: bearing / pi, which jumps behind the robot. Sine and cosine: two numbers, which do not.",
        json_schema_extra=ADVANCED,
    )
    frames: int = _frames()


class HeadingPart(Frozen):
    """Where the robot points, in the arena's frame."""

    name: Literal["heading"] = Field("heading", title="Heading")
    scaling: Literal["signed", "turn"] = Field(
        "signed",
        title="Scaling",
        description="Signed: over pi, left positive. Turn: part of a turn, as in the paper.",
        json_schema_extra=ADVANCED,
    )
    frames: int = _frames()


class DeviationPart(Frozen):
    """How far the robot is turned away from the target: |bearing| / pi."""

    name: Literal["deviation"] = Field("deviation", title="Heading deviation")
    frames: int = _frames()


class TrailPart(Frozen):
    """Where it has been in this attempt: crumbs that it drops every 0.24 m, those in sight, as it remembers them."""

    name: Literal["trail"] = Field("trail", title="Trail")
    sectors: int = Field(
        30,
        ge=4,
        le=120,
        title="Sectors",
        description="Of the full turn around it, three numbers each: how near, how many, how fresh.",
        json_schema_extra=ADVANCED,
    )
    memory: Literal["short", "long"] = Field(
        "short",
        title="Memory",
        description="Short: the newest 256 crumbs, some 60 m. Long: 1,024, ages by their logarithms, and a fourth number of "
        "each sector, the age of its oldest crumb.",
        json_schema_extra=ADVANCED,
    )
    frames: int = _frames()


class WayPart(Frozen):
    """How much of the straight way to the target its scan sees to be free, and whether all of it is."""

    name: Literal["way"] = Field("way", title="Straight way to the target")
    frames: int = _frames()


class KnownPart(Frozen):
    """Since when it knows what it sees, in each direction: views that it keeps every 0.48 m, and which of them showed it."""

    name: Literal["known"] = Field("known", title="What is known")
    sectors: int = Field(
        30,
        ge=4,
        le=120,
        title="Sectors",
        description="Of the full turn around it, two numbers each: since when it knows the end of its sight, how near to "
        "that it has been.",
        json_schema_extra=ADVANCED,
    )
    progress: bool = Field(
        False,
        title="Progress",
        description="Also one number each for how much nearer to the target that end is.",
        json_schema_extra=ADVANCED,
    )
    frames: int = _frames()


class OpeningsPart(Frozen):
    """Where it has not looked yet: edges of what it has seen by which its target is nearest if what was not seen is free."""

    name: Literal["openings"] = Field("openings", title="Openings to look into")
    count: int = Field(
        2,
        ge=1,
        le=MAX_LEADS,
        title="Openings",
        description="The best ones, six numbers each: where to go first on the way there, how far it is, how far on from "
        "there, and whether it saw the way to be free. They come from views that it keeps every 0.48 m, and from which of "
        "them are in sight of one another.",
        json_schema_extra=ADVANCED,
    )
    frames: int = _frames()


class DwellPart(Frozen):
    """How long it has stayed about where it is: what tells a robot that turns about on one spot that it does."""

    name: Literal["dwell"] = Field("dwell", title="Time on one spot")
    frames: int = _frames()


class ReachPart(Frozen):
    """How far its body could go straight on in each direction, as its scan shows: gaps that it fits through."""

    name: Literal["reach"] = Field("reach", title="Reach all around")
    sectors: int = Field(
        60,
        ge=4,
        le=120,
        title="Sectors",
        description="Of the full turn around it, one number each: how far it could go where it could go farthest.",
        json_schema_extra=ADVANCED,
    )
    progress: bool = Field(
        False,
        title="Progress",
        description="Also one number each for how much nearer to the target going there would bring it.",
        json_schema_extra=ADVANCED,
    )
    frames: int = _frames()


class AddedObservationPart(AddedPart):
    """A part that an extension has added."""

    frames: int = _frames()

    @model_validator(mode="after")
    def _numbers_are_numbers(self) -> Self:
        check_numbers(self)
        return self


BuiltInPart = (
    RangesPart
    | SpeedsPart
    | ActionsPart
    | DistancePart
    | DirectionPart
    | BearingPart
    | HeadingPart
    | DeviationPart
    | TrailPart
    | WayPart
    | ReachPart
    | KnownPart
    | OpeningsPart
    | DwellPart
)

if TYPE_CHECKING:
    ObservationPart = BuiltInPart | AddedObservationPart
else:
    ObservationPart = Annotated[
        with_added(BuiltInPart, (complete(part, AddedObservationPart) for part in added(AddedPart))),
        Field(discriminator="name"),
    ]

ObservationName = Literal["improved", "paper"]
"""The observations that came first: inverse ranges and a signed bearing, and ranges and angles as published."""

PRESET_TITLES: dict[ObservationName, str] = {"improved": "Improved", "paper": "Paper"}


def preset_parts(preset: ObservationName, *, batches: int = 10, frames: int = 1) -> tuple[ObservationPart, ...]:
    """The parts of one of the first observations: `batches + 6` numbers, at so many moments."""
    paper = preset == "paper"
    return (
        RangesPart(batches=batches, inverse=not paper, frames=frames),
        SpeedsPart(frames=frames),
        DistancePart(scaling="diagonal" if paper else "saturating", frames=frames),
        DirectionPart(frames=frames) if paper else BearingPart(frames=frames),
        HeadingPart(scaling="turn" if paper else "signed", frames=frames),
        DeviationPart(frames=frames),
    )


class ObservationConfig(Frozen):
    """The parts that a policy sees."""

    parts: tuple[ObservationPart, ...] = Field(
        default_factory=lambda: preset_parts("improved"),
        min_length=1,
        max_length=MAX_PARTS,
        title="Parts",
        description="What the policy sees. Leave one out to learn what it is worth.",
        json_schema_extra={
            "x-ticks": True,
            "x-presets": {
                title: [part.model_dump(mode="json") for part in preset_parts(name)] for name, title in PRESET_TITLES.items()
            },
        },
    )

    @model_validator(mode="before")
    @classmethod
    def _by_name(cls, data: Any) -> Any:
        """One of the first observations by its name, as in files written when there were no parts."""
        if not isinstance(data, str):
            return data
        if data not in PRESET_TITLES:
            raise ValueError(f"there is no observation {data!r}; by name there are {', '.join(PRESET_TITLES)}")
        return {"parts": preset_parts(data)}

    @field_validator("parts")
    @classmethod
    def _are_told_apart(cls, parts: tuple[ObservationPart, ...]) -> tuple[ObservationPart, ...]:
        keys = [part_key(part) for part in parts]
        if twice := sorted({key for key in keys if keys.count(key) > 1}):
            raise ValueError(f"there is more than one part {', '.join(twice)}: keep one of each")
        return parts

    @classmethod
    def preset(cls, preset: ObservationName, *, batches: int = 10, frames: int = 1) -> Self:
        """One of the first observations, see `preset_parts`."""
        return cls(parts=preset_parts(preset, batches=batches, frames=frames))

    @property
    def in_short(self) -> str:
        """Which of the first observations it is, whatever its batches and frames, or how many parts it has."""
        settled = tuple(part.model_copy(update={"frames": 1}) for part in self.parts)
        for name in PRESET_TITLES:
            if settled == preset_parts(name, batches=self.batches or 1):
                return name
        return f"{len(self.parts)} part{'s'[: len(self.parts) > 1]}"

    @property
    def batches(self) -> int:
        """Numbers of each LiDAR's scan at one moment; 0 where it is not seen."""
        return next((part.batches for part in self.parts if isinstance(part, RangesPart)), 0)

    def size(self, actions: int, scanners: int) -> int:
        """Numbers of all parts at all moments, for a robot with so many numbers in an action and so many LiDARs."""
        return sum(part.frames * part_size(part, actions, scanners) for part in self.parts)

    @property
    def frames(self) -> int:
        """Moments at which anything is seen."""
        return max(part.frames for part in self.parts)

    def without(self, *names: str) -> Self:
        """The same without some parts: an ablation.

        Raises:
            ValidationError: nothing would be left.
        """
        return type(self)(parts=tuple(part for part in self.parts if part_key(part) not in names))


def part_key(part: ObservationPart) -> str:
    """The name of a part, unique in its observation."""
    return part.name


def part_size(part: ObservationPart, actions: int, scanners: int) -> int:
    """Numbers of a part at one moment, for a robot with so many numbers in an action and so many LiDARs."""
    match part:
        case RangesPart():
            return part.batches * scanners
        case SpeedsPart() | ActionsPart():
            return actions
        case BearingPart(encoding="sine_cosine") | WayPart():
            return 2
        case TrailPart():
            return (LONG_TRAIL_KINDS if part.memory == "long" else SHORT_TRAIL_KINDS) * part.sectors + 1
        case ReachPart():
            return (1 + part.progress) * part.sectors
        case OpeningsPart():
            return OPENING_KINDS * part.count
        case KnownPart():
            return (2 + part.progress) * part.sectors
        case AddedObservationPart():
            return len(part.numbers())
        case _:
            return 1


def read_first_observations(task: Any) -> Any:
    """A task's document, in which the first observations stood by name, with batches at the LiDAR and frames at the task."""
    if not isinstance(task, Mapping):
        return task
    name, lidar = task.get("observation", "improved"), task.get("lidar")
    at_lidar = isinstance(lidar, Mapping) and "batches" in lidar
    if not isinstance(name, str) or name not in PRESET_TITLES or not ("frames" in task or at_lidar):
        return task
    document = {key: value for key, value in task.items() if key != "frames"}
    parts = [part.model_dump() for part in preset_parts("paper" if name == "paper" else "improved")]
    if "frames" in task:
        parts = [part | {"frames": task["frames"]} for part in parts]
    if isinstance(lidar, Mapping) and at_lidar:
        document["lidar"] = {key: value for key, value in lidar.items() if key != "batches"}
        parts[0]["batches"] = lidar["batches"]
    return document | {"observation": {"parts": parts}}

"""What every number of an observation means: where it stands, its formula, unit and range, part by part.

`sim.config.ObservationConfig` lists the parts. An observation holds the newest moment of all of them, in the list's order,
then those that have more frames as they were a step before, two steps before and so on; an episode begins with its first
moment repeated.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from sim.actions import ActionComponent, action_layout
from sim.config import (
    ActionsPart,
    AddedObservationPart,
    BearingPart,
    DeviationPart,
    DirectionPart,
    DistancePart,
    DwellPart,
    HeadingPart,
    KnownPart,
    ObservationPart,
    OpeningsPart,
    RangesPart,
    ReachPart,
    SpeedsPart,
    TaskConfig,
    TrailPart,
    WayPart,
    part_key,
)
from sim.config.observation import part_size
from sim.extending.parts import ObservationNumber
from sim.kernels.records import PART_KINDS
from sim.kernels.room import (
    AWAY,
    DETOUR,
    LONG_STAY,
    LONG_TRAIL_ROOM,
    MAX_FRAMES,
    MAX_PARTS,
    REACH_DIRECTIONS,
    SHORT_OF,
    VIEW_ROOM,
)

_BEARING = "where bearing = atan2(dy, dx) - heading"


@dataclass(frozen=True)
class ObservationBlock:
    """The numbers of one part at one moment.

    Attributes:
        part: whose they are.
        age: steps since then; 0 is now.
        start: where they begin in the observation.
        numbers: what they are.
    """

    part: ObservationPart
    age: int
    start: int
    numbers: tuple[ObservationNumber, ...]

    @property
    def key(self) -> str:
        """The part's name."""
        return part_key(self.part)

    @property
    def place(self) -> slice:
        """Where they are in the observation."""
        return slice(self.start, self.start + len(self.numbers))


@dataclass(frozen=True)
class ObservationLayout:
    """What every number of an observation means.

    Attributes:
        name: 'improved' or 'paper' where it has their parts, else how many it has.
        blocks: its parts at their moments, in order.
        version: of what parts mean: a part that comes to mean something else raises it.
    """

    name: str
    blocks: tuple[ObservationBlock, ...]
    version: Literal[1] = 1

    @property
    def numbers(self) -> tuple[ObservationNumber, ...]:
        """All numbers, in order."""
        return tuple(number for block in self.blocks for number in block.numbers)

    @property
    def size(self) -> int:
        """Numbers in one observation."""
        return sum(len(block.numbers) for block in self.blocks)

    def places(self, key: str) -> tuple[slice, ...]:
        """Where a part's numbers are, the newest first; nowhere where the observation does not have it."""
        return tuple(block.place for block in self.blocks if block.key == key)


def observation_size(task: TaskConfig) -> int:
    """Numbers in one observation of this task."""
    return task.observation.size(*_robot_sizes(task))


def _robot_sizes(task: TaskConfig) -> tuple[int, int]:
    """Numbers in an action, and LiDARs."""
    return action_layout(task.robot).size, len(task.lidar.mount.places)


def near_distance(task: TaskConfig) -> float:
    """Distance at which an inverse range reaches 1, metres: the collision distance or the body."""
    return max(task.collision_distance, task.robot.inscribed_radius)


def reach_directions(task: TaskConfig) -> NDArray[np.float64]:
    """Directions of what is told of the reach, (n,) radians against the heading, from right to left; none if none is."""
    count = REACH_DIRECTIONS * sum(part.sectors for part in task.observation.parts if isinstance(part, ReachPart))
    return np.asarray((np.arange(count) + 0.5) * (2.0 * np.pi / max(count, 1)) - np.pi)


def observation_layout(task: TaskConfig) -> ObservationLayout:
    """Every number of a task's observation, in order: the newest moment first."""
    return ObservationLayout(task.observation.in_short, tuple(_blocks(task)))


def _blocks(task: TaskConfig) -> Iterator[ObservationBlock]:
    start = 0
    newest = {part_key(part): _numbers(part, task) for part in task.observation.parts}
    for age in range(task.observation.frames):
        for part in task.observation.parts:
            if age < part.frames:
                numbers = tuple(_before(number, age) for number in newest[part_key(part)])
                yield ObservationBlock(part, age, start, numbers)
                start += len(numbers)


def _before(number: ObservationNumber, age: int) -> ObservationNumber:
    if not age:
        return number
    formula = f"{number.name} {age} step{'s'[: age > 1]} before"
    return ObservationNumber(f"{number.name}, {age} before", formula, number.low, number.high, number.unit)


def _numbers(part: ObservationPart, task: TaskConfig) -> tuple[ObservationNumber, ...]:
    """The numbers of a part at one moment."""
    match part:
        case RangesPart():
            return tuple(_ranges(part, task))
        case SpeedsPart():
            return tuple(
                ObservationNumber(one.measure, f"{one.measure} of the last step / its limit", one.low, 1.0, _unit(one))
                for one in action_layout(task.robot).components
            )
        case ActionsPart():
            return tuple(
                ObservationNumber(
                    f"{one.name} command", f"{one.measure} last commanded / its limit", one.low, 1.0, _unit(one)
                )
                for one in action_layout(task.robot).components
            )
        case DistancePart(scaling="diagonal"):
            return (
                ObservationNumber(
                    "target distance", "distance to the target / the arena's diagonal", 0.0, 1.0, "the arena's diagonal"
                ),
            )
        case DistancePart():
            return (ObservationNumber("target distance", "d / (d + 1 m), where d = distance to the target", 0.0, 1.0),)
        case DirectionPart():
            formula = "(atan2(dy, dx) mod 2 pi) / 2 pi, in the arena's frame"
            return (ObservationNumber("target direction", formula, 0.0, 1.0, "2 pi rad"),)
        case BearingPart(encoding="sine_cosine"):
            return (
                ObservationNumber("sine of bearing", f"sin(bearing), {_BEARING}, left positive", -1.0, 1.0),
                ObservationNumber("cosine of bearing", "cos(bearing)", -1.0, 1.0),
            )
        case BearingPart():
            return (ObservationNumber("bearing", f"bearing / pi, {_BEARING}, left positive", -1.0, 1.0, "pi rad"),)
        case HeadingPart(scaling="turn"):
            return (ObservationNumber("yaw", "(heading mod 2 pi) / 2 pi", 0.0, 1.0, "2 pi rad"),)
        case HeadingPart():
            return (ObservationNumber("yaw", "heading / pi", -1.0, 1.0, "pi rad"),)
        case DeviationPart():
            return (ObservationNumber("heading deviation", f"|bearing| / pi, {_BEARING}", 0.0, 1.0, "pi rad"),)
        case TrailPart():
            return tuple(_trail(part, task))
        case WayPart():
            return tuple(_way(task))
        case ReachPart():
            return tuple(_reach(part, task))
        case KnownPart():
            return tuple(_known(part, task))
        case OpeningsPart():
            return tuple(_openings(part, task))
        case DwellPart():
            staying = f"t / (t + {LONG_STAY:g} s), t = time since it last came {AWAY:g} m away from where it then was"
            return (ObservationNumber("dwell", staying, 0.0, 1.0),)
        case AddedObservationPart():
            return tuple(part.numbers())


def _unit(component: ActionComponent) -> str:
    return f"{component.limit:g} {component.unit.rstrip(',')}"


def _ranges(part: RangesPart, task: TaskConfig) -> Iterator[ObservationNumber]:
    rays, near, limit = task.lidar.rays // part.batches, near_distance(task), task.lidar.range
    for k in range(part.batches * len(task.lidar.mount.places)):
        nearest = f"min(ranges[{k * rays}:{(k + 1) * rays}])"
        if part.inverse:
            yield ObservationNumber(f"nearness {k}", f"{near:g} / max({nearest}, {near:g})", 0.0, 1.0)
        else:
            yield ObservationNumber(f"range {k}", f"{nearest} / {limit:g}", 0.0, 1.0, f"{limit:g} m")


def _trail(part: TrailPart, task: TaskConfig) -> Iterator[ObservationNumber]:
    crumbs, limit, is_long = "the crumbs in sight in this sector", task.lidar.range, part.memory == "long"
    freshness = f"1 - ln(1 + m) / ln(1 + {LONG_TRAIL_ROOM})" if is_long else "10 / (10 + m)"
    kinds = [
        ("trail nearness", f"1 - d / {limit:g} m, d = distance of the nearest of {crumbs}; 0 where there is none"),
        ("trail crumbs", f"n / (n + 5), n = number of {crumbs}"),
        ("trail freshness", f"{freshness}, m = crumbs dropped since the newest of {crumbs}; 0 where there is none"),
    ]
    if is_long:
        kinds.append(("trail first", f"{freshness}, m = crumbs dropped since the oldest of {crumbs}; 0 where there is none"))
    for name, formula in kinds:
        for k in range(part.sectors):
            yield ObservationNumber(f"{name} {k}", formula, 0.0, 1.0)
    half = 160 if is_long else 40
    yield ObservationNumber("trail length", f"n / (n + {half}), n = crumbs dropped in this attempt", 0.0, 1.0)


def _way(task: TaskConfig) -> Iterator[ObservationNumber]:
    free = (
        f"f = {near_distance(task):g} m on both sides of it no reading ends for so far, at most the LiDAR's range, "
        f"l = distance to the target - {task.arrival_distance:g} m"
    )
    yield ObservationNumber("free way", f"min(f, l) / l, {free}; 1 where l is 0", 0.0, 1.0)
    yield ObservationNumber("way is free", "1 where f >= l, else 0", 0.0, 1.0)


def _known(part: KnownPart, task: TaskConfig) -> Iterator[ObservationNumber]:
    limit, width = task.lidar.range, 360.0 / part.sectors
    end = f"the end of the farthest sight in this sector ({SHORT_OF:g} m before what its ray meets, at least half way there)"
    kinds = [
        (
            "known freshness",
            f"1 - ln(1 + m) / ln({VIEW_ROOM + 1}), m = views kept since the oldest one that showed {end}; 1 where none did",
        ),
        ("known nearness", f"1 - d / {limit:g} m, d = distance of {end} from the nearest view, at least 0"),
    ]
    if part.progress:
        kinds.append(("known progress", f"{_progress(task)} to {end}"))
    for name, formula in kinds:
        for k in range(part.sectors):
            where = f"{k * width - 180.0:g} to {(k + 1) * width - 180.0:g} degrees against the heading"
            low = -1.0 if name.endswith("progress") else 0.0
            yield ObservationNumber(f"{name} {k}", f"{formula}; {where}; 0 without a ray", low, 1.0)


def _openings(part: OpeningsPart, task: TaskConfig) -> Iterator[ObservationNumber]:
    for k in range(part.count):
        place = f"the place to go to first on the way to opening {k}"
        yield ObservationNumber(
            f"opening {k}, sine of bearing", f"sin(bearing of {place}); 0 where there is none", -1.0, 1.0
        )
        yield ObservationNumber(
            f"opening {k}, cosine of bearing", f"cos(bearing of {place}); 0 where there is none", -1.0, 1.0
        )
        yield ObservationNumber(
            f"opening {k}, nearness", f"1 - d / {task.lidar.range:g} m, d = distance of {place}, at least 0", 0.0, 1.0
        )
        yield ObservationNumber(
            f"opening {k}, way",
            f"w / (w + 1 m), w = metres from the newest view to opening {k} by ways that it knows",
            0.0,
            1.0,
        )
        yield ObservationNumber(
            f"opening {k}, rest",
            f"r / (r + 1 m), r = metres straight on from opening {k} to the target, {DETOUR:g} more for each wall that was "
            "seen between",
            0.0,
            1.0,
        )
        free = f"1 where the body can go straight on to opening {k} from the view that saw it, else 0"
        yield ObservationNumber(f"opening {k}, free", free, 0.0, 1.0)


def _reach(part: ReachPart, task: TaskConfig) -> Iterator[ObservationNumber]:
    near, width = near_distance(task), 360.0 / part.sectors
    edges = [k * width - 180.0 for k in range(part.sectors)]
    wheres = [f"{edge:g} to {edge + width:g} degrees against the heading" for edge in edges]
    until = f"until a reading ends less than {near:g} m from the middle of the body, at most the LiDAR's range"
    for k, where in enumerate(wheres):
        formula = f"{near:g} / ({near:g} + f), f = metres straight on, {where}, where it is largest, {until}"
        yield ObservationNumber(f"reach {k}", formula, near / (near + task.lidar.range), 1.0)
    for k, where in enumerate(wheres if part.progress else ()):
        formula = f"{_progress(task)} straight on, {where}, where it is largest, {until}"
        yield ObservationNumber(f"reach progress {k}", formula, -1.0, 1.0)


def _progress(task: TaskConfig) -> str:
    return f"(metres by which the target comes nearer) / {task.lidar.range:g} m, going"


def pack_parts(task: TaskConfig) -> dict[str, object]:
    """Those fields of `sim.kernels.records.PARAMETERS` that say what is seen."""
    observation = task.observation
    rows = {part_key(part): row for row, part in enumerate(observation.parts)}
    starts = np.zeros((MAX_PARTS, MAX_FRAMES), np.int32)
    for block in observation_layout(task).blocks:
        starts[rows[block.key], block.age] = block.start
    places, options = np.full(len(PART_KINDS), -1, np.int32), np.zeros(len(PART_KINDS), np.int32)
    for row, part in enumerate(observation.parts):
        if isinstance(part, AddedObservationPart):
            continue
        kind = PART_KINDS.index(part.name)
        places[kind], options[kind] = starts[row, 0], _option(part)
    sizes = _robot_sizes(task)
    room = (0, MAX_PARTS - len(observation.parts))
    return {
        "part_places": places,
        "part_options": options,
        "batches": observation.batches * len(task.lidar.mount.places),
        "rays_per_batch": task.lidar.rays // (observation.batches or 1),
        "trail_sectors": next((part.sectors for part in observation.parts if isinstance(part, TrailPart)), 0),
        "known_sectors": next((part.sectors for part in observation.parts if isinstance(part, KnownPart)), 0),
        "reach_sectors": next((part.sectors for part in observation.parts if isinstance(part, ReachPart)), 0),
        "frames": observation.frames,
        "parts": len(observation.parts),
        "part_sizes": np.pad([part_size(part, *sizes) for part in observation.parts], room),
        "part_frames": np.pad([part.frames for part in observation.parts], room),
        "part_starts": starts,
        "near": near_distance(task),
    }


def _option(part: ObservationPart) -> int:
    """The one choice that a part has, as 0 for how the paper has it or 1."""
    match part:
        case RangesPart():
            return int(part.inverse)
        case DistancePart() | HeadingPart():
            return int(part.scaling in ("saturating", "signed"))
        case BearingPart():
            return int(part.encoding == "sine_cosine")
        case TrailPart():
            return int(part.memory == "long")
        case ReachPart() | KnownPart():
            return int(part.progress)
        case OpeningsPart():
            return part.count
        case _:
            return 0

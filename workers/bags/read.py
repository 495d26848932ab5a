"""A robot's recording as arrays: scans, odometry, commands and goals on one clock, in the frame of the odometry."""

import math
from collections import Counter
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from workers.bags import cdr
from workers.bags.files import GOAL, ODOMETRY, SCAN, TRANSFORMS, TWISTS, Contents, Raw, read_contents
from workers.bags.results import Role, Topic, TopicChoice
from workers.bags.transforms import Frames
from workers.errors import BagError
from workers.wording import counted

Reals = NDArray[np.float64]

_TYPES: dict[Role, tuple[str, ...]] = {"scan": (SCAN,), "odometry": (ODOMETRY,), "commands": TWISTS, "goal": (GOAL,)}
_NAMES: dict[Role, str] = {"scan": "scans", "odometry": "odometry", "commands": "commands", "goal": "goals"}
_OTHER_CLOCK_SECONDS = 5.0
"""Stamps further than this from their arrival are of another clock."""
_FEWEST = 10
CLOCK = 1e-6
"""Seconds since 1970 are not known more finely in a float."""
_MOST_BEAMS = 20_000
_LONGEST_SECONDS = 4 * 3_600.0
_STANDS = 1e-4

_Message = TypeVar("_Message")


@dataclass(frozen=True, eq=False)
class Scans:
    """Of one LiDAR.

    Attributes:
        times: (n,) seconds.
        ranges: (n, beams) as they were measured, metres.
        bearings: (beams,) against the heading, radians, not wrapped.
        range_min, range_max: what it can measure.
        at: x and y on the robot, metres.
    """

    times: Reals
    ranges: NDArray[np.float32]
    bearings: Reals
    range_min: float
    range_max: float
    at: tuple[float, float]

    def met(self) -> NDArray[np.bool_]:
        """(n, beams) whether a beam met something."""
        with np.errstate(invalid="ignore"):
            return np.isfinite(self.ranges) & (self.ranges > max(self.range_min, 0.0)) & (self.ranges < self.range_max)


@dataclass(frozen=True, eq=False)
class Motion:
    """What the odometry says.

    Attributes:
        times: (n,) seconds.
        poses: (n, 3) x, y and heading, which is unwrapped.
        velocities: (n, 3) forwards and to the left, m/s, and turning, rad/s.
    """

    times: Reals
    poses: Reals
    velocities: Reals

    def pose_at(self, times: Reals) -> Reals:
        """(m, 3) poses, in between on straight lines."""
        return np.stack([np.interp(times, self.times, self.poses[:, column]) for column in range(3)], axis=1)


@dataclass(frozen=True, eq=False)
class Commands:
    """What the robot was asked for: (n,) seconds and (n, 3) velocities, each until the next."""

    times: Reals
    velocities: Reals

    def at(self, times: Reals) -> Reals:
        """(m, 3) in force then; nan before the first."""
        places = np.searchsorted(self.times, times + CLOCK, side="right") - 1
        found = self.velocities[np.maximum(places, 0)]
        return np.where(places[:, None] < 0, np.nan, found)


@dataclass(frozen=True, eq=False)
class Bag:
    """A recording; its times begin with 0.

    Attributes:
        scans, motion: what it must have.
        commands: None where there are none.
        goals: (k, 3) time, x and y, at least one.
        seconds: that it lasts.
        topics: that could be read.
        notes: what one should know of it.
    """

    scans: Scans
    motion: Motion
    commands: Commands | None
    goals: Reals
    seconds: float
    topics: tuple[Topic, ...]
    notes: tuple[str, ...]


def read_bag(path: Path, choice: TopicChoice, scratch: Path) -> Bag:
    """Read a recording.

    Args:
        path: of the file.
        choice: of its topics.
        scratch: a folder for what is unpacked.

    Raises:
        BagError: it can't be read, or has no scans or no odometry.
    """
    contents = read_contents(path, scratch)
    topics = _topics(contents, choice)
    chosen = {topic.role: topic.name for topic in topics if topic.chosen}
    for role in ("scan", "odometry"):
        if role not in chosen:
            there = ", ".join(f"{name} ({kind})" for name, kind in sorted(contents.types.items())[:12])
            raise BagError(f"no {_NAMES[role]} with messages are in the recording ({_TYPES[role][0]}); there are {there}")
    notes = ["The recording ends in the middle of a message: what came before is read."] if contents.cut else []
    told = [
        transform
        for name, kind in contents.types.items()
        if kind == TRANSFORMS
        for message in _decoded(contents.messages.get(name, []), cdr.transforms)
        for transform in message[1]
    ]
    frames = Frames(told)
    scans = _decoded(contents.messages[chosen["scan"]], cdr.laser_scan)
    odometry = _decoded(contents.messages[chosen["odometry"]], cdr.odometry)
    clock = _Clock([*scans, *odometry])
    if not clock.stamps:
        notes.append("Its stamps are of another clock than the recorder's: messages are taken for as old as their arrival.")
    motion = _motion(odometry, clock, notes)
    first = odometry[0][1]
    read_scans = _scans(scans, clock, frames, first.child_frame, notes)
    commands = None
    if "commands" in chosen:
        kind = contents.types[chosen["commands"]]
        commands = _commands(_decoded(contents.messages[chosen["commands"]], cdr.COMMANDS[kind]), clock)
    start = min(motion.times[0], read_scans.times[0])
    seconds = float(max(motion.times[-1], read_scans.times[-1]) - start)
    if seconds > _LONGEST_SECONDS:
        raise BagError("the recording lasts longer than four hours: upload a part of it")
    goals = []
    if "goal" in chosen:
        messages = _decoded(contents.messages[chosen["goal"]], cdr.stamped_pose)
        goals = _goals(messages, clock, frames, first.stamp.frame, start, notes)
    if not goals:
        x, y, _ = motion.poses[-1]
        goals = [(0.0, float(x), float(y))]
        notes.append("It has no goal that can be used: where the robot ended is taken for it.")
    return Bag(
        scans=_shifted(read_scans, start),
        motion=_shifted(motion, start),
        commands=None if commands is None else _shifted(commands, start),
        goals=np.array(goals),
        seconds=seconds,
        topics=topics,
        notes=tuple(notes),
    )


def _shifted(what: Any, start: float) -> Any:
    return type(what)(**{**vars(what), "times": what.times - start})


def _topics(contents: Contents, choice: TopicChoice) -> tuple[Topic, ...]:
    """What could be read as what; of each role one is chosen."""
    found = []
    for role, types in _TYPES.items():
        wanted = getattr(choice, role)
        there = [(len(contents.messages.get(name, ())), name) for name, kind in contents.types.items() if kind in types]
        there = sorted(((count, name) for count, name in there if count), key=lambda each: (-each[0], each[1]))
        if wanted is not None and wanted not in (name for _, name in there):
            raise BagError(f"no {_NAMES[role]} are on {wanted}: choose another topic")
        first = wanted or (there[0][1] if there else None)
        found += [Topic(role=role, name=n, type=contents.types[n], messages=c, chosen=n == first) for c, n in there]
    return tuple(found)


def _decoded(raws: Sequence[Raw], decode: Callable[[bytes], _Message]) -> list[tuple[float, _Message]]:
    return [(raw.at, decode(raw.data)) for raw in raws]


class _Clock:
    """Tells when a message was measured: its stamp where these go with the recorder's clock, else its arrival.

    Args:
        messages: with stamps.
    """

    def __init__(self, messages: Sequence[tuple[float, Any]]) -> None:
        late = np.array([at - message.stamp.seconds for at, message in messages])
        self.stamps = bool(abs(np.median(late)) < _OTHER_CLOCK_SECONDS)

    def when(self, at: float, message: Any) -> float:
        """Seconds."""
        stamped = self.stamps and message.stamp is not None and abs(at - message.stamp.seconds) < _OTHER_CLOCK_SECONDS
        return float(message.stamp.seconds) if stamped else at


def _in_order(times: Reals) -> NDArray[np.int64]:
    """Places of what is later than all before it."""
    order = np.argsort(times, kind="stable")
    kept = np.concatenate(([True], np.diff(times[order]) > 0.0))
    return order[kept]


def _motion(messages: Sequence[tuple[float, cdr.Odometry]], clock: _Clock, notes: list[str]) -> Motion:
    times = np.array([clock.when(at, message) for at, message in messages])
    poses = np.array([(*message.pose.position[:2], message.pose.yaw) for _, message in messages])
    velocities = np.array([(v.forwards, v.left, v.turning) for v in (message.velocities for _, message in messages)])
    good = np.flatnonzero(np.isfinite(poses).all(axis=1) & np.isfinite(velocities).all(axis=1))
    places = good[_in_order(times[good])] if len(good) else good
    if len(places) < _FEWEST:
        raise BagError(f"the odometry has fewer than {_FEWEST} messages that can be used: record for longer")
    times, poses, velocities = times[places], poses[places], velocities[places]
    poses[:, 2] = np.unwrap(poses[:, 2])
    moved = np.ptp(poses, axis=0).max() > 0.05
    if moved and np.abs(velocities).max() < _STANDS:
        notes.append("Its odometry has no velocities: they are those between its poses.")
        velocities = _between(times, poses)
    return Motion(times, poses, velocities)


def _between(times: Reals, poses: Reals) -> Reals:
    """Velocities of a robot's way, each over the time that led there."""
    steps = np.diff(poses, axis=0) / np.diff(times)[:, None]
    heading = 0.5 * (poses[1:, 2] + poses[:-1, 2])
    cos, sin = np.cos(heading), np.sin(heading)
    own = np.stack((cos * steps[:, 0] + sin * steps[:, 1], cos * steps[:, 1] - sin * steps[:, 0], steps[:, 2]), axis=1)
    return np.concatenate((own[:1], own))


def _scans(
    messages: Sequence[tuple[float, cdr.LaserScan]], clock: _Clock, frames: Frames, base: str, notes: list[str]
) -> Scans:
    layouts = Counter((len(m.ranges), m.angle_min, m.angle_increment, m.range_max) for _, m in messages)
    (layout, count) = layouts.most_common(1)[0]
    beams, angle_min, increment, range_max = layout
    if not (3 <= beams <= _MOST_BEAMS and increment and range_max > 0.0 and np.isfinite(layout).all()):
        raise BagError(f"the scans make no sense: {beams} beams, {increment:g} rad apart, up to {range_max:g} m")
    if count < len(messages):
        notes.append(
            f"{counted(len(messages) - count)} of {counted(len(messages))} scans have other angles than most: "
            "they are left out."
        )
    kept = [
        (clock.when(at, m), m)
        for at, m in messages
        if (len(m.ranges), m.angle_min, m.angle_increment, m.range_max) == layout
    ]
    times = np.array([at for at, _ in kept])
    places = _in_order(times)
    if len(places) < _FEWEST:
        raise BagError(f"there are fewer than {_FEWEST} scans of one kind: record for longer")
    first = kept[int(places[0])][1]
    bearings: Reals = angle_min + increment * np.arange(beams, dtype=np.float64)
    matrix = frames.pose(first.stamp.frame, base, first.stamp.seconds)
    x, y = 0.0, 0.0
    if matrix is None:
        notes.append(
            f"No transform leads from {first.stamp.frame or 'the LiDAR'} to {base or 'the robot'} (record /tf and "
            "/tf_static): the LiDAR is taken to stand in the robot's middle, looking ahead."
        )
    else:
        # A LiDAR that hangs upside down turns the other way round.
        bearings = math.atan2(matrix[1, 0], matrix[0, 0]) + math.copysign(1.0, matrix[2, 2]) * bearings
        x, y = float(matrix[0, 3]), float(matrix[1, 3])
    return Scans(
        times=times[places],
        ranges=np.stack([kept[int(place)][1].ranges for place in places]),
        bearings=bearings,
        range_min=first.range_min,
        range_max=range_max,
        at=(x, y),
    )


def _commands(messages: Sequence[tuple[float, cdr.Command]], clock: _Clock) -> Commands | None:
    times = np.array([clock.when(at, message) for at, message in messages])
    velocities = np.array([(v.forwards, v.left, v.turning) for v in (message.velocities for _, message in messages)])
    good = np.flatnonzero(np.isfinite(velocities).all(axis=1))
    if not len(good):
        return None
    places = good[_in_order(times[good])]
    return Commands(times[places], velocities[places])


def _goals(
    messages: Sequence[tuple[float, cdr.Goal]], clock: _Clock, frames: Frames, odom: str, start: float, notes: list[str]
) -> list[tuple[float, float, float]]:
    goals, lost = [], set()
    for at, message in messages:
        x, y, z = message.pose.position
        frame = message.stamp.frame
        if frame and odom and frame.lstrip("/") != odom.lstrip("/"):
            matrix = frames.pose(frame, odom, message.stamp.seconds or at)
            if matrix is None:
                lost.add(frame)
                continue
            x, y, _, _ = (matrix @ (x, y, z, 1.0)).tolist()
        if math.isfinite(x) and math.isfinite(y):
            goals.append((clock.when(at, message) - start, x, y))
    notes += [
        f"Goals in the frame {frame} are left out: no transform leads from there to {odom} (record /tf)."
        for frame in sorted(lost)
    ]
    return sorted(goals)

"""Gazebo worlds (SDF): their cylinders, boxes and spheres, seen from above, and what moves; BARN's with start and goal.

Only collision shapes count, as for Gazebo's physics. A shape that we cannot represent is an error and not left out: a wall
that is missing in training would be there on the day.
"""

import math
import re
from collections.abc import Iterator
from io import BytesIO
from pathlib import PurePath
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import iterparse
from pydantic import ValidationError

from sim.arenas.files.limits import MAX_DEPTH, MAX_SDF_BYTES, MAX_XML_EVENTS
from sim.arenas.files.moving import ACTOR_RADIUS, Motions, Way, check_world_plugins, way_of, way_of_actor
from sim.arenas.files.own_yaml import describe
from sim.arenas.files.sdf_poses import Pose, compose, numbers_of, pose_of
from sim.config import MAX_OBSTACLES, MAX_SIDE, ArenaFile, Box, Circle, Keyframe, Start, Target, Timed
from sim.errors import ArenaFormatError, ArenaLimitError

# Includes that bring no obstacle.
_HARMLESS = {"model://sun", "model://ground_plane"}
# What ends below this height is floor, metres.
_FLOOR = 0.02
# Room around the obstacles of a world without a plan of its own, metres.
_MARGIN = 1.0

# DynaBARN's worlds (Nair et al. 2022) have `<pose frame=>`, which is no XML: an empty frame is meant.
_UNFINISHED_FRAME = re.compile(rb"(<pose\s+frame\s*=)\s*(?=>)")

# BARN (Perille et al. 2020): start and goal of every world; nothing but equal cylinders around x = -4.5..0.
_BARN_RADIUS = 0.075
_BARN_FIELD = (-4.5, 0.0, 0.0, 9.6)
_BARN_SLACK = 0.02
_BARN_START = (-2.25, 3.0, 90.0)
_BARN_GOAL = (-2.25, 13.0)


def read_sdf(name: str, content: bytes, motions: Motions) -> ArenaFile:
    """The arena in a Gazebo world; its middle becomes the origin.

    Args:
        name: of the file.
        content: its bytes.
        motions: what the files beside it say of what moves.

    Raises:
        ArenaLimitError: the file is too large, or holds too many obstacles.
        ArenaFormatError: it is no SDF, or holds what cannot be represented.
    """
    if len(content) > MAX_SDF_BYTES:
        raise ArenaLimitError(f"{name}: a Gazebo world may have {MAX_SDF_BYTES // 2**20} MiB, and this one is larger")
    root = _parse(name, content)
    world = root if root.tag == "world" else root.find("world")
    if root.tag not in {"sdf", "world"} or world is None:
        raise ArenaFormatError(f"{name}: no <world> in it; give the .world or .sdf file of a Gazebo world")
    check_world_plugins(name, world)
    seen = _Seen(motions)
    for place, pose, geometry, way in _shapes(name, world, seen):
        seen.add(place, _shape(place, pose, geometry), way)
        if len(seen.circles) + len(seen.boxes) > MAX_OBSTACLES:
            raise ArenaLimitError(f"{name}: more than {MAX_OBSTACLES} obstacles; keep the part that matters")
    for actor in world.findall("actor"):
        place = f"{name}, actor {actor.get('name', '?')[:80]!r}"
        seen.movers.append(_timed(place, way_of_actor(place, actor), 0.0, 0.0, ACTOR_RADIUS))
    if unused := sorted(motions.ways.keys() - seen.used - _aliases(motions, seen.used)):
        raise ArenaFormatError(
            f"{name}: keyframes are given for {unused[0][:80]!r}, and no model or plugin of that name is in it"
        )
    return _document(name, seen)


class _Seen:
    """What was found so far, in the world's frame."""

    def __init__(self, motions: Motions) -> None:
        self.motions = motions
        self.circles: list[Circle] = []
        self.boxes: list[Box] = []
        self.movers: list[Timed] = []
        self.used: set[str] = set()

    def add(self, place: str, shape: Circle | Box | None, way: Way | None) -> None:
        """One more shape, which stands still or goes a way; a way's shape is where it is against its model."""
        if shape is None:
            return
        if way is not None:
            if isinstance(shape, Box):
                raise ArenaFormatError(f"{place}: it moves, and of what moves only cylinders and spheres are read")
            self.movers.append(_timed(place, way, shape.x, shape.y, shape.radius))
        elif isinstance(shape, Circle):
            self.circles.append(shape)
        else:
            self.boxes.append(shape)


def _aliases(motions: Motions, used: set[str]) -> set[str]:
    """Names that stand for the same way as one that was used: a plugin's source has its own name and its class's."""
    ways = {id(motions.ways[name]) for name in used}
    return {name for name, way in motions.ways.items() if id(way) in ways}


def _timed(place: str, way: Way, x: float, y: float, radius: float) -> Timed:
    """A disc at (x, y) of what goes a way, metres."""
    frames = tuple(Keyframe(t=frame.t, x=frame.x + x, y=frame.y + y) for frame in way.keyframes)
    try:
        return Timed(kind="timed", radius=radius, keyframes=frames, loops=way.loops)
    except ValidationError as error:
        raise ArenaFormatError(f"{place}: {describe(error)}") from error


def _parse(name: str, content: bytes) -> Element:
    """The root element; what is nested without end is refused while it is read."""
    depth = 0
    root: Element | None = None
    try:
        repaired = _UNFINISHED_FRAME.sub(rb"\1''", content)
        for count, (event, element) in enumerate(iterparse(BytesIO(repaired), ("start", "end"), forbid_dtd=True)):
            depth += 1 if event == "start" else -1
            root = element if root is None else root
            if depth > MAX_DEPTH or count > MAX_XML_EVENTS:
                raise ArenaLimitError(
                    f"{name}: more than {MAX_XML_EVENTS // 2:,} elements, or nested over {MAX_DEPTH} levels deep"
                )
    except DefusedXmlException as error:
        raise ArenaFormatError(f"{name}: document types and entities are not read, for safety; remove them") from error
    except (ParseError, ValueError, LookupError) as error:
        raise ArenaFormatError(f"{name}: not readable as XML: {error}") from error
    if root is None:
        raise ArenaFormatError(f"{name}: an empty file")
    return root


def _shapes(name: str, world: Element, seen: _Seen) -> Iterator[tuple[str, Pose, Element, Way | None]]:
    """Where it stands in the file, pose and geometry of every collision shape, and the way that it goes, if it moves."""
    for include in world.iter("include"):
        uri = (include.findtext("uri") or "").strip()
        if uri not in _HARMLESS:
            raise ArenaFormatError(f"{name}: it includes {uri[:80]!r}, another file; put the model itself into the world")
    if world.find("population") is not None:
        raise ArenaFormatError(f"{name}: a <population> is not read; put its models themselves into the world")
    for model in world.findall("model"):
        yield from _of_model(f"{name}, model {model.get('name', '?')[:80]!r}", model, (0.0, 0.0, 0.0, 0.0), seen)


def _of_model(place: str, model: Element, outer: Pose, seen: _Seen) -> Iterator[tuple[str, Pose, Element, Way | None]]:
    found = way_of(place, model, seen.motions)
    height = compose(outer, pose_of(place, model))
    if found is not None:
        seen.used.add(found[0])
        if model.find("model") is not None:
            raise ArenaFormatError(
                f"{place}: it moves, and models within it are not read: put its shape into a <link> of its own"
            )
    # Keyframes say where a model is whatever its own pose; its height stays.
    own = height if found is None else (0.0, 0.0, height[2], 0.0)
    for link in model.findall("link"):
        of_link = compose(own, pose_of(place, link))
        for collision in link.findall("collision"):
            geometry = collision.find("geometry")
            for shape in () if geometry is None else geometry:
                yield place, compose(of_link, pose_of(place, collision)), shape, found and found[1]
    for nested in model.findall("model"):
        yield from _of_model(place, nested, own, seen)


def _shape(place: str, pose: Pose, shape: Element) -> Circle | Box | None:
    """The shape from above; None where it is floor."""
    x, y, z, yaw = pose
    if shape.tag == "plane":
        return None
    if shape.tag == "box":
        length, width, height = numbers_of(place, shape.find("size"), 3)
    elif shape.tag == "cylinder":
        ((radius,), (height,)) = numbers_of(place, shape.find("radius"), 1), numbers_of(place, shape.find("length"), 1)
    elif shape.tag == "sphere":
        (radius,) = numbers_of(place, shape.find("radius"), 1)
        height = 2.0 * radius
    else:
        raise ArenaFormatError(f"{place}: a {shape.tag[:40]} is not read; only cylinders, boxes, spheres and planes are")
    if z + 0.5 * height <= _FLOOR:
        return None
    try:
        if shape.tag == "box":
            return Box(x=x, y=y, length=length, width=width, angle=math.degrees(math.remainder(yaw, math.tau)))
        return Circle(x=x, y=y, radius=radius)
    except ValidationError as error:
        raise ArenaFormatError(f"{place}: {describe(error)}") from error


def _document(name: str, seen: _Seen) -> ArenaFile:
    """What was found around its middle, with walls where it ends."""
    circles, boxes, movers = seen.circles, seen.boxes, seen.movers
    if not circles and not boxes and not movers:
        raise ArenaFormatError(f"{name}: no obstacle in it")
    ways = [Circle(x=frame.x, y=frame.y, radius=mover.radius) for mover in movers for frame in mover.keyframes]
    low_x, low_y, high_x, high_y = _bounds(circles + ways, boxes)
    start, target = seen.motions.start, seen.motions.target
    if not movers and _is_barn(circles, boxes, (low_x, low_y, high_x, high_y)):
        # The field's outer columns stand where the walls do; the goal lies beyond its far end.
        high_y = _BARN_GOAL[1] + _MARGIN
        start = Start(x=_BARN_START[0], y=_BARN_START[1], heading=_BARN_START[2])
        target = Target(x=_BARN_GOAL[0], y=_BARN_GOAL[1])
    else:
        low_x, low_y, high_x, high_y = low_x - _MARGIN, low_y - _MARGIN, high_x + _MARGIN, high_y + _MARGIN
    x, y = 0.5 * (low_x + high_x), 0.5 * (low_y + high_y)
    if max(high_x - low_x, high_y - low_y) > MAX_SIDE:
        raise ArenaLimitError(f"{name}: {high_x - low_x:.0f} x {high_y - low_y:.0f} m; an arena may be {MAX_SIDE:g} m long")
    try:
        return ArenaFile(
            name=PurePath(name).stem[:80] or "world",
            width=high_x - low_x,
            height=high_y - low_y,
            circles=tuple(Circle(x=c.x - x, y=c.y - y, radius=c.radius) for c in circles),
            boxes=tuple(Box(x=b.x - x, y=b.y - y, length=b.length, width=b.width, angle=b.angle) for b in boxes),
            movers=tuple(_moved(mover, -x, -y) for mover in movers),
            start=None if start is None else Start(x=start.x - x, y=start.y - y, heading=start.heading),
            target=None if target is None else Target(x=target.x - x, y=target.y - y),
        )
    except ValidationError as error:
        raise ArenaFormatError(f"{name}: {describe(error)}") from error


def _moved(mover: Timed, x: float, y: float) -> Timed:
    keyframes = tuple(Keyframe(t=frame.t, x=frame.x + x, y=frame.y + y) for frame in mover.keyframes)
    return mover.model_copy(update={"keyframes": keyframes})


def _bounds(circles: list[Circle], boxes: list[Box]) -> tuple[float, float, float, float]:
    """Lowest x and y, highest x and y of all obstacles."""
    spans = [(c.x, c.y, c.radius, c.radius) for c in circles]
    for box in boxes:
        cos, sin = abs(math.cos(math.radians(box.angle))), abs(math.sin(math.radians(box.angle)))
        spans.append((box.x, box.y, 0.5 * (cos * box.length + sin * box.width), 0.5 * (sin * box.length + cos * box.width)))
    return (
        min(x - dx for x, _, dx, _ in spans),
        min(y - dy for _, y, _, dy in spans),
        max(x + dx for x, _, dx, _ in spans),
        max(y + dy for _, y, _, dy in spans),
    )


def _is_barn(circles: list[Circle], boxes: list[Box], bounds: tuple[float, float, float, float]) -> bool:
    """Whether this is the field of a BARN world: equal thin cylinders over x = -4.5..0, y = 0..9.6."""
    return (
        not boxes
        and all(abs(circle.radius - _BARN_RADIUS) < 1e-6 for circle in circles)
        and all(abs(found - known) < _BARN_SLACK for found, known in zip(bounds, _BARN_FIELD, strict=True))
    )

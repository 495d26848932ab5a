"""Gazebo worlds (SDF): their cylinders, boxes and spheres, seen from above; BARN's worlds with their start and goal.

Only collision shapes count, as for Gazebo's physics. A shape that we cannot represent is an error and not left out: a wall
that is missing in training would be there on the day.
"""

import math
from collections.abc import Iterator
from io import BytesIO
from pathlib import PurePath
from xml.etree.ElementTree import Element, ParseError

from defusedxml import DefusedXmlException
from defusedxml.ElementTree import iterparse
from pydantic import ValidationError

from sim.arenas.files.limits import MAX_DEPTH, MAX_SDF_BYTES, MAX_XML_EVENTS
from sim.arenas.files.own_yaml import describe
from sim.config import MAX_OBSTACLES, MAX_SIDE, ArenaFile, Box, Circle, Start, Target
from sim.errors import ArenaFormatError, ArenaLimitError

# Includes that bring no obstacle.
_HARMLESS = {"model://sun", "model://ground_plane"}
# What ends below this height is floor, metres.
_FLOOR = 0.02
# A cylinder that leans by more than this is no circle from above, radians.
_UPRIGHT = 0.01
# Room around the obstacles of a world without a plan of its own, metres.
_MARGIN = 1.0

# BARN (Perille et al. 2020): start and goal of every world; nothing but equal cylinders around x = -4.5..0.
_BARN_RADIUS = 0.075
_BARN_FIELD = (-4.5, 0.0, 0.0, 9.6)
_BARN_SLACK = 0.02
_BARN_START = (-2.25, 3.0, 90.0)
_BARN_GOAL = (-2.25, 13.0)

_Pose = tuple[float, float, float, float]


def read_sdf(name: str, content: bytes) -> ArenaFile:
    """The arena in a Gazebo world; its middle becomes the origin.

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
    circles: list[Circle] = []
    boxes: list[Box] = []
    for place, pose, geometry in _shapes(name, world):
        shape = _shape(place, pose, geometry)
        if isinstance(shape, Circle):
            circles.append(shape)
        elif shape is not None:
            boxes.append(shape)
        if len(circles) + len(boxes) > MAX_OBSTACLES:
            raise ArenaLimitError(f"{name}: more than {MAX_OBSTACLES} obstacles; keep the part that matters")
    return _document(name, circles, boxes)


def _parse(name: str, content: bytes) -> Element:
    """The root element; what is nested without end is refused while it is read."""
    depth = 0
    root: Element | None = None
    try:
        for count, (event, element) in enumerate(iterparse(BytesIO(content), ("start", "end"), forbid_dtd=True)):
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


def _shapes(name: str, world: Element) -> Iterator[tuple[str, _Pose, Element]]:
    """Where it stands in the file, pose and geometry of every collision shape."""
    for include in world.iter("include"):
        uri = (include.findtext("uri") or "").strip()
        if uri not in _HARMLESS:
            raise ArenaFormatError(f"{name}: it includes {uri[:80]!r}, another file; put the model itself into the world")
    for model in world.findall("model"):
        yield from _of_model(f"{name}, model {model.get('name', '?')[:80]!r}", model, (0.0, 0.0, 0.0, 0.0))


def _of_model(place: str, model: Element, outer: _Pose) -> Iterator[tuple[str, _Pose, Element]]:
    own = _compose(outer, _pose(place, model))
    for link in model.findall("link"):
        of_link = _compose(own, _pose(place, link))
        for collision in link.findall("collision"):
            geometry = collision.find("geometry")
            for shape in () if geometry is None else geometry:
                yield place, _compose(of_link, _pose(place, collision)), shape
    for nested in model.findall("model"):
        yield from _of_model(place, nested, own)


def _pose(place: str, element: Element) -> _Pose:
    """x, y, z and yaw against the parent."""
    pose = element.find("pose")
    if pose is None or not (pose.text or "").strip():
        return 0.0, 0.0, 0.0, 0.0
    if pose.get("relative_to"):
        raise ArenaFormatError(
            f"{place}: a pose relative to {pose.get('relative_to', '')[:80]!r} is not read; give it in the parent's frame"
        )
    x, y, z, roll, pitch, yaw = _numbers(place, pose, 6)
    if max(abs(math.sin(roll)), abs(math.sin(pitch))) > _UPRIGHT:
        raise ArenaFormatError(f"{place}: it leans (roll {roll:g}, pitch {pitch:g}); only upright shapes are read")
    return x, y, z, yaw


def _numbers(place: str, element: Element | None, count: int) -> list[float]:
    text = "" if element is None else element.text or ""
    try:
        numbers = [float(part) for part in text.split()]
    except ValueError:
        numbers = []
    if len(numbers) != count or not all(math.isfinite(number) for number in numbers):
        raise ArenaFormatError(
            f"{place}: expected {count} finite number{'s' if count > 1 else ''}, and found {text.strip()[:80]!r}"
        )
    return numbers


def _compose(outer: _Pose, inner: _Pose) -> _Pose:
    x, y, z, yaw = outer
    cos, sin = math.cos(yaw), math.sin(yaw)
    return x + cos * inner[0] - sin * inner[1], y + sin * inner[0] + cos * inner[1], z + inner[2], yaw + inner[3]


def _shape(place: str, pose: _Pose, shape: Element) -> Circle | Box | None:
    """The shape from above; None where it is floor."""
    x, y, z, yaw = pose
    if shape.tag == "plane":
        return None
    if shape.tag == "box":
        length, width, height = _numbers(place, shape.find("size"), 3)
    elif shape.tag == "cylinder":
        ((radius,), (height,)) = _numbers(place, shape.find("radius"), 1), _numbers(place, shape.find("length"), 1)
    elif shape.tag == "sphere":
        (radius,) = _numbers(place, shape.find("radius"), 1)
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


def _document(name: str, circles: list[Circle], boxes: list[Box]) -> ArenaFile:
    """The obstacles around their middle, with walls where they end."""
    if not circles and not boxes:
        raise ArenaFormatError(f"{name}: no obstacle in it")
    low_x, low_y, high_x, high_y = _bounds(circles, boxes)
    start: Start | None = None
    target: Target | None = None
    if _is_barn(circles, boxes, (low_x, low_y, high_x, high_y)):
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
            start=None if start is None else Start(x=start.x - x, y=start.y - y, heading=start.heading),
            target=None if target is None else Target(x=target.x - x, y=target.y - y),
        )
    except ValidationError as error:
        raise ArenaFormatError(f"{name}: {describe(error)}") from error


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

"""Numbers and poses of an SDF file, seen from above."""

import math
from xml.etree.ElementTree import Element

from sim.errors import ArenaFormatError

# What leans by more than this is not upright, radians.
_UPRIGHT = 0.01

Pose = tuple[float, float, float, float]
"""x, y, z, metres, and yaw, radians."""


def pose_of(place: str, element: Element) -> Pose:
    """x, y, z and yaw against the parent."""
    pose = element.find("pose")
    if pose is None or not (pose.text or "").strip():
        return 0.0, 0.0, 0.0, 0.0
    if pose.get("relative_to"):
        raise ArenaFormatError(
            f"{place}: a pose relative to {pose.get('relative_to', '')[:80]!r} is not read; give it in the parent's frame"
        )
    x, y, z, roll, pitch, yaw = numbers_of(place, pose, 6)
    if max(abs(math.sin(roll)), abs(math.sin(pitch))) > _UPRIGHT:
        raise ArenaFormatError(f"{place}: it leans (roll {roll:g}, pitch {pitch:g}); only upright shapes are read")
    return x, y, z, yaw


def numbers_of(place: str, element: Element | None, count: int) -> list[float]:
    """The numbers in an element's text; ArenaFormatError where they are not `count` finite ones."""
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


def compose(outer: Pose, inner: Pose) -> Pose:
    """A pose that is given in the frame of another."""
    x, y, z, yaw = outer
    cos, sin = math.cos(yaw), math.sin(yaw)
    return x + cos * inner[0] - sin * inner[1], y + sin * inner[0] + cos * inner[1], z + inner[2], yaw + inner[3]

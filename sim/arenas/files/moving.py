"""What moves in a Gazebo world: actors by trajectories, models by keyframes beside the world; the rest is refused by name.

A plugin that moves a model is compiled code, which nobody can read. Its keyframes can be given: in a file of their own
(`mapless-keyframes/1`, docs/arenas.md), or as the source of a plugin that sets a `PoseAnimation`, as DynaBARN's do (Nair et
al. 2022).
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import PurePath
from typing import Literal
from xml.etree.ElementTree import Element

from pydantic import ConfigDict, Field, ValidationError

from sim.arenas.files.limits import MAX_TEXT_BYTES
from sim.arenas.files.own_yaml import describe, load_yaml
from sim.arenas.files.sdf_poses import pose_of
from sim.config import Frozen, Keyframe, Start, Target
from sim.errors import ArenaFormatError, ArenaLimitError

FORMAT = "mapless-keyframes/1"

ACTOR_RADIUS = 0.25
"""Of a walking person, metres: an actor has a skin and no collision shape."""

# Plugins of a world that move nothing in it.
_STILL = re.compile(
    r"physics|user.?commands|scene.?broadcaster|sensors?|contact|imu|ros.?(init|factory|api|state|time)|clock"
)

_ROUNDING = 0.02  # s, of times that are written to a hundredth

_CLASS = re.compile(r"class\s+(\w+)\s*:\s*public\s+(?:gazebo::)?ModelPlugin")
_ANIMATION = re.compile(r"PoseAnimation\s*\(\s*\"[^\"]*\"\s*,\s*([-+.\deE]+)\s*,\s*(true|false)\s*\)")
_FRAME = re.compile(
    r"CreateKeyFrame\s*\(\s*([-+.\deE]+)\s*\)\s*;\s*key\s*->\s*Translation\s*\(\s*[\w:]*Vector3d?\s*"
    r"\(\s*([-+.\deE]+)\s*,\s*([-+.\deE]+)\s*,[^)]*\)\s*\)"
)


class Way(Frozen):
    """Where something is, by time, in the world's frame."""

    keyframes: tuple[Keyframe, ...] = Field(min_length=2, strict=False)
    loops: bool = True


class _KeyframeFile(Frozen):
    model_config = ConfigDict(strict=True)

    format: Literal["mapless-keyframes/1"]
    start: Start | None = None
    target: Target | None = None
    models: dict[str, Way]


@dataclass(frozen=True)
class Motions:
    """What the files beside a world say.

    Attributes:
        ways: by the name of a model or plugin.
        start, target: of a scenario, in the world's frame.
    """

    ways: Mapping[str, Way]
    start: Start | None = None
    target: Target | None = None


def read_motions(files: Mapping[str, bytes]) -> Motions:
    """The keyframes in files beside a world.

    Raises:
        ArenaLimitError: a file is too large.
        ArenaFormatError: it is neither a keyframe file nor the source of a plugin that sets keyframes.
    """
    ways: dict[str, Way] = {}
    start: Start | None = None
    target: Target | None = None
    for name, content in files.items():
        if PurePath(name).suffix.lower() == ".cc":
            ways |= _of_source(name, content)
            continue
        try:
            read = _KeyframeFile.model_validate({str(key): value for key, value in load_yaml(name, content).items()})
        except ValidationError as error:
            raise ArenaFormatError(
                f"{name}: beside a world only keyframes are read ({FORMAT}): {describe(error)}"
            ) from error
        ways |= read.models
        start, target = read.start or start, read.target or target
    return Motions(ways, start, target)


def _of_source(name: str, content: bytes) -> dict[str, Way]:
    """The keyframes that the source of a Gazebo plugin sets, under the plugin's name and the file's."""
    if len(content) > MAX_TEXT_BYTES:
        raise ArenaLimitError(f"{name}: a plugin's source may have {MAX_TEXT_BYTES // 2**20} MiB, and this one is larger")
    text = content.decode("utf-8", "replace")
    frames = _FRAME.findall(text)
    animation = _ANIMATION.search(text)
    if animation is None or text.count("CreateKeyFrame") != len(frames):
        raise ArenaFormatError(
            f"{name}: not the source of a plugin that only sets keyframes of a PoseAnimation; write them into a file "
            f"({FORMAT})"
        )
    try:
        places = [(float(t), float(x), float(y)) for t, x, y in frames]
        length = float(animation[1])
        if places and length < places[-1][0] - _ROUNDING:
            raise ArenaFormatError(f"{name}: it lasts {length:g} s, and has a keyframe at {places[-1][0]:g} s")
        if places and length > places[-1][0] + _ROUNDING:
            places.append((length, *places[-1][1:]))  # it waits where it has come to
        way = _way(places, loops=animation[2] == "true")
    except ValidationError as error:
        raise ArenaFormatError(f"{name}: {describe(error)}") from error
    except ValueError as error:
        raise ArenaFormatError(f"{name}: {error}") from error
    names = {PurePath(name).stem, *_CLASS.findall(text)}
    return dict.fromkeys(names, way)


def _way(frames: list[tuple[float, float, float]], *, loops: bool) -> Way:
    """A way from times and places; of frames that follow at the same time the last one counts."""
    if frames and frames[0][0] > 0.0:
        frames = [(0.0, *frames[0][1:]), *frames]  # it waits where it begins, in every round
    kept = [one for one, other in pairwise(frames) if other[0] != one[0]] + frames[-1:]
    return Way(keyframes=tuple(Keyframe(t=t, x=x, y=y) for t, x, y in kept), loops=loops)


def check_world_plugins(name: str, world: Element) -> None:
    """Refuse plugins of a world that may move something in it.

    Raises:
        ArenaFormatError: one is not known to be harmless.
    """
    for plugin in world.findall("plugin"):
        if not _STILL.search(_file_of(plugin).lower()):
            raise ArenaFormatError(
                f"{name}: the world's plugin {_shown(plugin)} is code that may move things, and can't be read: take it out "
                "if it does not"
            )


def way_of(place: str, model: Element, motions: Motions) -> tuple[str, Way] | None:
    """How a model moves, and under which name that was found; None where it stands still.

    Raises:
        ArenaFormatError: a plugin moves it, and nothing says how.
    """
    plugins = model.findall("plugin")
    names = [model.get("name", "")]
    for plugin in plugins:
        stem = PurePath(_file_of(plugin)).stem
        names += [plugin.get("name", ""), stem, stem.removeprefix("lib")]
    for name in names:
        if name and name in motions.ways:
            return name, motions.ways[name]
    if plugins:
        raise ArenaFormatError(
            f"{place}: the plugin {_shown(plugins[0])} moves it, which is compiled code and can't be read: give the "
            f"plugin's source (.cc) if it sets keyframes, or a file of keyframes ({FORMAT}) together with the world, or "
            "take the plugin out if it moves nothing"
        )
    return None


def way_of_actor(place: str, actor: Element) -> Way:
    """How an actor walks.

    Raises:
        ArenaFormatError: something else than one trajectory moves it, or nothing.
    """
    if actor.find("plugin") is not None:
        raise ArenaFormatError(f"{place}: a plugin moves it, which can't be read: give it a <trajectory> instead")
    script = actor.find("script")
    trajectories = [] if script is None else script.findall("trajectory")
    if script is None or len(trajectories) != 1:
        raise ArenaFormatError(
            f"{place}: expected one <trajectory>, and found {len(trajectories)}: nothing else says where it is"
        )
    x, y, _, yaw = pose_of(place, actor)
    if (x, y, yaw) != (0.0, 0.0, 0.0):
        raise ArenaFormatError(
            f"{place}: it has a place of its own besides its trajectory, which simulators add up or leave out: give the "
            "waypoints in the world's frame, and no <pose> but a height"
        )
    if _says_no(script, "auto_start"):
        raise ArenaFormatError(f"{place}: it does not start by itself (auto_start), and what starts it can't be read")
    delay = _seconds(place, script.findtext("delay_start", "0"))
    frames = []
    for waypoint in trajectories[0].findall("waypoint"):
        x, y, _, _ = pose_of(place, waypoint)
        frames.append((delay + _seconds(place, waypoint.findtext("time")), x, y))
    try:
        return _way(frames, loops=not _says_no(script, "loop"))
    except ValidationError as error:
        raise ArenaFormatError(f"{place}: {describe(error)}") from error


def _says_no(script: Element, tag: str) -> bool:
    return (script.findtext(tag) or "true").strip().lower() in {"false", "0"}


def _seconds(place: str, text: str | None) -> float:
    try:
        return float(text or "")
    except ValueError as error:
        raise ArenaFormatError(f"{place}: expected a number of seconds, and found {(text or '')[:40]!r}") from error


def _file_of(plugin: Element) -> str:
    return plugin.get("filename") or plugin.get("name") or ""


def _shown(plugin: Element) -> str:
    return f"{plugin.get('name', '')[:60]!r} ({_file_of(plugin)[:60]})"

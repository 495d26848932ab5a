"""Any arena file that we know, recognised by its content."""

import re
from collections.abc import Mapping
from pathlib import Path, PurePath

from sim.arenas.document import check_free_space, check_patrols
from sim.arenas.files.limits import MAX_IMAGE_BYTES, MAX_SDF_BYTES, MAX_TEXT_BYTES
from sim.arenas.files.moving import read_motions
from sim.arenas.files.own_yaml import load_yaml, read_own
from sim.arenas.files.ros_map import parse_info, read_map
from sim.arenas.files.sdf import read_sdf
from sim.config import MAX_MOVERS, ArenaFile
from sim.errors import ArenaFileError, ArenaFormatError, ArenaLimitError

_IMAGES = (".pgm", ".png")
_WORLDS = (".world", ".sdf", ".xml")
_TEXTS = (".yaml", ".yml", ".json")
_SOURCES = (".cc",)  # of plugins that move what is in a world
_LIMITS = (
    dict.fromkeys(_IMAGES, MAX_IMAGE_BYTES)
    | dict.fromkeys(_WORLDS, MAX_SDF_BYTES)
    | dict.fromkeys(_TEXTS + _SOURCES, MAX_TEXT_BYTES)
)
# The name of a plugin's library, without a folder: only what lies beside the world is looked at.
_PLUGIN = re.compile(r"filename\s*=\s*['\"](?:lib)?([\w.-]+)\.so['\"]")
_KNOWN = "an arena in our own YAML, a Gazebo .world or .sdf, or a ROS map (.yaml with its .pgm or .png)"


def read_arena(files: Mapping[str, bytes]) -> ArenaFile:
    """The arena in a file, in a map's YAML and image, or in a world and what says how things move in it.

    Args:
        files: content by file name: one, for a ROS map two, for a world also files of keyframes and sources of plugins.

    Raises:
        ArenaFileError: they are refused; the message says why and what to do.
    """
    images = {name: content for name, content in files.items() if _suffix(name) in _IMAGES}
    others = [name for name in files if name not in images]
    worlds = [name for name in others if _suffix(name) in _WORLDS]
    beside = [name for name in others if len(worlds) == 1 and name not in worlds and _suffix(name) in _TEXTS + _SOURCES]
    others = [name for name in others if name not in beside]
    if len(others) != 1:
        raise ArenaFormatError(f"give {_KNOWN}; here are {len(others)} files besides images")
    name = others[0]
    content = files[name]
    if _suffix(name) not in _LIMITS:
        raise ArenaFormatError(f"{name}: not a kind of file that is read: give {_KNOWN}")
    if content.startswith((b"PK\x03\x04", b"\x1f\x8b")):
        raise ArenaFormatError(f"{name}: a compressed archive; unpack it and give the files in it")
    if _suffix(name) in _WORLDS:
        document = read_sdf(name, content, read_motions({name: files[name] for name in beside}))
    elif "image" in (mapping := load_yaml(name, content)):
        document = _read_map(name, mapping, images)
    else:
        document = read_own(name, content)
    check_free_space(document)
    check_patrols(document)
    return document


def _read_map(name: str, mapping: dict[str, object], images: Mapping[str, bytes]) -> ArenaFile:
    info = parse_info(name, mapping)
    if info.image not in images:
        raise ArenaFormatError(f"{name}: a ROS map needs its image: give {info.image} together with it")
    return read_map(name, info, images[info.image])


def load_arena(*paths: Path) -> ArenaFile:
    """The arena in a file on disk; what belongs to it is looked for beside it if it is not given.

    That is a map's image, and for a world NAME.world its NAME.keyframes.yaml and the sources of the plugins that it names.

    Raises:
        ArenaFileError: the files are refused; nothing larger than its limit is read.
    """
    files = {path.name: _content(path) for path in paths}
    if len(files) == 1 and len(paths) == 1 and _suffix(paths[0].name) in _TEXTS:
        mapping = load_yaml(paths[0].name, files[paths[0].name])
        if "image" in mapping:
            image = parse_info(paths[0].name, mapping).image
            files[image] = _content(paths[0].parent / image)
    if len(files) == 1 and len(paths) == 1 and _suffix(paths[0].name) in _WORLDS:
        plugins = sorted(set(_PLUGIN.findall(files[paths[0].name].decode("utf-8", "replace"))))[:MAX_MOVERS]
        for name in (f"{paths[0].stem}.keyframes.yaml", *(f"{plugin}.cc" for plugin in plugins)):
            if (paths[0].parent / name).is_file():
                files[name] = _content(paths[0].parent / name)
    return read_arena(files)


def _content(path: Path) -> bytes:
    limit = _LIMITS.get(_suffix(path.name))
    if limit is None:
        raise ArenaFormatError(f"{path.name}: not a kind of file that is read: give {_KNOWN}")
    try:
        if not path.is_file():
            raise ArenaFileError(f"{path}: no such file")
        if path.stat().st_size > limit:
            raise ArenaLimitError(f"{path.name}: {path.stat().st_size / 2**20:.0f} MiB; at most {limit // 2**20} are read")
        return path.read_bytes()
    except OSError as error:
        raise ArenaFileError(f"{path}: {error.strerror or error}") from error


def _suffix(name: str) -> str:
    return PurePath(name).suffix.lower()

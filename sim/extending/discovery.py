"""Finding the extensions of this Python environment; one that can't be used is refused by name, and nothing else stops."""

import importlib
import os
import re
import threading
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.metadata import entry_points
from typing import Any, TypeVar, cast

from pydantic import BaseModel, Field, create_model

from sim.extending.base import Frozen
from sim.extending.parts import API_VERSION, Extension, Part

GROUP = "mapless.extensions"
"""The entry-point group: `my_lab = "my_lab:extension"`."""
SETTING = "MAPLESS_EXTENSIONS"
"""The environment variable that names more, separated by commas: `my_lab`, or `my_lab.mapless:extension`."""

MAX_EXTENSIONS = 32
"""Of one environment; what else is found is refused."""

_DEFAULT_ATTRIBUTE = "extension"
_NAME = re.compile(r"^[a-z][a-z0-9_]{0,29}$")
_VERSION = re.compile(r"^[\w.+!-]{1,40}$")
_PART = re.compile(r"^[a-z][a-z0-9_]{0,29}$")
_MAX_SOURCE = 300

_Kind = TypeVar("_Kind", bound=Part)
_Base = TypeVar("_Base", bound=BaseModel)


@dataclass(frozen=True)
class Refused:
    """An extension that is not used.

    Attributes:
        name: as far as it is known: its own, or that under which it was to be found.
        reason: what is wrong with it.
    """

    name: str
    reason: str


@dataclass(frozen=True)
class Found:
    """What was found."""

    extensions: tuple[Extension, ...]
    refused: tuple[Refused, ...]


class UsedExtension(Frozen):
    """An extension that a configuration needs.

    Attributes:
        name: of the extension.
        version: that it was launched with.
        source: how to get it, in the words of its author.
    """

    name: str = Field(pattern=_NAME.pattern)
    version: str = Field(pattern=_VERSION.pattern)
    source: str = Field("", max_length=_MAX_SOURCE)


_looking = threading.Event()


@cache
def installed() -> Found:
    """The extensions of this environment, looked for once in a process.

    Raises:
        ImportError: a declaration imports what is made of the extensions, which are being looked for.
    """
    if _looking.is_set():
        raise ImportError("what declares an extension may import sim.extending and workers.extending only, of Mapless")
    _looking.set()
    try:
        return discover(_named(os.environ.get(SETTING, "")))
    finally:
        _looking.clear()


def discover(more: Iterable[tuple[str, Callable[[], object]]] = ()) -> Found:
    """Load and check every extension.

    Args:
        more: names and loaders besides the entry points of the environment.
    """
    candidates = [(point.name, point.load) for point in sorted(entry_points(group=GROUP), key=lambda point: point.name)]
    extensions: list[Extension] = []
    refused: list[Refused] = []
    for known_as, load in (*candidates, *more):
        try:
            found = load()
        except (Exception, SystemExit) as error:  # whatever a stranger's module raises when it is imported
            refused.append(Refused(known_as, f"it can't be imported: {type(error).__name__}: {error}"))
            continue
        if found in extensions:  # installed, and named in the setting as well
            continue
        try:
            extensions.append(_checked(found, [extension.name for extension in extensions]))
        except (Exception, SystemExit) as error:
            refused.append(Refused(getattr(found, "name", None) or known_as, str(error)))
    return Found(tuple(extensions), tuple(refused))


def added(kind: type[_Kind]) -> tuple[type[_Kind], ...]:
    """The parts of a kind that extensions have added."""
    return tuple(part for extension in installed().extensions for part in extension.parts if issubclass(part, kind))


def with_added(built_in: Any, parts: Iterable[type[Part]]) -> Any:
    """A union of configurations, and those that extensions have added to it."""
    for part in parts:
        built_in = built_in | part
    return built_in


def implementation(part: Part) -> Any:
    """What a part does, imported now.

    Raises:
        ImportError: its module is not there, or can't be imported.
        AttributeError: the module has nothing of this name.
    """
    return imported(type(part).implementation)


def imported(path: str) -> Any:
    """What a dotted path, "package.module:name", leads to; errors as in `implementation`."""
    module, _, name = path.partition(":")
    return getattr(importlib.import_module(module), name)


def complete(part: type[Part], base: type[_Base]) -> type[_Base]:
    """A part with the fields that all of its kind have: a class that is the extension's and Mapless's at once.

    Args:
        part: as the extension declares it.
        base: what Mapless expects of every configuration of this kind.
    """
    bases: Any = (part, base)
    return cast(
        "type[_Base]",
        create_model(part.__name__, __base__=bases, __module__=part.__module__, __doc__=part.__doc__),
    )


def used_by(model: BaseModel) -> tuple[UsedExtension, ...]:
    """The extensions whose parts stand in a configuration, by name."""
    by_name = {extension.name: extension for extension in installed().extensions}
    names = sorted({part.name.partition(".")[0] for part in _parts_in(model)})
    return tuple(
        UsedExtension(name=name, version=by_name[name].version, source=by_name[name].source)
        for name in names
        if name in by_name
    )


def missing(needed: Iterable[UsedExtension], there: Mapping[str, str | None]) -> tuple[UsedExtension, ...]:
    """Those of the needed that are not there in the version that is needed; `there` maps names to versions."""
    return tuple(one for one in needed if there.get(one.name) != one.version)


def wording(extensions: Iterable[UsedExtension]) -> str:
    """'my_lab 1.2, other 3.0'."""
    return ", ".join(f"{one.name} {one.version}" for one in extensions)


def versions() -> dict[str, str]:
    """The extensions of this environment: names to versions."""
    return {extension.name: extension.version for extension in installed().extensions}


def _parts_in(value: object) -> Iterable[Part]:
    if isinstance(value, Part):
        yield value
    if isinstance(value, BaseModel):
        for child in dict(value).values():
            yield from _parts_in(child)
    elif isinstance(value, tuple | list):
        for child in value:
            yield from _parts_in(child)


def _named(setting: str) -> list[tuple[str, Callable[[], object]]]:
    paths = [path.strip() for path in setting.split(",") if path.strip()]
    complete = {path: path if ":" in path else f"{path}:{_DEFAULT_ATTRIBUTE}" for path in paths}
    return [(path, lambda target=target: imported(target)) for path, target in complete.items()]  # type: ignore[misc]


def _checked(found: object, taken: list[str]) -> Extension:
    """The extension, if it can be used.

    Raises:
        ValueError: it can't; says why.
    """
    if not isinstance(found, Extension):
        raise ValueError(f"what it names is a {type(found).__name__}, not a sim.extending.Extension")
    if found.api != API_VERSION:
        raise ValueError(
            f"it was written for version {found.api} of what extensions may use, and this Mapless has version "
            f"{API_VERSION}: install a release of it for that version, or another Mapless"
        )
    if not _NAME.match(found.name):
        raise ValueError(f"its name, {found.name!r}, should be small letters, digits and _, at most 30, a letter first")
    if not _VERSION.match(found.version):
        raise ValueError(f"its version, {found.version!r}, should be such as 1.2")
    if len(found.source) > _MAX_SOURCE:
        raise ValueError(f"its source has more than {_MAX_SOURCE} characters")
    if len(taken) == MAX_EXTENSIONS:
        raise ValueError(f"there are {MAX_EXTENSIONS} extensions already")
    if found.name in taken:
        raise ValueError("there is another extension of this name: keep one of them")
    names: list[str] = []
    for part in found.parts:
        _check_part(part, found.name)
        names.append(part.part_name())
    if twice := sorted({name for name in names if names.count(name) > 1}):
        raise ValueError(f"two of its parts have the name {twice[0]!r}")
    return found


def _check_part(part: object, extension: str) -> None:
    if not (isinstance(part, type) and issubclass(part, Part) and part.kind):
        raise ValueError(f"{part!r} is no part that an extension may add: its class should be RewardTerm, ArenaFamily, ...")
    if part.model_config.get("extra") != "forbid" or not part.model_config.get("frozen"):
        raise ValueError(f"{part.__name__} should be frozen and forbid unknown keys, as every part is from the start")
    name = part.part_name()
    before, dot, after = name.partition(".")
    if (before, dot) != (extension, ".") or not _PART.match(after):
        raise ValueError(
            f"its {part.kind} {name!r} should be named '{extension}.{(after or before).lower()}': names without the "
            "extension's in front are Mapless's own"
        )
    try:
        part.model_validate({})
        part.model_json_schema()
    except Exception as error:  # pydantic's, and those of the part's validators
        raise ValueError(f"{part.__name__} can't be shown in a form ({error}): every field needs a default") from error
    part.check()

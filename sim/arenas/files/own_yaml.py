"""YAML that is read without trusting it, and our own arena format in it."""

from typing import Any, cast

import yaml
from pydantic import ValidationError

from sim.arenas.files.limits import MAX_DEPTH, MAX_EVENTS, MAX_TEXT_BYTES
from sim.config import ArenaFile
from sim.errors import ArenaFormatError, ArenaLimitError

# The parser in C where PyYAML brings it: ten times faster, the same rules.
_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
# How many mistakes a message lists.
_SHOWN = 5


def load_yaml(name: str, content: bytes) -> dict[str, Any]:
    """The mapping in a YAML file.

    Anchors and aliases are refused (a few hundred bytes of them can stand for gigabytes), and so is deep nesting, before
    anything is built.

    Raises:
        ArenaLimitError: the file is too large or too deep.
        ArenaFormatError: it is no YAML, or no mapping.
    """
    if len(content) > MAX_TEXT_BYTES:
        raise ArenaLimitError(f"{name}: a YAML file may have {MAX_TEXT_BYTES // 2**20} MiB, and this one is larger")
    try:
        text = content.decode("utf-8-sig")
        _check_events(name, text)
        document = yaml.load(text, Loader=_Loader)  # noqa: S506 - a safe loader, in C or not
    except UnicodeDecodeError as error:
        raise ArenaFormatError(f"{name}: not a text file in UTF-8") from error
    except (yaml.YAMLError, ValueError) as error:
        raise ArenaFormatError(f"{name}: not readable as YAML: {' '.join(str(error).split())[:300]}") from error
    if not isinstance(document, dict):
        raise ArenaFormatError(f"{name}: expected `key: value` lines, and found something else")
    return cast("dict[str, Any]", document)


def _check_events(name: str, text: str) -> None:
    depth = 0
    for count, event in enumerate(yaml.parse(text, Loader=_Loader)):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if isinstance(event, yaml.AliasEvent) or getattr(event, "anchor", None):
            raise ArenaFormatError(f"{name}: anchors and aliases (& and *) are not read: write the values out")
        if depth > MAX_DEPTH:
            raise ArenaLimitError(f"{name}: nested more than {MAX_DEPTH} levels deep")
        if count > MAX_EVENTS:
            raise ArenaLimitError(f"{name}: more than {MAX_EVENTS:,} values")


def read_own(name: str, content: bytes) -> ArenaFile:
    """An arena in our own format.

    Raises:
        ArenaLimitError: the file is too large.
        ArenaFormatError: it is not that format; the message names the first fields that are wrong.
    """
    document = load_yaml(name, content)
    try:
        return ArenaFile.model_validate(_whole_numbers(document))
    except ValidationError as error:
        raise ArenaFormatError(f"{name}: {describe(error)}") from error


def _whole_numbers(document: dict[str, Any]) -> dict[str, Any]:
    """Lists as they are; a mapping with a key that is not text can't be one of ours."""
    return {str(key): value for key, value in document.items()}


def describe(error: ValidationError) -> str:
    """The first mistakes of a validation, each with its place."""
    problems = error.errors(include_url=False, include_input=False, include_context=False)
    lines = [f"{'.'.join(str(part) for part in one['loc']) or 'file'}: {one['msg']}" for one in problems[:_SHOWN]]
    more = [f"and {len(problems) - _SHOWN} more"] if len(problems) > _SHOWN else []
    return "; ".join(lines + more)


def write_own(document: ArenaFile) -> str:
    """The arena in YAML, one obstacle a line; `read_own` gives the same arena back."""
    lines = []
    for key, value in document.model_dump(mode="json", exclude_none=True).items():
        if key == "movers" and not value:
            continue
        if isinstance(value, list):
            lines.append(f"{key}:" if value else f"{key}: []")
            lines += [f"  - {_flow(item)}" for item in value]
        else:
            lines.append(f"{key}: {_flow(value)}")
    return "\n".join(lines) + "\n"


def _flow(value: Any) -> str:
    text: str = yaml.safe_dump(value, default_flow_style=True, sort_keys=False, width=10_000, allow_unicode=True)
    return text.removesuffix("\n").removesuffix("\n...")

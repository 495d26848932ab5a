"""In what configurations differ."""

from collections.abc import Mapping, Sequence
from typing import Any

from server.comparison.schemas import Difference

_NAMES = ("name", "label")
"""What the objects of a list, such as a reward's terms, are told apart by."""

_START = "start_from"
_SHORT_HASH = 8


def differences(configurations: Sequence[Mapping[str, Any]]) -> list[Difference]:
    """The settings that are not the same in all `configurations`, by dotted path; a setting that one lacks is null there."""
    things: list[set[str]] = [set() for _ in configurations]
    flat = [dict(_flatten(configuration, own)) for configuration, own in zip(configurations, things, strict=True)]
    # A dictionary keeps the order in which a person meets the settings in the form.
    paths = {path: None for settings in flat for path in settings}
    rows = []
    for path in paths:
        values = [settings.get(path) for settings in flat]
        if any(value != values[0] for value in values):
            rows.append(Difference(path=path, values=values, left_out=[_is_of_another(path, own, things) for own in things]))
    return rows


def _is_of_another(path: str, own: set[str], things: Sequence[set[str]]) -> bool:
    """Whether a setting is of a list's thing that another configuration has and this one has not."""
    return any(path.startswith(thing) for others in things for thing in others - own)


def _flatten(value: Mapping[str, Any], things: set[str], prefix: str = "") -> list[tuple[str, Any]]:
    """Pairs of path and value; puts the path of each of a list's named things, with a dot behind it, into `things`."""
    leaves: list[tuple[str, Any]] = []
    for key, child in value.items():
        path = f"{prefix}{key}"
        if path == _START and isinstance(child, Mapping):
            # One thing with a name, and a hash that tells it from others of that name.
            child = f"{child['title'] or child['name']} ({(child['sha256'] or '')[:_SHORT_HASH]})"
        if isinstance(child, list) and child and all(isinstance(item, Mapping) and "name" in item for item in child):
            child = {item.get("label", item["name"]): {k: v for k, v in item.items() if k not in _NAMES} for item in child}
            things |= {f"{path}.{name}." for name in child}
        leaves.extend(_flatten(child, things, f"{path}.") if isinstance(child, Mapping) else [(path, child)])
    return leaves

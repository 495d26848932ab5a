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
    flat = [dict(_flatten(configuration)) for configuration in configurations]
    # A dictionary keeps the order in which a person meets the settings in the form.
    paths = {path: None for settings in flat for path in settings}
    rows = [Difference(path=path, values=[settings.get(path) for settings in flat]) for path in paths]
    return [row for row in rows if any(value != row.values[0] for value in row.values)]


def _flatten(value: Mapping[str, Any], prefix: str = "") -> list[tuple[str, Any]]:
    leaves: list[tuple[str, Any]] = []
    for key, child in value.items():
        path = f"{prefix}{key}"
        if path == _START and isinstance(child, Mapping):
            # One thing with a name, and a hash that tells it from others of that name.
            child = f"{child['title'] or child['name']} ({(child['sha256'] or '')[:_SHORT_HASH]})"
        if isinstance(child, list) and child and all(isinstance(item, Mapping) and "name" in item for item in child):
            child = {item.get("label", item["name"]): {k: v for k, v in item.items() if k not in _NAMES} for item in child}
        leaves.extend(_flatten(child, f"{path}.") if isinstance(child, Mapping) else [(path, child)])
    return leaves

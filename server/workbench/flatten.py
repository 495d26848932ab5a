"""Settings as pairs of a dotted name and one value."""

import hashlib
import json
from collections.abc import Iterator, Mapping
from functools import cache
from typing import Any

from server.database.tables import START_KEY
from server.experiments.stored import read_training
from workers.config import TrainingConfig

Value = float | str

MAX_KEYS = 500
"""Of one experiment: what somebody's list of a thousand terms says beyond that is not filtered by."""
MAX_KEY = 160
MAX_TEXT = 200

REWARD = "task.reward"
"""The key under which a reward's name in short is found; its terms are below it."""

OBSERVATION = "task.observation"
"""Likewise of an observation."""

UNREADABLE = "unreadable"
"""The key of what another version stored and this one cannot read."""


@cache
def form_of_settings() -> str:
    """Names the settings that this version knows: where it changes, what was written down of them is due anew."""
    schema = json.dumps(TrainingConfig.model_json_schema(), sort_keys=True)
    return hashlib.sha256(schema.encode()).hexdigest()[:12]


def flat_settings(document: Mapping[str, Any]) -> dict[str, Value]:
    """Every setting of a stored document, as far as it can be read, under its dotted name.

    "algorithm.gamma" is 0.99, "algorithm.network.hidden_sizes" is "64, 64". A list of named things, the terms of a reward
    say, is told by their names: "task.reward.terms.arrival.weight". Numbers are numbers, everything else is text; what is
    null or empty is absent.
    """
    stored = read_training(document)
    task = stored.training.task
    pairs: dict[str, Value] = {REWARD: task.reward.in_short, OBSERVATION: task.observation.in_short}
    if stored.training.start_from is not None:
        # Before all that there may be too much of: archives are kept for it.
        pairs[START_KEY] = stored.training.start_from.name
    if stored.unreadable:
        pairs[UNREADABLE] = ", ".join(stored.unreadable)[:MAX_TEXT]
    pairs |= dict(_pairs("", stored.training.model_dump(mode="json")))
    short = {key: value for key, value in pairs.items() if len(key) <= MAX_KEY}
    return dict(list(short.items())[:MAX_KEYS])


def _pairs(prefix: str, value: Any) -> Iterator[tuple[str, Value]]:
    if isinstance(value, dict):
        for name, below in value.items():
            yield from _pairs(f"{prefix}.{name}" if prefix else name, below)
    elif isinstance(value, list):
        yield from _of_list(prefix, value)
    elif isinstance(value, bool):
        yield prefix, "yes" if value else "no"
    elif isinstance(value, int | float):
        yield prefix, float(value)
    elif value is not None and value != "":
        yield prefix, str(value)[:MAX_TEXT]


def _of_list(prefix: str, values: list[Any]) -> Iterator[tuple[str, Value]]:
    if any(isinstance(value, dict | list) for value in values):
        counts: dict[str, int] = {}
        for place, value in enumerate(values):
            name = str(value["name"]) if isinstance(value, dict) and "name" in value else str(place)
            counts[name] = counts.get(name, 0) + 1
            rest = {key: below for key, below in value.items() if key != "name"} if isinstance(value, dict) else value
            yield from _pairs(f"{prefix}.{name}" if counts[name] == 1 else f"{prefix}.{name}-{counts[name]}", rest)
    elif values:
        yield prefix, ", ".join(str(value) for value in values)[:MAX_TEXT]

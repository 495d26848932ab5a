"""What the tests of an extension look at its parts with, each as Mapless uses it: by its configuration."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import TypeAdapter

from sim.arenas import Arena, build_arenas
from sim.arrays import Floats
from sim.baselines.named import AnyBaseline, controller_of
from sim.config import AnyArenaConfig, ObservationConfig, RewardConfig, TaskConfig
from sim.engine.world import World
from sim.extending.control import Controller
from sim.extending.discovery import installed


def found() -> list[tuple[str, str]]:
    """Names and versions of the extensions that Mapless uses here.

    Raises:
        ValueError: one is refused; the message says why.
    """
    if refused := installed().refused:
        raise ValueError("; ".join(f"{one.name}: {one.reason}" for one in refused))
    return [(one.name, one.version) for one in installed().extensions]


def rewards_of(term: Mapping[str, Any], *, linear: float, angular: float) -> float:
    """What a term pays a robot in its third step at a steady command, in fractions of its limits, in the simple arena."""
    task = TaskConfig(reward=RewardConfig.model_validate({"terms": [dict(term)]}))
    world = World(task, build_arenas(task.arena), 1)
    world.reset(poses=np.zeros((1, 3)), targets=np.array([[4.0, 0.0]]))
    for _ in range(3):
        world.step(np.array([[linear, angular]], np.float32))
    return float(world.robots.terms[0, 0])


def seen_by(part: Mapping[str, Any], *, pose: tuple[float, float, float], target: tuple[float, float]) -> Floats:
    """The numbers of an observation part for a robot that begins in the simple arena."""
    task = TaskConfig(observation=ObservationConfig.model_validate({"parts": [dict(part)]}))
    world = World(task, build_arenas(task.arena), 1)
    world.reset(poses=np.array([pose]), targets=np.array([target]))
    numbers: Floats = world.robots.observations[0].copy()
    return numbers


def make_arenas(family: Mapping[str, Any], count: int) -> tuple[Arena, ...]:
    """The first arenas of a pool."""
    config: AnyArenaConfig = TypeAdapter(AnyArenaConfig).validate_python({**family, "maps": count})
    return build_arenas(config)


def make_controller(baseline: Mapping[str, Any], task: TaskConfig) -> Controller:
    """The controller of a baseline."""
    config: AnyBaseline = TypeAdapter(AnyBaseline).validate_python(dict(baseline))
    return controller_of(config, task)

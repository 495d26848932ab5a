"""Parts of an observation that extensions compute: what they see, and that nothing else differs where they do."""

import math
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import pytest
from pydantic import Field, ValidationError

from sim.arenas import build_arenas
from sim.config import (
    ActionsPart,
    AddedObservationPart,
    ArenaConfig,
    BearingPart,
    DistancePart,
    ObservationConfig,
    OdometryConfig,
    RandomisationConfig,
    RangesPart,
    SpeedsPart,
    TaskConfig,
)
from sim.engine.added_parts import AddedParts
from sim.engine.plain import PlainWorld
from sim.engine.world import Restart, World
from sim.errors import ObservationError
from sim.extending import Extension, ObservationNumber, ObservationPart
from sim.extending.discovery import complete, discover
from sim.extending.observing import Sight
from sim.kernels.records import NONE
from sim.observations import observation_layout, observation_size

BATCHES = 6


class TwinPart(ObservationPart):
    """Bearing, distance, ranges, speeds and last action as the compiled code has them."""

    name: Literal["lab.twin"] = Field("lab.twin", title="Twin")
    batches: int = Field(BATCHES, ge=1, le=30)
    implementation = "tests.sim.test_added_parts:twin"

    def numbers(self) -> list[ObservationNumber]:
        names = ["bearing", "distance", *(f"range {k}" for k in range(self.batches)), "v", "w", "v command", "w command"]
        return [ObservationNumber(name, "as the compiled one", -1.0, 1.0) for name in names]


def twin(part: TwinPart, task: TaskConfig) -> Callable[[Sight], np.ndarray]:
    def see(sight: Sight) -> np.ndarray:
        offset = sight.targets - sight.poses[:, :2]
        bearing = np.arctan2(offset[:, 1], offset[:, 0]) - sight.poses[:, 2]
        distance = np.hypot(*offset.T)
        nearest = sight.ranges.reshape(len(sight), part.batches, -1).min(axis=2) / task.lidar.range
        told = (np.arctan2(np.sin(bearing), np.cos(bearing)) / np.pi, distance / (distance + 1.0), nearest)
        return np.column_stack((*told, sight.speeds, sight.actions))

    return see


class TallPart(ObservationPart):
    """One number that is what a test says."""

    name: Literal["lab.tall"] = Field("lab.tall", title="Tall")
    value: float = 3.0
    implementation = "tests.sim.test_added_parts:tall"

    def numbers(self) -> list[ObservationNumber]:
        return [ObservationNumber("tall", "value", -1.0, 1.0)]


def tall(part: TallPart, task: TaskConfig) -> Callable[[Sight], np.ndarray]:
    shape = (1,) if part.value == 0.0 else (1, 1)
    return lambda sight: np.full((len(sight) * shape[0], *shape[1:]), part.value)


Twin: Any = complete(TwinPart, AddedObservationPart)
Tall: Any = complete(TallPart, AddedObservationPart)


def built_in(frames: int) -> tuple[Any, ...]:
    return (
        BearingPart(frames=frames),
        DistancePart(frames=frames),
        RangesPart(batches=BATCHES, inverse=False, frames=frames),
        SpeedsPart(frames=frames),
        ActionsPart(frames=frames),
    )


def task_with(*parts: Any, **others: Any) -> TaskConfig:
    return TaskConfig(**others).model_copy(update={"observation": ObservationConfig.model_construct(parts=parts)})


DISTURBED: dict[str, Any] = {
    "odometry": OdometryConfig(distance_noise=0.1, heading_noise=0.1),
    "command_delay": 2,
    "step_limit": 40,
    "arrival_distance": 1.0,
    "arena": ArenaConfig(name="complex"),
    "randomisation": RandomisationConfig(noise=(0.0, 0.05)),
}


def driven(task: TaskConfig, restart: Restart) -> Any:
    """A world of 30 robots, and the same actions for as many steps as bring every kind of end."""
    world = World(task, build_arenas(task.arena), 30, seed=5, restart=restart)
    world.reset()
    actions = np.random.default_rng(1).uniform([0.2, -1.0], 1.0, (90, 30, 2)).astype(np.float32)
    return world, actions


@pytest.mark.parametrize("restart", ["same step", "next step"])
@pytest.mark.parametrize(
    "disturbances", [{"step_limit": 40, "arrival_distance": 1.0}, DISTURBED], ids=["plain", "disturbed"]
)
def test_a_part_sees_what_the_compiled_ones_see_and_nothing_else_differs(
    restart: Restart, disturbances: dict[str, Any]
) -> None:
    """At every moment, in the last observation of an episode and in the first; the rest is as without it, bit for bit.

    Where the kernel of a step begins the next episode, it may round that one's first scan otherwise than the kernel of a
    reset does.
    """
    rounding = 1e-6 if restart == "same step" else 0.0
    parts = built_in(frames=3)
    alone, actions = driven(task_with(*parts, **disturbances), restart)
    beside, _ = driven(task_with(*parts, Twin(frames=3), **disturbances), restart)
    layout = observation_layout(beside.task)
    ours = np.concatenate([np.r_[place] for place in layout.places("lab.twin")])
    theirs = np.concatenate([np.r_[layout.places(part.name)[age]] for age in range(3) for part in parts])
    ends = arrivals = 0
    for step in actions:
        for world in (alone, beside):
            world.step(step)
        for name, array in alone.robots._asdict().items():
            if name in ("ranges", "held_ranges"):
                np.testing.assert_allclose(getattr(beside.robots, name), array, rtol=0.0, atol=rounding)
            elif name not in ("observations", "final_observations"):
                np.testing.assert_array_equal(getattr(beside.robots, name), array, name)
        ended = alone.robots.terminations | alone.robots.truncations
        for seen, expected in (
            (beside.robots.observations, alone.robots.observations),
            (beside.robots.final_observations[ended], alone.robots.final_observations[ended]),
        ):
            np.testing.assert_allclose(seen[:, theirs], expected, rtol=0.0, atol=rounding)
            assert_twins(seen, ours, theirs)
        ends += int(ended.sum())
        arrivals += int(((alone.robots.outcomes != NONE) & ~ended).sum())
    assert ends > 20
    assert arrivals > 0


def assert_twins(observations: np.ndarray, ours: np.ndarray, theirs: np.ndarray) -> None:
    difference = np.abs(observations[:, ours] - observations[:, theirs])
    # A bearing of half a turn may round to either side.
    np.testing.assert_allclose(np.minimum(difference, np.abs(2.0 - difference)), 0.0, atol=2e-6)


def test_where_nobody_begins_anew_a_reset_does() -> None:
    world, actions = driven(task_with(BearingPart(), Twin(), step_limit=10), "reset")
    for step in actions[:12]:
        world.step(step)
        np.testing.assert_allclose(world.robots.observations[:, 0], world.robots.observations[:, 1], atol=2e-6)
    world.reset()
    np.testing.assert_allclose(world.robots.observations[:, 0], world.robots.observations[:, 1], atol=2e-6)


def test_going_on_from_a_state_is_bit_for_bit() -> None:
    task = task_with(*built_in(2), Twin(frames=2), **DISTURBED)
    world, actions = driven(task, "same step")
    for step in actions[:20]:
        world.step(step)
    other, _ = driven(task, "same step")
    other.set_state(world.get_state())
    for step in actions[20:]:
        for one in (world, other):
            one.step(step)
        np.testing.assert_array_equal(other.robots.observations, world.robots.observations)


def test_the_plain_world_sees_the_same() -> None:
    task = task_with(BearingPart(), Twin(frames=2))
    world = World(task, build_arenas(task.arena), 1)
    world.reset(poses=(0.0, 0.0, 0.5), targets=(3.0, -2.0))
    plain = PlainWorld(task, world.arenas[0], (0.0, 0.0, 0.5), (3.0, -2.0))
    for _ in range(5):
        world.step(np.array([[0.7, -0.4]], np.float32))
        np.testing.assert_allclose(world.robots.observations[0], plain.step(0.7, -0.4).observation, atol=1e-4)


def test_numbers_are_cut_at_their_range_and_must_be_numbers() -> None:
    assert observation_size(task_with(Tall())) == 1
    world, actions = driven(task_with(Tall(value=3.0)), "same step")
    world.step(actions[0])
    np.testing.assert_array_equal(world.robots.observations, 1.0)
    for value, found in ((math.nan, r"returns \(30, 1\) of which 30 are not finite"), (0.0, r"returns \(30,\)")):
        with pytest.raises(ObservationError, match=rf"'lab.tall' should be \(30, 1\) finite numbers.*{found}"):
            driven(task_with(Tall.model_construct(name="lab.tall", value=value, frames=1)), "same step")


def test_a_task_without_such_parts_has_none() -> None:
    assert len(AddedParts(TaskConfig())) == 0


class SilentPart(ObservationPart):
    """Does not say what its numbers are."""

    name: Literal["lab.silent"] = "lab.silent"
    implementation = "lab:one"


class EmptyPart(SilentPart):
    """Has none."""

    def numbers(self) -> list[ObservationNumber]:
        return []


class NarrowPart(SilentPart):
    """Has one without a range."""

    def numbers(self) -> list[ObservationNumber]:
        return [ObservationNumber("one", "1", 1.0, 1.0)]


@pytest.mark.parametrize(
    ("part", "reason"),
    [
        (SilentPart, "SilentPart needs a method numbers(self)"),
        (EmptyPart, "lab.silent has no numbers"),
        (NarrowPart, "lab.silent: 'one' goes from 1 to 1, which is no range"),
    ],
)
def test_a_part_that_is_declared_wrongly_is_refused(part: type[ObservationPart], reason: str) -> None:
    extension = Extension(name="lab", version="1", api=1, parts=(part,))
    (refused,) = discover([("lab", lambda: extension)]).refused
    assert reason in refused.reason


def test_a_part_that_depends_on_its_fields_is_looked_at_with_them() -> None:
    class Ladder(ObservationPart):
        """As many numbers as rungs."""

        name: Literal["lab.ladder"] = "lab.ladder"
        rungs: int = 1
        implementation = "lab:one"

        def numbers(self) -> list[ObservationNumber]:
            return [ObservationNumber(f"rung {k}", "0", 0.0, 1.0) for k in range(self.rungs)]

    ladder: Any = complete(Ladder, AddedObservationPart)
    assert observation_size(task_with(ladder(rungs=5, frames=2))) == 10
    with pytest.raises(ValidationError, match="has no numbers"):
        ladder(rungs=0)

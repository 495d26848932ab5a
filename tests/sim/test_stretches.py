"""Several threads follow one step: the same bit for bit, whatever their number."""

import threading
from typing import Any

import numpy as np
import pytest

from sim.arenas.build import build_task_arenas
from sim.config import (
    DwellPart,
    GeneratedArenaConfig,
    LidarConfig,
    MoversConfig,
    ObservationConfig,
    OdometryConfig,
    OpeningsPart,
    PathProgressTerm,
    ReachPart,
    RewardConfig,
    TaskConfig,
    TrailPart,
)
from sim.engine.stretches import Crew
from sim.engine.world import World

ROBOTS = 150


def task() -> TaskConfig:
    """Robots that see all that takes long, among others that walk, in maps that are drawn anew."""
    return TaskConfig(
        arena=GeneratedArenaConfig(name="thicket", difficulty=0.5, maps=5, movers=MoversConfig(count=2)),
        lidar=LidarConfig(rays=60, field_of_view=360.0),
        observation=ObservationConfig(parts=(TrailPart(), ReachPart(), OpeningsPart(), DwellPart())),
        odometry=OdometryConfig(distance_noise=0.05),
        reward=RewardConfig(terms=(PathProgressTerm(),)),
        step_limit=60,
    )


def driven(threads: int) -> World:
    made = World(task(), build_task_arenas(task()), ROBOTS, seed=3, guides=True)
    made.crew = Crew(threads)
    made.reset()
    random = np.random.default_rng(0)
    for _ in range(200):
        made.step(random.uniform((0.0, -1.0), (1.0, 1.0), (ROBOTS, 2)).astype(np.float32))
    return made


def test_two_threads_end_at_the_same_bits() -> None:
    alone, beside = driven(1), driven(2)
    assert (alone.robots.records["steps"] <= 60).all()  # episodes have ended
    for name in alone.robots._fields:
        one, other = getattr(alone.robots, name), getattr(beside.robots, name)
        assert one.tobytes() == other.tobytes(), name
    assert alone.guidance is not None
    assert beside.guidance is not None
    assert alone.guidance.now.tobytes() == beside.guidance.now.tobytes()
    assert alone.guidance.final.tobytes() == beside.guidance.final.tobytes()


def test_each_robot_is_in_one_stretch_and_none_is_short() -> None:
    assert Crew(2).stretches(150) == [(0, 75), (75, 150)]
    assert Crew(3).stretches(200) == [(0, 66), (66, 133), (133, 200)]
    assert Crew(2).stretches(100) == [(0, 100)]
    assert Crew().stretches(1) == [(0, 1)]


def test_a_fault_of_one_thread_is_told_when_all_have_ended() -> None:
    ended = threading.Event()

    def work(part: int) -> int:
        if part == 0:
            raise MemoryError
        ended.set()
        return part

    with pytest.raises(MemoryError):
        Crew(2).share(work, 2)
    assert ended.is_set()


def test_the_first_part_is_this_threads() -> None:
    found: list[Any] = Crew(3).share(lambda part: (part, threading.get_ident()), 3)
    assert [part for part, _ in found] == [0, 1, 2]
    assert found[0][1] == threading.get_ident()
    assert threading.get_ident() not in {ident for _, ident in found[1:]}

"""Maps that teach more come more often: shares by hand, draws that follow them, attempts counted where they were made."""

from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from sim.arenas import build_arenas
from sim.config import GeneratedArenaConfig, RewardConfig, TaskConfig
from sim.engine.map_sampling import MapSampling
from sim.engine.world import World
from sim.kernels.records import ARRIVAL


def task(sampling: str = "learnability", maps: int = 5, **more: Any) -> TaskConfig:
    arena = GeneratedArenaConfig.model_validate({"name": "clutter", "maps": maps, "seed": 3, "map_sampling": sampling})
    return TaskConfig(arena=arena, **more)


def world_of(of: TaskConfig, robots: int, **more: Any) -> World:
    return World(of, build_arenas(of.arena), robots, seed=7, **more)


def shares(sampling: MapSampling) -> list[float]:
    return np.diff(sampling.chances, prepend=0.0).tolist()


def test_maps_that_nobody_has_tried_come_as_often() -> None:
    assert shares(MapSampling(4)) == pytest.approx([0.25] * 4)


def test_shares_by_hand() -> None:
    """One arrival in the first map: p = 1.5 / 2 there and 0.5 / 1 elsewhere."""
    sampling = MapSampling(3)
    sampling.learn([0], [True])
    first, other = 0.75 * 0.25, 0.25
    whole = first + 2 * other
    assert shares(sampling) == pytest.approx([0.5 / 3 + 0.5 * first / whole] + 2 * [0.5 / 3 + 0.5 * other / whole])


def test_what_was_long_ago_counts_less() -> None:
    """A failure, then an arrival: 0.9 of the one and all of the other, and half an arrival in one attempt more."""
    sampling = MapSampling(2)
    sampling.learn([1, 1], [False, True])
    p = (1.0 + 0.5) / (0.9 + 1.0 + 1.0)
    taught = p * (1.0 - p)
    assert shares(sampling)[1] == pytest.approx(0.25 + 0.5 * taught / (taught + 0.25))


def test_where_all_arrive_or_none_does_fewer_episodes_begin_but_some_do() -> None:
    sampling = MapSampling(100)
    sampling.learn(np.repeat(np.arange(99), 60).tolist(), [map_ % 2 == 0 for map_ in np.repeat(np.arange(99), 60)])
    found = shares(sampling)
    # Of the last ten attempts, of which 10 weigh, p is 0.5 / 11 from an end.
    p = 0.5 / 11.0
    taught = p * (1.0 - p)
    assert found[0] == pytest.approx(found[1], rel=1e-3)
    assert found[0] == pytest.approx(0.005 + 0.5 * taught / (99 * taught + 0.25), rel=0.02)
    assert found[99] > 3 * found[0]
    assert sum(found) == pytest.approx(1.0)


def test_episodes_begin_in_maps_as_their_shares_say() -> None:
    world = world_of(task(), 4_000)
    assert world.geometry.chances.tolist() == pytest.approx([0.2, 0.4, 0.6, 0.8, 1.0])
    sampling = world._sampling
    assert sampling is not None
    sampling.learn([0, 1] * 60, [True, False] * 60)
    wanted = np.array(shares(sampling))
    world.reset()
    found = np.bincount(world.robots.records["map"], minlength=5) / 4_000
    # Four standard deviations of a share of 4,000 draws.
    assert np.abs(found - wanted).max() < 4.0 * np.sqrt(0.25 / 4_000)
    assert wanted[0] < 0.16 < 0.22 < wanted[4]


@pytest.mark.parametrize("restart", ["same step", "next step"])
def test_attempts_count_in_the_map_that_they_were_made_in(restart: str) -> None:
    of = task(step_limit=40, reward=RewardConfig.preset("basic"))
    world = world_of(of, 64, restart=restart, arrival_ends=True)
    world.reset()
    beside = MapSampling(5)
    ends = 0
    # They turn left and right: some hit something, most run out of time, few arrive.
    actions = np.column_stack([np.ones(64), np.linspace(-0.5, 0.5, 64)]).astype(np.float32)
    for _ in range(300):
        maps = world.robots.records["map"].copy()
        world.step(actions)
        over = np.flatnonzero(world.robots.outcomes)
        beside.learn(maps[over].tolist(), (world.robots.outcomes[over] == ARRIVAL).tolist())
        ends += len(over)
    assert ends > 500
    np.testing.assert_array_equal(world.geometry.chances, beside.chances)


def test_goes_on_from_a_state_in_the_same_maps() -> None:
    of = task(step_limit=20)
    one, other = world_of(of, 32), world_of(of, 32)
    one.reset()
    other.reset()
    actions = np.full((32, 2), 1.0, np.float32)
    for _ in range(60):
        one.step(actions)
    other.set_state(one.get_state())
    for _ in range(60):
        one.step(actions)
        other.step(actions)
        np.testing.assert_array_equal(one.robots.records["map"], other.robots.records["map"])
    np.testing.assert_array_equal(one.geometry.chances, other.geometry.chances)


def test_nothing_of_it_where_maps_come_uniformly_or_robots_are_put() -> None:
    for world in (world_of(task("uniform"), 4), world_of(task(maps=1), 4), world_of(task(), 4, respawn=False)):
        assert not world.geometry.chances.size
        assert not {"map_attempts", "map_arrivals", "map_chances"} & world.get_state().keys()


def test_a_group_stays_in_its_map() -> None:
    with pytest.raises(ValidationError, match="together must be 1 where maps are sampled by learnability"):
        task(together=2)

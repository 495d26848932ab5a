"""Observations as lists of parts: reading old ones, what is refused, what every number is, and the plain twin's."""

from typing import Any, get_args

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from sim.arenas import Arena
from sim.baselines.simple import bearing_reader, go_to_goal
from sim.config import (
    ActionsPart,
    ArenaConfig,
    BearingPart,
    DeviationPart,
    DirectionPart,
    DistancePart,
    DwellPart,
    HeadingPart,
    KnownPart,
    LidarConfig,
    ObservationConfig,
    ObservationName,
    ObservationPart,
    OpeningsPart,
    RangesPart,
    ReachPart,
    SpeedsPart,
    TaskConfig,
    TrailPart,
    WayPart,
    preset_parts,
)
from sim.engine.plain import PlainWorld
from sim.engine.world import World
from sim.envs.vector import NavigationVectorEnv
from sim.errors import ArenaError, ObservationError
from sim.observations import observation_layout, observation_size
from tests.sim.scenes import arenas

COMPLEX = ArenaConfig(name="complex")


def seen(*parts: ObservationPart, **task: Any) -> TaskConfig:
    return TaskConfig(arena=COMPLEX, observation=ObservationConfig(parts=parts), **task)


def preset(name: ObservationName, *, batches: int = 10, frames: int = 1, **task: Any) -> TaskConfig:
    return TaskConfig(
        arena=COMPLEX, observation=ObservationConfig.preset(name, batches=batches, frames=frames), **task
    )  # fmt: skip


@pytest.mark.parametrize(
    ("stored", "parts"),
    [
        ({}, preset_parts("improved")),
        ({"observation": "paper"}, preset_parts("paper")),
        ({"observation": "improved", "frames": 3}, preset_parts("improved", frames=3)),
        (
            {"observation": "paper", "frames": 2, "lidar": {"rays": 60, "batches": 20, "range": 6.0}},
            preset_parts("paper", batches=20, frames=2),
        ),
        ({"lidar": {"batches": 30}}, preset_parts("improved", batches=30)),
    ],
)
def test_observations_stored_when_they_had_a_name_are_read_as_their_parts(stored: Any, parts: Any) -> None:
    task = TaskConfig.model_validate(stored)
    assert task.observation.parts == parts
    assert task.lidar.rays == stored.get("lidar", {}).get("rays", 30)
    assert TaskConfig.model_validate_json(task.model_dump_json()) == task


@pytest.mark.parametrize(
    ("stored", "place", "complaint"),
    [
        ({"observation": "better"}, ("observation",), "there is no observation 'better'"),
        ({"observation": {"parts": []}}, ("observation", "parts"), "at least 1 item"),
        ({"observation": {"parts": [{"name": "speeds"}] * 2}}, ("observation", "parts"), "more than one part speeds"),
        ({"observation": {"parts": [{"name": "smell"}]}}, ("observation", "parts", 0), "'smell'"),
        ({"lidar": {"rays": 37}}, ("observation",), "10 does not divide 37"),
        ({"frames": 9}, ("observation", "parts", 0, "ranges", "frames"), "less than or equal to 8"),
        ({"observation": {"parts": [{"name": "speeds"}]}, "frames": 2}, ("frames",), "Extra inputs"),
    ],
)
def test_what_cannot_be_seen_is_refused_in_its_place(stored: Any, place: tuple[Any, ...], complaint: str) -> None:
    with pytest.raises(ValidationError) as refused:
        TaskConfig.model_validate(stored)
    problem = refused.value.errors()[0]
    assert problem["loc"] == place
    assert complaint in problem["msg"]


def test_all_rays_of_a_full_scanner_at_all_moments_fit() -> None:
    ranges = RangesPart(batches=360, frames=8)
    assert seen(ranges, lidar=LidarConfig(rays=360)).observation.size(2, 1) == 2880


@pytest.mark.parametrize(
    ("parts", "in_short"),
    [
        (preset_parts("improved", batches=30, frames=3), "improved"),
        (preset_parts("paper"), "paper"),
        (preset_parts("paper")[:-1], "5 parts"),
        ((SpeedsPart(),), "1 part"),
    ],
)
def test_an_observation_in_short(parts: tuple[ObservationPart, ...], in_short: str) -> None:
    assert ObservationConfig(parts=parts).in_short == in_short


def test_every_number_has_a_name_of_its_own_and_says_when_it_was() -> None:
    single, stacked = preset("improved"), preset("improved", frames=3)
    numbers = observation_layout(stacked).numbers
    assert (observation_size(single), observation_size(stacked), len(numbers)) == (16, 48, 48)
    assert numbers[:16] == observation_layout(single).numbers
    assert len({number.name for number in numbers}) == 48
    assert (numbers[29].name, numbers[29].formula) == ("bearing, 1 before", "bearing 1 step before")
    assert numbers[45].formula == "bearing 2 steps before"
    assert (numbers[45].low, numbers[45].high, numbers[45].unit) == (-1.0, 1.0, "pi rad")


def test_a_layout_says_where_each_part_is() -> None:
    layout = observation_layout(
        seen(BearingPart(encoding="sine_cosine"), RangesPart(batches=6, frames=3), SpeedsPart(frames=2))
    )
    assert [(block.key, block.age, block.start, len(block.numbers)) for block in layout.blocks] == [
        ("bearing", 0, 0, 2), ("ranges", 0, 2, 6), ("speeds", 0, 8, 2),
        ("ranges", 1, 10, 6), ("speeds", 1, 16, 2),
        ("ranges", 2, 18, 6),
    ]  # fmt: skip
    assert layout.places("ranges") == (slice(2, 8), slice(10, 16), slice(18, 24))
    assert (layout.places("heading"), layout.size, len(layout.numbers)) == ((), 24, 24)


@pytest.mark.parametrize("name", get_args(ObservationName))
def test_a_stacked_observation_is_the_newest_and_those_of_the_steps_before(name: ObservationName) -> None:
    single, stacked = (NavigationVectorEnv(preset(name, frames=k, step_limit=40), 50, seed=2) for k in (1, 3))
    kept = [single.reset()[0]] * 3
    assert np.array_equal(stacked.reset()[0], np.concatenate(kept, axis=1))
    ended = 0
    for action in np.random.default_rng(0).uniform([0.0, -1.0], 1.0, (150, 50, 2)).astype(np.float32):
        newest, *_ = single.step(action)
        stack, _, terminated, truncated, _ = stacked.step(action)
        over = terminated | truncated
        last = np.concatenate([single.final_observations, kept[0], kept[1]], axis=1)
        assert np.array_equal(stacked.final_observations[over], last[over])
        # A new episode begins with its first frame repeated.
        kept = [newest, *(np.where(over[:, None], newest, before) for before in kept[:2])]
        assert np.array_equal(stack, np.concatenate(kept, axis=1))
        assert stacked.observation_space.contains(stack)
        ended += over.sum()
    assert ended > 50


def test_a_state_holds_the_frames_and_the_last_action() -> None:
    task = seen(RangesPart(frames=4), ActionsPart(frames=2), BearingPart(), command_delay=2)
    envs, other = (NavigationVectorEnv(task, 10, seed=seed) for seed in (1, 2))
    envs.reset()
    other.reset()
    actions = np.random.default_rng(0).uniform([0.0, -1.0], 1.0, (60, 10, 2)).astype(np.float32)
    for action in actions[:30]:
        envs.step(action)
    other.set_state(envs.get_state())
    for action in actions[30:]:
        assert np.array_equal(envs.step(action)[0], other.step(action)[0])


def test_a_part_left_out_leaves_the_others_as_they_are() -> None:
    whole, less = preset("improved"), preset("improved").observation.without("speeds", "deviation")
    left = [place for block in observation_layout(whole).blocks if block.key not in ("speeds", "deviation")
            for place in range(block.place.start, block.place.stop)]  # fmt: skip
    task = whole.model_copy(update={"observation": less})
    envs, others = NavigationVectorEnv(whole, 20, seed=4), NavigationVectorEnv(task, 20, seed=4)
    assert np.array_equal(envs.reset()[0][:, left], others.reset()[0])
    for action in np.random.default_rng(0).uniform([0.0, -1.0], 1.0, (60, 20, 2)).astype(np.float32):
        assert np.array_equal(envs.step(action)[0][:, left], others.step(action)[0])


def test_the_last_action_is_told_when_it_is_given_and_the_speed_when_it_is_driven() -> None:
    envs = NavigationVectorEnv(seen(ActionsPart(), SpeedsPart(), command_delay=2), 1, seed=0)
    assert envs.reset()[0].tolist() == [[0.0] * 4]
    told = [envs.step(np.array([[linear, -linear]], np.float32))[0][0] for linear in (0.25, 0.5, 0.75)]
    assert np.array(told).tolist() == [
        [0.25, -0.25, 0.0, 0.0], [0.5, -0.5, 0.0, 0.0], [0.75, -0.75, 0.25, -0.25]
    ]  # fmt: skip


frames = st.integers(1, 3)
parts = st.tuples(
    st.builds(RangesPart, batches=st.sampled_from([1, 5, 30]), inverse=st.booleans(), frames=frames),
    st.builds(SpeedsPart, frames=frames),
    st.builds(ActionsPart, frames=frames),
    st.builds(DistancePart, scaling=st.sampled_from(["saturating", "diagonal"]), frames=frames),
    st.builds(DirectionPart, frames=frames),
    st.builds(BearingPart, encoding=st.sampled_from(["angle", "sine_cosine"]), frames=frames),
    st.builds(HeadingPart, scaling=st.sampled_from(["signed", "turn"]), frames=frames),
    st.builds(DeviationPart, frames=frames),
    st.builds(TrailPart, sectors=st.sampled_from([4, 30]), frames=frames),
    st.builds(KnownPart, sectors=st.sampled_from([4, 30]), frames=frames),
    st.builds(OpeningsPart, count=st.integers(1, 3), frames=frames),
    st.builds(DwellPart, frames=frames),
    st.builds(WayPart, frames=frames),
    st.builds(ReachPart, sectors=st.sampled_from([4, 30]), frames=frames),
)


@settings(max_examples=40, deadline=None)
@given(arenas, st.integers(0, 2**32 - 1), parts.flatmap(st.permutations), st.integers(1, 8))
def test_any_list_of_parts_is_what_the_plain_twin_sees(arena: Arena, seed: int, listed: Any, count: int) -> None:
    rng = np.random.default_rng(seed)
    task = TaskConfig(observation=ObservationConfig(parts=tuple(listed[:count])), step_limit=60)
    try:
        world = World(task, (arena,), 1, seed=seed)
    except ArenaError:
        assume(False)
    world.reset()
    pose, target = world.robots.poses[0].astype(float), world.robots.targets[0].astype(float)
    plain = PlainWorld(task, arena, (pose[0], pose[1], pose[2]), (target[0], target[1]))
    layout = observation_layout(task)
    low, high = (np.array([getattr(number, end) for number in layout.numbers]) for end in ("low", "high"))
    keys = np.array([block.key for block in layout.blocks for _ in block.numbers])
    by_rays, exact = np.isin(keys, ("ranges", "trail", "known")), ~np.isin(keys, ("ranges", "trail", "known", "openings"))
    # Angles may round to either side of a half turn.
    period = np.array([1.0 if number.unit == "2 pi rad" else 2.0 for number in layout.numbers])
    for linear, angular in rng.uniform([0.3, -1.0], 1.0, (12, 2)).astype(np.float32).tolist():
        expected = plain.step(linear, angular)
        world.step(np.array([[linear, angular]], dtype=np.float32))
        if world.robots.outcomes[0] or expected.outcome != "none":
            return
        ours = world.robots.observations[0]
        assert ((ours >= low) & (ours <= high)).all()
        difference = np.abs(ours - expected.observation)
        # A ray that grazes an edge falls on either side of it, and with it the three numbers of a crumb beside the edge, or
        # the choice of an opening, which tests/sim/test_openings.py compares by the same rays.
        assert np.count_nonzero(difference[by_rays] > 1e-3) <= 3
        assert (np.minimum(difference, np.abs(period - difference))[exact] < 1e-4).all()


def test_a_baseline_drives_by_any_observation_that_tells_where_the_target_is() -> None:
    for listed in (
        (BearingPart(encoding="sine_cosine"), RangesPart()),
        (SpeedsPart(), DirectionPart(frames=2), HeadingPart()),
        (HeadingPart(scaling="turn"), DirectionPart()),
    ):
        task = seen(*listed)
        envs = NavigationVectorEnv(task, 300, seed=0)
        observations, _ = envs.reset()
        dx, dy = (envs.targets - envs.poses[:, :2]).T
        assert np.cos(bearing_reader(task)(observations) - np.arctan2(dy, dx) + envs.poses[:, 2]).min() > 1.0 - 1e-6
    with pytest.raises(ObservationError, match="takes the observation's part 'bearing'"):
        go_to_goal(seen(RangesPart(), DeviationPart()))

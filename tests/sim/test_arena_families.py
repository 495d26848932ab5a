"""Generated arenas: always passable, always the same, and never those of a suite."""

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from sim.arenas import Arena, build_arenas, build_task_arenas, free_distance, with_maps_of
from sim.arenas.cells import Grid, components, free_mask
from sim.arenas.families import CLEARANCE, FAMILIES, SUITE_SEEDS, generate_arena, pool_seeds
from sim.arenas.planner import Planner
from sim.arenas.scenes import SCENES, generate_scene
from sim.config import MAX_MAPS, FamilyName, GeneratedArenaConfig, JackalConfig, TaskConfig
from sim.errors import ArenaError
from sim.suites import suite_for

families = st.sampled_from(sorted(FAMILIES))
difficulties = st.floats(0.0, 1.0)
seeds = st.integers(0, 2**63 - 1)


def same(one: Arena, other: Arena) -> bool:
    return np.array_equal(one.circles, other.circles) and np.array_equal(one.boxes, other.boxes)


@settings(max_examples=150, deadline=None)
@given(families, difficulties, seeds)
def test_every_arena_hangs_together_and_reaches_from_wall_to_wall(family: FamilyName, difficulty: float, seed: int) -> None:
    arena = generate_arena(family, difficulty, seed)
    labels, sizes = components(free_mask(arena, CLEARANCE))
    assert sizes[0] >= 0.98 * sizes.sum()
    assert sizes[0] * 0.05**2 > 8.0  # square metres, of 100
    rows, columns = np.nonzero(labels == 0)
    assert np.ptp(rows) * 0.05 > 7.0
    assert np.ptp(columns) * 0.05 > 7.0


@settings(max_examples=40, deadline=None)
@given(families, difficulties, seeds)
def test_there_is_a_path_between_any_two_places(family: FamilyName, difficulty: float, seed: int) -> None:
    arena = generate_arena(family, difficulty, seed)
    labels, _ = components(free_mask(arena, CLEARANCE))
    grid, random = Grid.over(arena), np.random.default_rng(seed)
    rows, columns = np.nonzero(labels == 0)
    start, target = ((grid.xs()[columns[i]], grid.ys()[rows[i]]) for i in random.integers(len(rows), size=2))
    path = Planner(arena, CLEARANCE).shortest_path(start, target)
    assert path.length >= np.hypot(target[0] - start[0], target[1] - start[1]) - 1e-9
    assert free_distance(arena, path.points).min() >= CLEARANCE - 1e-6


@settings(max_examples=60, deadline=None)
@given(families, difficulties, seeds)
def test_obstacles_stay_inside_the_walls(family: FamilyName, difficulty: float, seed: int) -> None:
    arena = generate_arena(family, difficulty, seed)
    assert (
        0 < len(arena.circles) + len(arena.boxes) < (900 if family in ("thicket", "mixed", "varied", "intricate") else 120)
    )
    x, y, radius = arena.circles.T
    assert (np.maximum(np.abs(x), np.abs(y)) + radius <= 5.0 + 1e-9).all()
    x, y, half_length, half_width, angle = arena.boxes.T
    cos, sin = np.abs(np.cos(angle)), np.abs(np.sin(angle))
    assert (np.abs(x) + cos * half_length + sin * half_width <= 5.0 + 1e-9).all()
    assert (np.abs(y) + sin * half_length + cos * half_width <= 5.0 + 1e-9).all()


@settings(max_examples=30, deadline=None)
@given(families, difficulties, st.floats(5.0, 20.0), st.floats(0.1, 0.45), seeds)
@example("corridors", 0.0, 5.0, 0.45, 0)  # one street is all that fits
def test_other_sizes_and_robots_are_served_as_well(
    family: FamilyName, difficulty: float, size: float, clearance: float, seed: int
) -> None:
    arena = generate_arena(family, difficulty, seed, size=size, clearance=clearance)
    _, sizes = components(free_mask(arena, clearance))
    assert sizes[0] >= 0.98 * sizes.sum()
    assert arena.half_width == arena.half_height == size / 2


@given(families, difficulties, seeds)
@settings(max_examples=20, deadline=None)
def test_the_same_three_give_the_same_arena(family: FamilyName, difficulty: float, seed: int) -> None:
    assert same(generate_arena(family, difficulty, seed), generate_arena(family, difficulty, seed))


@pytest.mark.parametrize("family", sorted(FAMILIES))
def test_another_seed_is_another_arena_and_difficulty_fills_it(family: FamilyName) -> None:
    easy, other, hard = (generate_arena(family, difficulty, seed) for difficulty, seed in ((0.1, 1), (0.1, 2), (0.9, 1)))
    assert not same(easy, other)
    narrow = np.mean([free_mask(generate_arena(family, 1.0, seed), 0.6).mean() for seed in range(5)])
    wide = np.mean([free_mask(generate_arena(family, 0.0, seed), 0.6).mean() for seed in range(5)])
    assert narrow < wide
    assert not same(easy, hard)


def test_no_training_ever_meets_a_map_of_a_suite_and_pools_of_different_seeds_are_disjoint() -> None:
    last = pool_seeds(2**31 - 1, MAX_MAPS)
    assert last[-1] < SUITE_SEEDS[0]
    assert SUITE_SEEDS[-1] < 2**63
    assert pool_seeds(4, MAX_MAPS)[-1] < pool_seeds(5, 1)[0]


def test_a_pool_has_as_many_maps_as_asked_for() -> None:
    pool = build_arenas(GeneratedArenaConfig(name="rooms", maps=3, seed=5))
    assert len(pool) == 3
    assert not same(pool[0], pool[1])
    assert same(pool[1], generate_arena("rooms", 0.5, pool_seeds(5, 3)[1]))


def test_a_mixed_pool_has_thickets_of_thin_pillars_and_clutter() -> None:
    thin = [bool((arena.circles[:, 2] == 0.1).all()) for arena in build_arenas(GeneratedArenaConfig(name="mixed", maps=20))]
    assert 0 < sum(thin) < 20


@pytest.mark.parametrize(("family", "fewest", "most"), [("varied", 2, 24), ("intricate", 13, 40)])
def test_a_varied_pool_has_thickets_clutter_and_floors_of_walls(family: FamilyName, fewest: int, most: int) -> None:
    pool = build_arenas(GeneratedArenaConfig(name=family, maps=100))
    thickets = [arena for arena in pool if len(arena.circles) and (arena.circles[:, 2] == 0.1).all()]
    walls = [arena for arena in pool if not len(arena.circles)]
    assert fewest <= len(thickets) <= most  # 12 or 26 of 100, and three standard deviations to either side
    assert len(walls) >= 50
    assert len(thickets) + len(walls) < 100


def test_a_fixed_arena_has_no_difficulty_and_stays_as_it_was_written() -> None:
    assert TaskConfig.model_validate({"arena": {"name": "simple"}}) == TaskConfig()
    with pytest.raises(ValueError, match="difficulty"):
        TaskConfig.model_validate({"arena": {"name": "simple", "difficulty": 0.5}})
    task = TaskConfig.model_validate({"arena": {"name": "maze", "difficulty": 0.7}})
    assert TaskConfig.model_validate_json(task.model_dump_json()) == task


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ({"difficulty": 1.1}, "difficulty"),
        ({"difficulty": float("nan")}, "difficulty"),
        ({"seed": -1}, "seed"),
        ({"size": 3.0}, "wide"),
        ({"clearance": 2.0}, "clearances"),
        ({"family": "swamp"}, "choose one of clutter"),
    ],
)
def test_arguments_out_of_range_are_refused(arguments: dict[str, object], reason: str) -> None:
    with pytest.raises(ArenaError, match=reason):
        generate_arena(**({"family": "clutter", "difficulty": 0.5, "seed": 1} | arguments))  # type: ignore[arg-type]


def test_each_training_seed_draws_maps_of_its_own_unless_one_pool_is_for_all() -> None:
    task = TaskConfig(arena=GeneratedArenaConfig(name="rooms", maps=4))
    pools = [with_maps_of(task, seed).arena for seed in range(20)]
    seeds = {pool.seed for pool in pools if isinstance(pool, GeneratedArenaConfig)}
    assert len(seeds) == 20
    assert all(0 <= seed < 2**31 for seed in seeds)
    assert with_maps_of(task, 3) == with_maps_of(task, 3)
    assert with_maps_of(with_maps_of(task, 3), 4) == with_maps_of(task, 3)  # told once, it stays
    other = TaskConfig(arena=GeneratedArenaConfig(name="rooms", maps=4, seed=1, own_maps=True))
    assert with_maps_of(other, 3) != with_maps_of(task, 3)
    one = TaskConfig(arena=GeneratedArenaConfig(name="rooms", maps=4, own_maps=False))
    assert with_maps_of(one, 3) == one
    assert with_maps_of(TaskConfig(), 3) == TaskConfig()
    # The suite on which they are measured is the same for all of them.
    assert suite_for(with_maps_of(task, 3)).hash == suite_for(task).hash


def test_a_configuration_of_before_seeds_had_maps_of_their_own_means_one_pool() -> None:
    stored = {"name": "clutter", "difficulty": 0.9, "maps": 1024, "seed": 0}
    assert not GeneratedArenaConfig.model_validate(stored).own_maps
    assert GeneratedArenaConfig.model_validate({"name": "clutter"}).own_maps
    again = GeneratedArenaConfig(own_maps=True, seed=7)
    assert GeneratedArenaConfig.model_validate_json(again.model_dump_json()) == again


def test_scenes_to_train_in_are_all_ten_and_their_people_see_nobody() -> None:
    pool = build_arenas(GeneratedArenaConfig(name="people", difficulty=1.0, maps=20))
    assert [arena.name.rsplit("-", 1)[0] for arena in pool] == [*SCENES, *SCENES]
    assert not any(mover.sees_robots for arena in pool for mover in arena.movers)
    assert not same(pool[0], pool[10])
    whole = generate_scene("queue", 7, sees=False).arena
    assert generate_arena("people", 1.0, 7).movers == whole.movers
    assert generate_arena("people", 0.5, 7).movers == whole.movers[: round(0.5 * len(whole.movers))]
    assert len(generate_arena("people", 0.0, 7).movers) == 1


def test_fields_to_train_in_have_the_benchmarks_size_whatever_the_robot() -> None:
    wide = TaskConfig(arena=GeneratedArenaConfig(name="barn", maps=2), robot=JackalConfig())
    for arena, usual in zip(build_task_arenas(wide), build_arenas(wide.arena), strict=True):
        assert (arena.half_width, arena.half_height) == (2.25, 7.0)
        assert same(arena, usual)


def test_a_long_body_may_be_asked_to_take_gaps_that_it_cannot_turn_in() -> None:
    jackal = TaskConfig(robot=JackalConfig())
    assert jackal.passable_clearance == pytest.approx(0.333, abs=1e-3)
    lengthwise = TaskConfig(arena=GeneratedArenaConfig(name="barn"), robot=JackalConfig(), way_clearance=0.25)
    assert lengthwise.passable_clearance == 0.25
    assert suite_for(lengthwise).name == "barn-0.5-0.25m-200"

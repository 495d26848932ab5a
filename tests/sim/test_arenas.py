"""Geometry: distances worked by hand, the built-in arenas, free space."""

import itertools

import numpy as np
import pytest

from sim.arenas import Arena, build_arenas, free_distance
from sim.arenas.freespace import free_space, largest_region
from sim.config import ArenaConfig
from sim.errors import ArenaError
from sim.kernels.records import CELL


def test_free_distance_worked_by_hand() -> None:
    arena = Arena("hand", circles=np.array([[2.0, 0.0, 0.5]]), boxes=np.array([[0.0, 2.0, 1.0, 0.25, np.pi / 2]]))
    points = [[0.0, 0.0], [2.0, 0.0], [4.5, -4.0], [0.55, 0.6], [0.0, 2.0], [6.0, 0.0]]
    # 1 m to the box's end (which stands upright), inside the circle, 0.5 m to the wall, (0.3, 0.4) from the box's corner,
    # inside the box, outside the walls
    assert free_distance(arena, points) == pytest.approx([1.0, -0.5, 0.5, 0.5, -0.25, -1.0])


def test_simple_is_empty_and_complex_has_17_obstacles() -> None:
    (simple,) = build_arenas(ArenaConfig(name="simple"))
    (hard,) = build_arenas(ArenaConfig(name="complex"))
    assert len(simple.circles) + len(simple.boxes) == 0
    assert len(hard.circles) + len(hard.boxes) == 17
    assert (hard.half_width, hard.half_height) == (5.0, 5.0)


def test_every_passage_of_complex_is_at_least_80_centimetres_wide() -> None:
    (arena,) = build_arenas(ArenaConfig(name="complex"))
    single = [Arena("one", 50.0, 50.0, circles=circle[None]) for circle in arena.circles]
    single += [Arena("one", 50.0, 50.0, boxes=box[None]) for box in arena.boxes]
    grid = np.stack(np.meshgrid(*[np.linspace(-5.0, 5.0, 401)] * 2), axis=-1)
    distances = [free_distance(one, grid) for one in single]
    # The narrowest place between two convex shapes is where the sum of both distances is smallest.
    gaps = [(a + b).min() for a, b in itertools.combinations(distances, 2)]
    assert min(gaps) >= 0.8 - 1e-9
    wall = 5.0 - np.abs(grid).max(axis=-1)
    assert min((distance + wall).min() for distance in distances) >= 0.8 - 1e-9


def test_free_space_is_one_connected_region() -> None:
    # A wall with a gap of 0.5 m: too narrow for 0.3 m of clearance, so only the larger side is used.
    arena = Arena("split", boxes=np.array([[1.0, 0.25 + 2.375, 0.1, 2.375, 0.0], [1.0, -0.25 - 2.375, 0.1, 2.375, 0.0]]))
    space = free_space(arena, passable=0.3, clearance=0.4)
    assert space.starts[:, 0].max() + CELL < 0.9
    open_gap = free_space(arena, passable=0.2, clearance=0.4)
    assert open_gap.starts[:, 0].max() > 4.0


def test_insets_keep_starts_and_targets_from_the_walls() -> None:
    space = free_space(Arena("inset", start_inset=0.5, target_inset=1.4), passable=0.2, clearance=0.4)
    assert np.abs(space.starts + CELL / 2).max() == pytest.approx(4.45)
    assert np.abs(space.targets + CELL / 2).max() == pytest.approx(3.55)


def test_the_largest_region_of_a_mask() -> None:
    mask = np.array([[1, 0, 1, 1], [1, 0, 0, 1], [0, 1, 0, 1]], dtype=bool)
    assert largest_region(mask).astype(int).tolist() == [[0, 0, 1, 1], [0, 0, 0, 1], [0, 0, 0, 1]]
    assert not largest_region(np.zeros((2, 2), dtype=bool)).any()


@pytest.mark.parametrize(
    "arguments",
    [
        {"half_width": 0.0},
        {"half_height": np.inf},
        {"circles": np.array([[0.0, 0.0]])},
        {"circles": np.array([[0.0, np.nan, 1.0]])},
        {"boxes": np.array([[0.0, 0.0, 1.0, -1.0, 0.0]])},
    ],
)
def test_shapes_that_are_none_are_refused(arguments: dict[str, object]) -> None:
    with pytest.raises(ArenaError):
        Arena("bad", **arguments)  # type: ignore[arg-type]


def test_an_arena_without_room_says_so() -> None:
    with pytest.raises(ArenaError, match="smaller robot"):
        free_space(Arena("closet", 0.3, 0.3), passable=0.2, clearance=0.4)
    with pytest.raises(ArenaError, match="too large"):
        free_space(Arena("desert", 5000.0, 5000.0), passable=0.2, clearance=0.4)

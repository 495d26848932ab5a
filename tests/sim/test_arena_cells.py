"""Free cells, their components, and rectangles that cover cells."""

from collections import deque

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import array_shapes, arrays

from sim.arenas import Arena, free_distance
from sim.arenas.cells import Grid, components, covered_cells, free_mask, obstacle_distance
from sim.arenas.geometry import box_distance, circle_distance
from sim.arenas.rectangles import cover, to_boxes

coordinates = st.floats(-4.0, 4.0)
sizes = st.floats(0.01, 1.5)
circles = st.lists(st.tuples(coordinates, coordinates, sizes), max_size=8)
boxes = st.lists(st.tuples(coordinates, coordinates, sizes, sizes, st.floats(-4.0, 4.0)), max_size=8)
masks = arrays(np.bool_, array_shapes(min_dims=2, max_dims=2, min_side=1, max_side=12))


def flood_sizes(free: np.ndarray) -> list[int]:
    """Sizes of the 8-connected components, largest first, by plain flood fill."""
    waiting = {(int(r), int(c)) for r, c in np.argwhere(free)}
    sizes = []
    while waiting:
        queue, size = deque([waiting.pop()]), 0
        while queue:
            row, column = queue.popleft()
            size += 1
            for near in [(row + i, column + j) for i in (-1, 0, 1) for j in (-1, 0, 1)]:
                if near in waiting:
                    waiting.remove(near)
                    queue.append(near)
        sizes.append(size)
    return sorted(sizes, reverse=True)


@given(masks)
def test_components_are_those_of_a_flood_fill(free: np.ndarray) -> None:
    labels, sizes = components(free)
    assert sizes.tolist() == flood_sizes(free)
    assert ((labels >= 0) == free).all()
    for label, size in enumerate(sizes):
        part = labels == label
        assert part.sum() == size
        assert flood_sizes(part) == [size]


def test_cells_that_meet_at_a_corner_hang_together_or_not() -> None:
    free = np.array([[1, 0, 0], [0, 1, 1]], dtype=bool)
    assert components(free)[1].tolist() == [3]
    assert components(free, corners=False)[1].tolist() == [2, 1]
    assert components(free.T[::-1], corners=False)[1].tolist() == [2, 1]


def test_the_largest_component_comes_first() -> None:
    free = np.array([[1, 0, 1, 1], [0, 0, 1, 1]], dtype=bool)
    labels, sizes = components(free)
    assert labels.tolist() == [[1, -1, 0, 0], [-1, -1, 0, 0]]
    assert sizes.tolist() == [4, 1]


@given(masks, st.integers(1, 5))
def test_rectangles_cover_what_is_required_and_nothing_that_is_forbidden(allowed: np.ndarray, drop: int) -> None:
    required = allowed.copy()
    required.ravel()[::drop] = False
    covered = np.zeros_like(allowed)
    for low_row, low_column, high_row, high_column in cover(required, allowed, 1000):
        covered[low_row:high_row, low_column:high_column] = True
    assert (covered | ~required).all()
    assert (~covered | allowed).all()


def test_a_solid_block_is_one_rectangle_and_an_l_two() -> None:
    block = np.ones((3, 5), dtype=bool)
    assert cover(block, block, 10).tolist() == [[0, 0, 3, 5]]
    ell = np.array([[1, 1, 1], [1, 0, 0], [1, 0, 0]], dtype=bool)
    assert len(cover(ell, ell, 10)) == 2


def test_covering_stops_one_beyond_its_limit() -> None:
    checkerboard = np.indices((20, 20)).sum(axis=0) % 2 == 0
    assert len(cover(checkerboard, checkerboard, 7)) == 8


def test_rectangles_become_boxes_in_metres() -> None:
    boxes = to_boxes(np.array([[0, 1, 2, 5]]), -1.0, -2.0, 0.5)
    assert boxes.tolist() == [[0.5, -1.5, 1.0, 0.5, 0.0]]


@settings(max_examples=40)
@given(st.integers(0, 2**32), st.sampled_from([0.05, 0.2, 0.35]))
def test_every_point_of_a_free_cell_keeps_the_clearance(seed: int, clearance: float) -> None:
    random = np.random.default_rng(seed)
    arena = Arena(
        "random",
        half_width=2.0,
        half_height=1.5,
        circles=np.column_stack([random.uniform(-2, 2, (4, 2)), random.uniform(0.05, 0.4, 4)]),
        boxes=np.column_stack([random.uniform(-2, 2, (4, 2)), random.uniform(0.05, 0.6, (4, 2)), random.uniform(-4, 4, 4)]),
    )
    grid, free = Grid.over(arena), free_mask(arena, clearance)
    rows, columns = np.nonzero(free)
    offsets = random.uniform(-0.5, 0.5, (len(rows), 2)) * grid.cell
    points = np.stack([grid.xs()[columns], grid.ys()[rows]], axis=1) + offsets
    assert (free_distance(arena, points) >= clearance - 1e-6).all()


def test_no_cell_with_room_to_spare_is_lost() -> None:
    arena = Arena("pillar", circles=np.array([[0.3, -0.2, 0.5]]))
    grid, free = Grid.over(arena), free_mask(arena, 0.2)
    centres = np.stack(np.meshgrid(grid.xs(), grid.ys()), axis=-1)
    assert free[free_distance(arena, centres) >= 0.2 + grid.cell].all()


@settings(max_examples=200)
@given(circles, boxes, st.floats(0.05, 1.0))
def test_distances_of_cells_are_those_of_their_centres_bit_for_bit(
    circles: list[tuple[float, ...]], boxes: list[tuple[float, ...]], cap: float
) -> None:
    """What `free_distance` would say of each, as far as obstacles go: maps are drawn by it, and must stay what they are."""
    arena = Arena("drawn", 2.5, 2.0, np.array(circles).reshape(-1, 3), np.array(boxes).reshape(-1, 5))
    grid = Grid.over(arena)
    xs, ys = grid.xs()[None, :], grid.ys()[:, None]
    nearest = np.full((grid.rows, grid.columns), cap)
    for circle in arena.circles:
        nearest = np.minimum(nearest, circle_distance(circle, xs, ys))
    for box in arena.boxes:
        nearest = np.minimum(nearest, box_distance(box, xs, ys))
    assert (obstacle_distance(arena, grid, cap) == nearest).all()


@settings(max_examples=200)
@given(circles, st.floats(0.05, 0.6))
def test_a_free_mask_is_what_its_circles_leave(circles: list[tuple[float, ...]], clearance: float) -> None:
    """Thickets take some away, and look again without measuring the others anew."""
    pillars = np.array(circles).reshape(-1, 3)
    empty = Arena("empty", 2.5, 2.0)
    which, cells = covered_cells(pillars, Grid.over(empty), clearance)
    for stays in (np.ones(len(pillars), np.bool_), np.arange(len(pillars)) % 2 == 0):
        free = free_mask(empty, clearance)
        free.reshape(-1)[cells[stays[which]]] = False
        assert (free == free_mask(Arena("some", 2.5, 2.0, pillars[stays]), clearance)).all()


def test_an_obstacle_larger_than_any_whole_number_of_cells_fills_all() -> None:
    arena = Arena("full", 1.0, 1.0, np.array([[0.0, 0.0, 1e300]]), np.array([[0.0, 0.0, 1e300, 1e300, 0.5]]))
    assert not free_mask(arena, 0.1).any()

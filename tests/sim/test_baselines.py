"""The planners that policies are held against: their parts by hand, and what each can that others cannot."""

import dataclasses

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from sim.arenas import Arena
from sim.baselines.dwa import dynamic_window
from sim.baselines.kernels.mapping import OCCUPIED, distances, plan, trace
from sim.baselines.kernels.rollout import gap_at
from sim.baselines.memory import mapping_planner
from sim.baselines.mppi import path_integral
from sim.baselines.orca import reciprocal_avoidance
from sim.baselines.scans import Scans
from sim.baselines.vfh import vector_field_histogram
from sim.config import (
    JackalConfig,
    LidarConfig,
    ObservationConfig,
    OmnidirectionalDrive,
    RoundConfig,
    SingleMount,
    TaskConfig,
)
from sim.engine.footprint import rectangle_clearance
from sim.errors import BaselineError
from sim.suites import Situation, Suite, SuiteRules, load_suite, run_controller

AROUND = TaskConfig(
    lidar=LidarConfig(rays=60, field_of_view=360.0), observation=ObservationConfig.preset("improved", batches=30)
)
PLANNERS = {"VFH+": vector_field_histogram, "MPPI": path_integral, "mapping": mapping_planner, "ORCA": reciprocal_avoidance}


def facing(ranges: np.ndarray, target: tuple[float, float], discs: np.ndarray | None = None) -> Situation:
    """One robot at the origin, at rest, with a scan."""
    return Situation(
        observations=np.zeros((1, 16), dtype=np.float32),
        ranges=ranges[None].astype(np.float32),
        poses=np.zeros((1, 3), dtype=np.float32),
        targets=np.array([target], dtype=np.float32),
        robots=np.zeros(1, dtype=np.int64),
        velocities=np.zeros((1, 2), dtype=np.float32),
        discs=np.zeros((1, 0, 5), dtype=np.float32) if discs is None else discs[None].astype(np.float32),
    )


def some(name: str, every: int) -> Suite:
    suite = load_suite(name)
    names = ("arena_indices", "starts", "targets", "shortest_paths")
    return dataclasses.replace(suite, **{each: getattr(suite, each)[::every] for each in names})


@pytest.mark.parametrize("name", PLANNERS)
def test_the_way_is_straight_where_nothing_is_in_it(name: str) -> None:
    planner = PLANNERS[name](AROUND)
    for _ in range(3):  # a sampling planner's plan gets better from step to step
        linear, angular = planner(facing(np.full(60, 3.5), (2.0, 0.0)))[0].tolist()
    assert linear > 0.6
    assert abs(angular) < 0.2
    left = PLANNERS[name](AROUND)(facing(np.full(60, 3.5), (0.0, 2.0)))[0]
    assert left[1] > 0.3


@pytest.mark.parametrize("name", PLANNERS)
def test_nobody_is_touched_in_clutter(name: str) -> None:
    table = run_controller(PLANNERS[name](AROUND), AROUND, some("complex-200", 20))
    assert (table.outcomes == 1).mean() >= 0.8  # a plan without memory may wait before an obstacle
    assert not (table.outcomes == 2).any()


def bay() -> Suite:
    """A bay of walls between start and target, open towards the start."""
    walls = [(1.0, 0.0, 0.1, 1.5, 0.0), (0.0, 1.6, 1.1, 0.1, 0.0), (0.0, -1.6, 1.1, 0.1, 0.0)]
    hall = Arena("bay", boxes=np.array(walls))
    path = 2.0 * np.hypot(2.2, 1.8) + 2.0
    return Suite(
        "bay", "", (hall,), np.zeros(1, np.int32), np.array([[-2.5, 0.0, 0.0]]), np.array([[3.0, 0.0]]), np.array([path]),
        SuiteRules(patience=4.0),
    )  # fmt: skip


def test_who_remembers_gets_out_of_a_bay() -> None:
    assert run_controller(mapping_planner(AROUND), AROUND, bay()).outcomes.tolist() == [1]
    assert run_controller(dynamic_window(AROUND), AROUND, bay()).outcomes.tolist() == [3]
    assert run_controller(mapping_planner(AROUND, bay().arenas), AROUND, bay()).outcomes.tolist() == [1]


def test_vfh_turns_into_the_opening() -> None:
    # Blocked at 0.5 m from 45 degrees right to 20 degrees left, open beyond.
    angles = np.degrees(np.linspace(-np.pi, np.pi, 60, endpoint=False))
    ranges = np.where((angles > -45.0) & (angles < 20.0), 0.5, 3.5)
    assert vector_field_histogram(AROUND)(facing(ranges, (3.0, 0.0)))[0, 1] > 0.5
    shut = vector_field_histogram(AROUND)(facing(np.full(60, 0.4), (3.0, 0.1)))[0]
    assert shut.tolist() == [0.0, 1.0]


def test_a_ray_marks_what_it_hits_and_clears_what_it_passes() -> None:
    grid, start = np.zeros((20, 40), dtype=np.int8), np.array([[0.52, 1.05]])
    # From (0.52, 1.05) along x: the cells from column 5 on, and the surface 2 m on in column 25.
    trace(grid, 0.0, 0.0, 0.1, start, 0.0, np.array([0.0]), np.array([2.0]), 3.5)
    assert np.flatnonzero(grid[10] > 0).tolist() == [25]
    assert np.flatnonzero(grid[10] < 0).tolist() == list(range(5, 24))
    assert grid[10, 25] >= OCCUPIED
    assert not np.delete(grid, 10, axis=0).any()
    for _ in range(9):  # what has gone is forgotten
        trace(grid, 0.0, 0.0, 0.1, start, 0.0, np.array([0.0]), np.array([3.5]), 3.5)
    assert grid[10, 25] < OCCUPIED


def test_distances_are_those_of_scipy_but_for_the_grids_eight_directions() -> None:
    grid = np.where(np.random.default_rng(0).random((50, 60)) < 0.01, OCCUPIED, 0).astype(np.int8)
    found = np.empty(grid.shape, dtype=np.float32)
    distances(grid, 0.1, found)
    exact = 0.1 * distance_transform_edt(grid < OCCUPIED)
    assert (found >= exact - 1e-5).all()
    assert (found <= 1.09 * exact + 1e-5).all()


def test_a_way_leads_round_a_wall_and_there_is_none_through_it() -> None:
    grid = np.zeros((20, 20), dtype=np.int8)
    grid[:15, 10] = OCCUPIED
    gaps, way = np.empty((20, 20), dtype=np.float32), np.empty((100, 2), dtype=np.int32)
    distances(grid, 0.1, gaps)
    count = plan(gaps, 0.1, 0.15, 0.3, 2, 2, 2, 17, way)
    assert way[0].tolist() == [2, 2]
    assert way[count - 1].tolist() == [2, 17]
    assert (np.abs(np.diff(way[:count], axis=0)).max(axis=1) == 1).all()
    assert gaps[way[1 : count - 1, 0], way[1 : count - 1, 1]].min() >= 0.15
    grid[15:, 10] = OCCUPIED
    distances(grid, 0.1, gaps)
    assert plan(gaps, 0.1, 0.15, 0.3, 2, 2, 2, 17, way) == 0


def test_the_body_of_a_rollout_is_that_of_the_simulator() -> None:
    rng, jackal = np.random.default_rng(1), JackalConfig()
    half = jackal.half_extents
    for _ in range(50):
        points, pose = rng.uniform(-1.0, 1.0, (6, 2)), (*rng.uniform(-0.3, 0.3, 2), float(rng.uniform(-3.0, 3.0)))
        arena = Arena("points", circles=np.column_stack([points, np.full(6, 1e-9)]))
        found = gap_at(*pose, points, 6, *half, jackal.circumscribed_radius, 0.5)
        assert found == pytest.approx(min(rectangle_clearance(arena, pose, *half), 0.5), abs=1e-6)


def test_points_are_where_a_mounted_lidar_hits() -> None:
    # 0.1 m ahead of the middle and turned by a quarter to the left: 1 m to its front is 1 m to the robot's left.
    lidar = LidarConfig(rays=3, mount=SingleMount(x=0.1, yaw=90.0))
    scans = Scans(TaskConfig(lidar=lidar, observation=ObservationConfig.preset("improved", batches=3)))
    situation = facing(np.array([3.5, 1.0, 3.5]), (2.0, 0.0))
    points, counts = scans.points(situation)
    assert counts.tolist() == [1]
    assert points[0, 0] == pytest.approx([0.1, 1.0])
    ranges, angles = scans.polar(situation)
    assert ranges[0] == pytest.approx([3.5, np.hypot(0.1, 1.0), 3.5])
    assert angles[0, 1] == pytest.approx(np.arctan2(1.0, 0.1))


def test_another_drive_is_refused() -> None:
    task = TaskConfig(robot=RoundConfig(drive=OmnidirectionalDrive()))
    for planner in PLANNERS.values():
        with pytest.raises(BaselineError, match="omnidirectional"):
            planner(task)


def test_orca_gives_way_to_who_comes() -> None:
    # A person of 0.25 m comes straight on at 1 m/s, 1.5 m off and a little to the right: the robot goes to the left.
    task = load_suite("people-500").rules.task()
    person = np.array([[1.5, -0.1, 0.25, -0.2, 0.0]])
    linear, angular = reciprocal_avoidance(task)(facing(np.full(120, 6.0), (4.0, 0.0), person))[0].tolist()
    assert angular > 0.2
    assert linear < 1.0

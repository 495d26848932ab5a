"""The observation made on a robot is the simulator's, and a real scan becomes the rays that the policy knows."""

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from sim.config import (
    ArenaConfig,
    BearingPart,
    DoubleMount,
    DwellPart,
    KnownPart,
    LidarConfig,
    ObservationConfig,
    OpeningsPart,
    RangesPart,
    ReachPart,
    TaskConfig,
    TrailPart,
    WayPart,
)
from sim.envs.vector import NavigationVectorEnv
from sim.lidar import ray_angles as simulated_ray_angles
from workers.export.bundle import export_checkpoint
from workers.export.check import run_graph
from workers.export.ros2.mapless_navigator.dwell import Dwell
from workers.export.ros2.mapless_navigator.observation import Frames, Scan, observe, ray_angles, resample, wrap
from workers.export.ros2.mapless_navigator.openings import Openings
from workers.export.ros2.mapless_navigator.policy import PolicyFileError, Specification
from workers.export.ros2.mapless_navigator.trail import Trail
from workers.export.ros2.mapless_navigator.views import Views

TASKS = {
    "improved": TaskConfig(arena=ArenaConfig(name="complex")),
    "paper": TaskConfig(arena=ArenaConfig(name="complex"), observation=ObservationConfig.preset("paper")),
    "full circle": TaskConfig(
        arena=ArenaConfig(name="complex"),
        lidar=LidarConfig(rays=40, field_of_view=360.0),
        observation=ObservationConfig.preset("improved", batches=20),
    ),
}


def specification_of(make_checkpoint: Callable[..., Path], task: TaskConfig) -> Specification:
    return export_checkpoint(make_checkpoint(task=task)).specification


@pytest.mark.parametrize("name", TASKS)
def test_observation_equals_the_simulators(make_checkpoint: Callable[..., Path], name: str) -> None:
    exported = export_checkpoint(make_checkpoint(task=TASKS[name]))
    env = NavigationVectorEnv(TASKS[name], 64, seed=5)
    env.reset(seed=5)
    rng = np.random.default_rng(5)
    compared = 0
    for _ in range(60):
        actions = rng.uniform((0.0, -1.3), (1.3, 1.3), (64, 2)).astype(np.float32)
        observations, _, terminations, truncations, _ = env.step(actions)
        # Robots that start anew have no last action.
        last = np.where((terminations | truncations)[:, None], 0.0, np.clip(actions, (0.0, -1.0), (1.0, 1.0)))
        scene = {
            "ranges": np.array(env.ranges, np.float32),
            "pose": np.array(env.poses, np.float32),
            "target": np.array(env.targets, np.float32),
            "speeds": last.astype(np.float32),
        }
        made = observe(exported.specification, *scene.values())
        np.testing.assert_allclose(made, observations, rtol=0, atol=1e-5)
        np.testing.assert_allclose(run_graph(exported.by_scan, scene)["observation"], observations, rtol=0, atol=1e-5)
        compared += len(made)
    assert compared == 3840


def test_stacked_frames_are_the_simulators(make_checkpoint: Callable[..., Path]) -> None:
    task = TaskConfig(arena=ArenaConfig(name="complex"), observation=ObservationConfig.preset("improved", frames=3))
    exported = export_checkpoint(make_checkpoint(task=task))
    specification = exported.specification
    env = NavigationVectorEnv(task, 1, seed=5)
    observations, _ = env.reset(seed=5)
    rng = np.random.default_rng(5)
    frames = Frames(specification)
    last = np.zeros((1, 2), np.float32)
    starts = 0
    for _ in range(300):
        made = frames.push(observe(specification, env.ranges, env.poses, env.targets, last))
        np.testing.assert_allclose(made, observations, rtol=0, atol=1e-5)
        scene = {"ranges": env.ranges, "pose": env.poses, "target": env.targets, "speeds": last}
        scene["previous"] = observations[:, 16:]
        by_scan = run_graph(exported.by_scan, {name: np.array(array) for name, array in scene.items()})
        np.testing.assert_allclose(by_scan["observation"], observations, rtol=0, atol=1e-5)
        last = rng.uniform((0.0, -1.0), (1.0, 1.0), (1, 2)).astype(np.float32)
        observations, _, terminations, truncations, _ = env.step(last)
        if terminations[0] or truncations[0]:
            frames.clear()
            last = np.zeros((1, 2), np.float32)
            starts += 1
    assert starts > 1


@pytest.mark.parametrize(
    ("part", "remembers", "refusal"),
    [
        (TrailPart(), Trail, "Trail.see of trail.py"),
        (TrailPart(memory="long"), Trail, "Trail.see of trail.py"),
        (KnownPart(), Views, "Views.see of views.py"),
        (KnownPart(progress=True), Views, "Views.see of views.py"),
        (OpeningsPart(count=3), Openings, "Openings.see of openings.py"),
        (DwellPart(), Dwell, "Dwell.see of dwell.py"),
    ],
    ids=["short trail", "long trail", "known", "known with progress", "openings", "dwell"],
)
def test_what_it_remembers_of_its_way_is_the_simulators(
    make_checkpoint: Callable[..., Path],
    part: TrailPart | KnownPart | OpeningsPart | DwellPart,
    remembers: type[Trail | Dwell | Views | Openings],
    refusal: str,
) -> None:
    listed = (RangesPart(batches=30), BearingPart(), part)
    task = TaskConfig(arena=ArenaConfig(name="complex"), observation=ObservationConfig(parts=listed))
    exported = export_checkpoint(make_checkpoint(task=task))
    env = NavigationVectorEnv(task, 1, seed=5)
    observations, _ = env.reset(seed=5)
    rng, way = np.random.default_rng(5), remembers(exported.specification)
    ways = unequal = 0
    for _ in range(300):
        known = env.ranges, env.poses, env.targets, np.zeros((1, 2))
        sight = env.ranges[0], env.poses[0]
        seen = {way.kind: (way.see(*sight) if isinstance(way, Trail | Dwell) else way.see(*sight, env.targets[0]))[None]}
        made = observe(exported.specification, *known, added=seen)
        # A crumb on the edge of a sector, what lies on the edge of what a ray meets, falls on either side.
        unequal += int(np.abs(made - observations).max() > 1e-4)
        scene = {"ranges": env.ranges, "pose": env.poses, "target": env.targets} | seen
        by_scan = run_graph(exported.by_scan, {name: np.array(array, np.float32) for name, array in scene.items()})
        np.testing.assert_allclose(by_scan["observation"], made, rtol=0, atol=1e-5)
        observations, _, _, _, _ = env.step(rng.uniform((0.3, -1.0), (1.0, 1.0), (1, 2)).astype(np.float32))
        if env.outcomes[0]:
            way.clear()
            ways += 1
    assert unequal <= 6
    assert ways > 1
    with pytest.raises(PolicyFileError, match=refusal):
        observe(exported.specification, *known)


@pytest.mark.parametrize(
    "lidar",
    [LidarConfig(), LidarConfig(rays=60, field_of_view=360.0), LidarConfig(rays=20, mount=DoubleMount())],
    ids=["half", "full circle", "two"],
)
def test_ways_ahead_are_the_simulators(make_checkpoint: Callable[..., Path], lidar: LidarConfig) -> None:
    parts = (RangesPart(batches=10), ReachPart(sectors=20), WayPart())
    task = TaskConfig(arena=ArenaConfig(name="complex"), lidar=lidar, observation=ObservationConfig(parts=parts))
    exported = export_checkpoint(make_checkpoint(task=task))
    env = NavigationVectorEnv(task, 1, seed=5)
    observations, _ = env.reset(seed=5)
    rng = np.random.default_rng(5)
    seen = np.empty((300, 2))
    unequal = 0
    for step in range(300):
        made = observe(exported.specification, env.ranges, env.poses, env.targets, np.zeros((1, 2)))
        # What a ray meets at the very edge of a way falls on either side.
        unequal += int(np.abs(made - observations).max() > 1e-4)
        scene = {"ranges": env.ranges, "pose": env.poses, "target": env.targets}
        by_scan = run_graph(exported.by_scan, {name: np.array(array, np.float32) for name, array in scene.items()})
        unequal += int(np.abs(by_scan["observation"] - made).max() > 1e-4)
        seen[step] = made[0, -2:]
        observations, _, _, _, _ = env.step(rng.uniform((0.3, -1.0), (1.0, 1.0), (1, 2)).astype(np.float32))
    assert unequal <= 3
    # The way was free at times, and at times it was not.
    assert 0.0 < seen[:, 1].mean() < 1.0
    assert np.ptp(seen[:, 0]) > 0.5


@pytest.mark.parametrize("name", TASKS)
def test_rays_point_where_the_simulators_do(make_checkpoint: Callable[..., Path], name: str) -> None:
    rays = ray_angles(specification_of(make_checkpoint, TASKS[name]))
    np.testing.assert_allclose(rays, simulated_ray_angles(TASKS[name].lidar), rtol=0, atol=1e-12)


@given(st.floats(-50.0, 50.0))
def test_wrapped_angles_point_the_same_way(angle: float) -> None:
    wrapped = float(wrap(angle))
    assert -math.pi <= wrapped < math.pi
    assert math.isclose(math.cos(wrapped), math.cos(angle), abs_tol=1e-9)
    assert math.isclose(math.sin(wrapped), math.sin(angle), abs_tol=1e-9)


def circle(ranges: np.ndarray, *, start: float = 0.0, step: float | None = None) -> Scan:
    """A sensor that turns a full circle, as the TurtleBot3's does: first beam ahead, then to the left."""
    increment = step if step is not None else 2.0 * math.pi / len(ranges)
    return Scan(angle_min=start, angle_increment=increment, range_min=0.12, range_max=3.5, ranges=ranges)


def by_angle(angle: np.ndarray) -> np.ndarray:
    """A range that tells the direction: 2 m ahead, 1 m more for each radian to the left."""
    return 2.0 + 0.4 * wrap(angle)


@pytest.fixture
def specification(make_checkpoint: Callable[..., Path]) -> Specification:
    return specification_of(make_checkpoint, TaskConfig())


@pytest.mark.parametrize("sensor_yaw", [0.0, math.pi, -1.0])
@pytest.mark.parametrize("beams", [360, 720, 1441])
def test_each_ray_is_its_nearest_beam(specification: Specification, beams: int, sensor_yaw: float) -> None:
    angles = np.arange(beams) * 2.0 * math.pi / beams
    scan = circle(by_angle(angles + sensor_yaw))
    rays = resample(scan, specification, sensor_yaw, math.radians(5.0))
    # Half a beam off at most.
    np.testing.assert_allclose(rays, by_angle(ray_angles(specification)), rtol=0, atol=0.4 * math.pi / beams + 1e-9)


def test_a_sensor_that_turns_to_the_right_gives_the_same(specification: Specification) -> None:
    angles = -np.arange(720) * 2.0 * math.pi / 720
    scan = circle(by_angle(angles), step=-2.0 * math.pi / 720)
    rays = resample(scan, specification, 0.0, math.radians(5.0))
    np.testing.assert_allclose(rays, by_angle(ray_angles(specification)), rtol=0, atol=0.4 * math.pi / 720 + 1e-9)


def test_a_scan_along_the_policys_own_rays_is_kept(specification: Specification) -> None:
    ranges = np.random.default_rng(0).uniform(0.2, 3.5, 30)
    angles = ray_angles(specification)
    scan = Scan(angles[0], angles[1] - angles[0], 0.1, 3.5, ranges)
    np.testing.assert_array_equal(resample(scan, specification, 0.0, math.radians(5.0)), ranges)


@pytest.mark.parametrize(
    ("written", "read"),
    [(math.inf, 3.5), (9.0, 3.5), (-math.inf, 0.0), (0.5, 0.5), (3.5, 3.5)],
    ids=["no hit", "beyond the sensor", "too near to measure", "a hit", "at its range"],
)
def test_what_a_beam_may_say(specification: Specification, written: float, read: float) -> None:
    rays = resample(circle(np.full(360, written)), specification, 0.0, math.radians(5.0))
    np.testing.assert_array_equal(rays, np.full(30, read))


@pytest.mark.parametrize("unknown", [math.nan, 0.0, 0.05])
def test_a_lost_beam_is_replaced_by_its_neighbour_and_a_gap_is_unknown(specification: Specification, unknown: float) -> None:
    ranges = np.full(360, 2.0)
    ranges[0] = unknown
    assert (resample(circle(ranges), specification, 0.0, math.radians(5.0)) == 2.0).all()
    ranges[:20] = unknown
    rays = resample(circle(ranges), specification, 0.0, math.radians(5.0))
    lost = ray_angles(specification)[np.isnan(rays)]
    # Beams 0 to 19 degrees are gone; rays more than 5 degrees from -1 and 20 degrees have no beam.
    assert np.degrees(lost.min()) > 4.0
    assert np.degrees(lost.max()) < 15.0
    assert np.isnan(resample(circle(np.full(360, unknown)), specification, 0.0, math.radians(5.0))).all()


def test_a_sensor_that_sees_less_than_the_policy_leaves_rays_unknown(specification: Specification) -> None:
    ahead = Scan(-math.radians(60.0), math.radians(1.0), 0.1, 10.0, np.full(121, 1.0))
    rays = resample(ahead, specification, 0.0, math.radians(5.0))
    known = np.abs(np.degrees(ray_angles(specification))) <= 65.0
    np.testing.assert_array_equal(~np.isnan(rays), known)

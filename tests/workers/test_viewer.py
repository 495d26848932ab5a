"""What a training shows: frames while somebody watches, nothing otherwise, and never more than what really happens."""

import threading
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from sim.arenas import build_arena, build_arenas
from sim.config import ArenaConfig, BurgerConfig, GeneratedArenaConfig, MoversConfig, RandomisationConfig, TaskConfig
from sim.envs.vector import NavigationVectorEnv
from sim.scan import scan
from workers.frames import Frame
from workers.live.clips import CLIP_STEPS, ClipRecorder
from workers.live.showcase import Showcase, along_arc
from workers.live.viewer import LiveViewer
from workers.reporting import EvaluationResult, EventLevel, WatchRequest

TASK = TaskConfig(arena=ArenaConfig(name="complex"))


class Watching:
    """A reporter whose watch can be changed; collects what it is told."""

    def __init__(self, watch: WatchRequest | None = None) -> None:
        self.watch = watch
        self.stop_requested = False
        self.sent: list[Frame] = []
        self.events: list[tuple[EventLevel, str]] = []

    def metrics(self, step: int, values: Mapping[str, float]) -> None: ...

    def event(self, step: int, level: EventLevel, message: str) -> None:
        self.events.append((level, message))

    def checkpoint(self, step: int, archive: Path, evaluation: EvaluationResult | None) -> None: ...

    def frames(self, frames: Sequence[Frame]) -> None:
        self.sent += frames


def curve_left(observations: NDArray[np.float32]) -> NDArray[np.float32]:
    """Half speed ahead, half a radian per second to the left."""
    return np.tile(np.array([0.5, 0.5], np.float32), (len(observations), 1))


def wait_until(condition: Callable[[], bool], seconds: float = 60.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "waited in vain"
        time.sleep(0.01)


def viewer_threads() -> list[threading.Thread]:
    return [thread for thread in threading.enumerate() if thread.name == "live-viewer"]


def test_a_quarter_circle() -> None:
    # Radius v / w = 0.5 m, a quarter turn takes pi / 2 seconds at 1 rad/s.
    pose = along_arc(np.zeros((1, 3), np.float32), np.array([[0.5, 0.0, 1.0]], np.float32), np.pi / 2)
    np.testing.assert_allclose(pose, [[0.5, 0.5, np.pi / 2]], atol=1e-6)


def test_straight_ahead() -> None:
    pose = along_arc(np.array([[1.0, 2.0, np.pi / 2]], np.float32), np.array([[0.25, 0.0, 0.0]], np.float32), 4.0)
    np.testing.assert_allclose(pose, [[1.0, 3.0, np.pi / 2]], atol=1e-6)


@given(st.floats(0.0, 0.25), st.floats(-1.0, 1.0), st.floats(-3.0, 3.0), st.floats(0.0, 1.0))
def test_two_parts_of_an_arc_make_the_whole(speed: float, turn: float, heading: float, part: float) -> None:
    start = np.array([[0.3, -0.7, heading]], np.float32)
    velocities = np.array([[speed, 0.3 * speed, turn]], np.float32)
    in_two = along_arc(along_arc(start, velocities, part), velocities, 1.0 - part)
    whole = along_arc(start, velocities, 1.0)
    np.testing.assert_allclose(in_two[:, :2], whole[:, :2], atol=1e-5)
    np.testing.assert_allclose(np.cos(in_two[:, 2] - whole[:, 2]), 1.0, atol=1e-6)


def test_between_two_steps_a_robot_is_on_the_arc_that_the_simulation_drives() -> None:
    env = NavigationVectorEnv(TASK, 4, seed=3)
    env.reset()
    before = env.poses.copy()
    env.step(np.tile(np.array([0.8, -0.6], np.float32), (4, 1)))
    after = along_arc(before, np.tile(np.array([0.2, 0.0, -0.6], np.float32), (4, 1)), TASK.control_period)
    drove = env.outcomes == 0
    assert drove.any()
    np.testing.assert_allclose(after[drove, :2], env.poses[drove, :2], atol=1e-4)
    np.testing.assert_allclose(np.cos(after[drove, 2] - env.poses[drove, 2]), 1.0, atol=1e-6)


def test_a_showcase_moves_smoothly_and_scans_where_it_shows_the_robots() -> None:
    showcase = Showcase(TASK, 3)
    arena = build_arenas(TASK.arena)[0]
    last: Frame | None = None
    for _ in range(60):
        showcase.advance(curve_left, 1 / 30)
        frame = showcase.frame(step=7, speed=1.0)
        assert frame.poses.shape == (3, 3)
        np.testing.assert_allclose(frame.ranges, scan(arena, frame.poses, TASK.lidar), atol=1e-5)
        if last is not None:
            same_attempt = (frame.targets == last.targets).all(axis=1)
            moved = np.hypot(*(frame.poses[:, :2] - last.poses[:, :2]).T)
            # A thirtieth of a second at 0.125 m/s.
            np.testing.assert_allclose(moved[same_attempt], 0.125 / 30, rtol=0.02)
        last = frame
    assert last is not None
    assert last.sim_time == pytest.approx(2.0)
    assert (last.mode, last.step, last.speed) == ("policy", 7, 1.0)


def test_a_showcase_does_not_jump_where_robots_drive_otherwise_than_commanded() -> None:
    task = TASK.model_copy(
        update={
            "robot": BurgerConfig(max_linear_acceleration=0.2),
            "command_delay": 2,
            "randomisation": RandomisationConfig(max_linear_speed=(0.1, 0.2), field_of_view=(90.0, 240.0)),
        }
    )
    showcase = Showcase(task, 20)
    arena = build_arenas(task.arena)[0]
    steps = []
    last: Frame | None = None
    for _ in range(90):
        showcase.advance(curve_left, 1 / 30)
        frame = showcase.frame(step=7, speed=1.0)
        seen = scan(arena, frame.poses, task.lidar, fields_of_view=frame.fields_of_view)
        np.testing.assert_allclose(frame.ranges, seen, atol=1e-5)
        if last is not None:
            same_attempt = (frame.targets == last.targets).all(axis=1)
            steps.append(np.hypot(*(frame.poses[:, :2] - last.poses[:, :2]).T)[same_attempt])
        last = frame
    assert steps[0].max() == 0.0  # the first command is yet to come
    assert np.concatenate(steps).max() <= 0.5 * 0.2 / 30 + 1e-5  # at half of its top speed
    assert np.concatenate(steps).mean() > 0.5 * 0.1 / 30 * 0.7


def test_a_showcase_shows_movers_as_smoothly_as_robots_and_scans_them_where_it_shows_them() -> None:
    arena = ArenaConfig(name="complex", movers=MoversConfig(count=5, speed=1.5))
    task = TASK.model_copy(update={"arena": arena})
    showcase = Showcase(task, 2)
    places = []
    for _ in range(120):
        showcase.advance(curve_left, 1 / 30)
        frame = showcase.frame(step=7, speed=1.0)
        assert frame.movers[:, 2] == pytest.approx(0.25)
        still = build_arenas(task.arena)[0]
        np.testing.assert_allclose(frame.ranges, scan(still, frame.poses, task.lidar, movers=frame.movers), atol=1e-5)
        places.append(frame.movers[:, :2])
    moved = np.hypot(*np.moveaxis(np.diff(places, axis=0), -1, 0))
    assert moved.max() <= 1.5 / 30 + 1e-5
    assert moved.mean() > 0.5 / 30


def test_a_showcase_shows_no_more_than_are_together_and_what_they_see_of_one_another() -> None:
    task = TASK.model_copy(update={"together": 3})
    showcase = Showcase(task, 8)
    assert showcase.robots == 3
    still, body = build_arenas(task.arena)[0], task.robot.circumscribed_radius
    met = 0
    # They begin anywhere: some see nobody for a long while.
    for _ in range(1_200):
        if met:
            break
        showcase.advance(curve_left, 1 / 10)
        frame = showcase.frame(step=7, speed=1.0)
        assert len(frame.movers) == 0
        discs = np.column_stack([frame.poses[:, :2], np.full(3, body)])
        for i in range(3):
            seen = scan(still, frame.poses[i], task.lidar, movers=np.delete(discs, i, axis=0))
            np.testing.assert_allclose(frame.ranges[i], seen[0], atol=1e-5)
            met += int((seen < scan(still, frame.poses[i], task.lidar)).any())
    assert met


def test_a_clip_shows_a_group_as_robots() -> None:
    task = TASK.model_copy(update={"together": 4})
    env = NavigationVectorEnv(task, 12, seed=5)
    env.reset()
    recorder = ClipRecorder(robots=64, control_period=0.2, frame_rate=30.0)
    for step in range(20):
        env.step(np.tile(np.array([0.3, 0.5], np.float32), (12, 1)))
        recorder.record(env, step)
        frame = recorder.take()
        assert frame is not None
        assert len(frame.movers) == 0
        np.testing.assert_array_equal(frame.poses, env.poses[:4])


def test_a_showcase_at_ten_times_real_time_makes_every_control_step() -> None:
    calls = 0

    def counting(observations: NDArray[np.float32]) -> NDArray[np.float32]:
        nonlocal calls
        calls += 1
        return curve_left(observations)

    showcase = Showcase(TASK, 1)
    for _ in range(30):
        showcase.advance(counting, 10 / 30)
    # Ten simulated seconds of 0.2 s each; the first step is made at once.
    assert calls in (50, 51)


def test_actions_beyond_the_limits_are_shown_as_driven() -> None:
    showcase = Showcase(TASK, 1)

    def wild(observations: NDArray[np.float32]) -> NDArray[np.float32]:
        return np.full((len(observations), 2), 9.0, np.float32)

    showcase.advance(wild, 0.0)
    start = showcase.frame(0, 1.0).poses
    showcase.advance(wild, 0.1)
    moved = np.hypot(*(showcase.frame(0, 1.0).poses - start)[0, :2])
    assert moved == pytest.approx(0.025, rel=0.02)


def test_a_clip_holds_consecutive_steps_of_the_training_robots() -> None:
    env = NavigationVectorEnv(TASK, 6, seed=1)
    env.reset()
    recorder = ClipRecorder(robots=4, control_period=0.2, frame_rate=30.0)
    poses = []
    for step in range(CLIP_STEPS + 50):
        env.step(np.tile(np.array([0.4, 0.3], np.float32), (6, 1)))
        recorder.record(env, 6 * (step + 1))
        poses.append(env.poses[:4].copy())
    frames = list(iter(recorder.take, None))
    # The clip is complete, and the next one waits until this one has been played.
    assert len(frames) == CLIP_STEPS
    assert [frame.step for frame in frames] == [6 * (step + 1) for step in range(CLIP_STEPS)]
    np.testing.assert_array_equal([frame.poses for frame in frames], poses[:CLIP_STEPS])
    np.testing.assert_allclose(np.diff([frame.sim_time for frame in frames]), 0.2)
    # One step of 0.2 s a frame, thirty frames a second.
    np.testing.assert_allclose([frame.speed for frame in frames], 6.0)


def test_a_clip_stays_in_one_arena_of_a_pool() -> None:
    task = TaskConfig(arena=GeneratedArenaConfig(maps=3))
    env = NavigationVectorEnv(task, 12, seed=5)
    env.reset()
    recorder = ClipRecorder(robots=4, control_period=0.2, frame_rate=30.0)
    driven = []
    for step in range(CLIP_STEPS):
        env.step(np.tile(np.array([1.0, 0.1], np.float32), (12, 1)))
        recorder.record(env, 12 * (step + 1))
        driven.append((env.poses.copy(), env.arena_indices.copy()))
    frames = list(iter(recorder.take, None))
    assert len({(frame.arena, frame.poses.shape) for frame in frames}) == 1
    arena = frames[0].arena
    assert (driven[0][1] == arena).sum() == np.bincount(driven[0][1]).max()

    shown = np.flatnonzero(driven[0][1] == arena)[:4]
    gone = np.zeros(len(shown), np.bool_)
    for number, (frame, (poses, arenas)) in enumerate(zip(frames, driven, strict=True)):
        gone |= arenas[shown] != arena
        np.testing.assert_array_equal(frame.poses[~gone], poses[shown][~gone])
        if number:
            # Whoever has gone to another arena stays where he was last seen.
            np.testing.assert_array_equal(frame.poses[gone], frames[number - 1].poses[gone])
    assert gone.any()


def test_a_clip_shows_the_movers_that_its_robots_meet() -> None:
    movers = MoversConfig(count=3)
    task = TaskConfig(arena=GeneratedArenaConfig(maps=2, movers=movers), collision_distance=0.0)
    env = NavigationVectorEnv(task, 300, seed=5)
    env.reset()
    recorder = ClipRecorder(robots=64, control_period=0.2, frame_rate=30.0)
    for step in range(CLIP_STEPS):
        env.step(np.tile(np.array([0.3, 0.5], np.float32), (300, 1)))
        before = env.tiles().copy()
        recorder.record(env, step)
        frame = recorder.take()
        assert frame is not None
        if step == 0:
            tile = int(np.bincount(before).argmax())
        assert frame.arena == tile % 2
        np.testing.assert_array_equal(frame.movers, env.discs[tile, :, :3])
    # Three copies of each map: the robots of a clip are of one of them.
    assert env.discs.shape[:2] == (6, 3)


def test_a_showcase_drives_in_one_arena_of_a_pool() -> None:
    task = TaskConfig(arena=GeneratedArenaConfig(maps=64, seed=2))
    showcase = Showcase(task, 2)
    arena = build_arena(task.arena, 0)
    for _ in range(30):
        showcase.advance(curve_left, 10 / 30)
        frame = showcase.frame(0, 10.0)
        assert frame.arena == 0
        np.testing.assert_allclose(frame.ranges, scan(arena, frame.poses, task.lidar), atol=1e-5)


def test_a_clip_shows_no_more_robots_than_train() -> None:
    env = NavigationVectorEnv(TASK, 2, seed=1)
    env.reset()
    env.step(np.zeros((2, 2), np.float32))
    recorder = ClipRecorder(robots=64, control_period=0.2, frame_rate=30.0)
    recorder.record(env, 2)
    frame = recorder.take()
    assert frame is not None
    assert frame.poses.shape == (2, 3)


def test_nothing_is_made_while_nobody_watches() -> None:
    reporter = Watching()
    viewer = LiveViewer(TASK, reporter)
    env = NavigationVectorEnv(TASK, 2, seed=1)
    env.reset()

    def snapshot() -> Callable[[NDArray[np.float32]], NDArray[np.float32]]:
        raise AssertionError("weights were copied for nobody")

    for step in range(20):
        env.step(np.zeros((2, 2), np.float32))
        viewer.on_step(env, step)
        viewer.on_weights(snapshot, step)
    assert viewer_threads() == []
    assert reporter.sent == []
    viewer.close()


def test_policy_mode_sends_frames_until_nobody_watches_any_more() -> None:
    reporter = Watching(WatchRequest(mode="policy", robots=3, speed=2.0))
    viewer = LiveViewer(TASK, reporter)
    viewer.on_weights(lambda: curve_left, 4096)
    wait_until(lambda: len(reporter.sent) >= 5)
    frame = reporter.sent[-1]
    assert (frame.mode, frame.step, frame.speed, frame.poses.shape) == ("policy", 4096, 2.0, (3, 3))
    np.testing.assert_allclose(np.diff([frame.sim_time for frame in reporter.sent]), 2 / 30, rtol=1e-6)

    reporter.watch = WatchRequest(mode="policy", robots=1)
    wait_until(lambda: reporter.sent[-1].poses.shape == (1, 3))

    reporter.watch = None
    wait_until(lambda: viewer_threads() == [])
    sent = len(reporter.sent)
    viewer.on_weights(lambda: curve_left, 8192)
    assert viewer_threads() == []
    assert len(reporter.sent) == sent

    reporter.watch = WatchRequest(mode="policy", robots=1)
    viewer.on_weights(lambda: curve_left, 12_288)
    wait_until(lambda: reporter.sent[-1].step == 12_288)
    viewer.close()
    assert viewer_threads() == []


def test_training_mode_sends_what_the_training_robots_do() -> None:
    reporter = Watching(WatchRequest(mode="training", robots=2))
    viewer = LiveViewer(TASK, reporter)
    env = NavigationVectorEnv(TASK, 4, seed=1)
    env.reset()
    poses = set()
    step = 0

    def train() -> bool:
        nonlocal step
        env.step(np.tile(np.array([1.0, 0.2], np.float32), (4, 1)))
        step += 4
        viewer.on_step(env, step)
        poses.add(env.poses[:2].tobytes())
        viewer.on_weights(lambda: curve_left, step)
        return len(reporter.sent) >= 20

    wait_until(train)
    viewer.close()
    assert {frame.mode for frame in reporter.sent} == {"training"}
    assert {frame.poses.tobytes() for frame in reporter.sent} <= poses
    assert np.all(np.diff([frame.step for frame in reporter.sent]) == 4)


def test_a_policy_that_fails_ends_the_view_and_not_the_training() -> None:
    reporter = Watching(WatchRequest(mode="policy", robots=1))
    viewer = LiveViewer(TASK, reporter)

    def broken(observations: NDArray[np.float32]) -> NDArray[np.float32]:
        raise ValueError("wrong shape")

    viewer.on_weights(lambda: broken, 1)
    wait_until(lambda: bool(reporter.events))
    wait_until(lambda: viewer_threads() == [])
    viewer.on_weights(lambda: broken, 2)
    assert viewer_threads() == []
    assert reporter.events == [("warning", "The live view of this training has stopped: ValueError('wrong shape').")]
    viewer.close()

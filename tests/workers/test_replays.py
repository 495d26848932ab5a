"""An evaluation driven again is the evaluation: same outcomes, same steps, every moment where the simulation says."""

from pathlib import Path

import numpy as np
import pytest

from sim.arenas import build_arena
from sim.config import ArenaFile, ImportedArenaConfig
from sim.config.arena_file import Pedestrian
from sim.scan import scan
from sim.suites import load_suite, run_suite, suite_for
from workers.checkpoints import read_policy
from workers.errors import EpisodesTooLongError
from workers.job_protocol import ArenaSuite, NamedSuite, ShippedPolicyName
from workers.policy import torch_policy
from workers.replays import record as recorder
from workers.replays.record import Moments, record
from workers.replays.recording import Recording
from workers.shipped.library import shipped_policy
from workers.training.evaluation import evaluate
from workers.training.measuring import Driven

POLICY = shipped_policy("complex")
SHIPPED = ShippedPolicyName(name="complex")
SUITE = load_suite("complex-200")


@pytest.fixture(scope="module")
def recording() -> Recording:
    return record(POLICY.archive, SHIPPED)


def test_it_ends_as_the_evaluation_did(recording: Recording) -> None:
    manifest, policy = read_policy(POLICY.archive)
    # torch flushes denormal numbers in a training; that this evaluation does not makes no difference to any episode.
    evaluation = evaluate(torch_policy(policy), manifest.training.task, SUITE)
    assert recording.evaluation == evaluation


def test_every_episode_is_there_from_its_start_to_its_end(recording: Recording) -> None:
    for episode, result in enumerate(recording.evaluation.episodes):
        track = recording.track(episode)
        assert len(track.poses) == len(track.ranges) == result.steps + 1
        np.testing.assert_allclose(track.poses[0], SUITE.starts[episode], atol=1e-5)
        np.testing.assert_allclose(track.target, SUITE.targets[episode], atol=1e-5)
        driven = np.hypot(*np.diff(track.poses[:, :2], axis=0).T).sum()
        assert driven == pytest.approx(result.path_length, rel=0.01, abs=0.01)
        if result.outcome == "arrival":
            assert np.hypot(*(track.poses[-1, :2] - track.target)) <= 0.2 + 1e-5


def test_rays_are_those_of_the_poses(recording: Recording) -> None:
    track = recording.track(7)
    arena = SUITE.arenas[SUITE.arena_indices[7]]
    task = POLICY.card.training.task
    # Half-precision numbers are 2 mm apart at 3.5 m.
    np.testing.assert_allclose(track.ranges, scan(arena, track.poses, task.lidar), atol=2e-3)
    assert (track.arena.width, len(track.arena.circles)) == (2 * arena.half_width, len(arena.circles))


def test_movers_are_where_the_rays_met_them() -> None:
    suite = load_suite("crowd-200")
    recording = record(POLICY.archive, SHIPPED, NamedSuite(name="crowd-200"))
    task = POLICY.card.training.task
    for episode in (3, 150):
        track = recording.track(episode)
        arena = suite.arenas[suite.arena_indices[episode]]
        assert track.movers.shape == (len(track.poses), 4, 3)
        for pose, ranges, movers in zip(track.poses, track.ranges, track.movers, strict=True):
            np.testing.assert_allclose(ranges, scan(arena, pose[None], task.lidar, movers=movers)[0], atol=2e-3)


def test_people_who_give_way_are_where_the_rays_met_them() -> None:
    """In one arena, every robot meets people of its own: where they go depends on where it goes."""
    person = Pedestrian(kind="pedestrian", sees_robots=True)
    arena = ArenaFile(name="Hall", width=8.0, height=6.0, movers=(person,) * 3)
    suite = ArenaSuite(arena=ImportedArenaConfig.of(arena))
    recording = record(POLICY.archive, SHIPPED, suite)
    task = POLICY.card.training.task
    ways = set()
    for episode in (0, 60, 120):
        track = recording.track(episode)
        ways.add(track.movers[min(len(track.movers) - 1, 20)].tobytes())
        for pose, ranges, movers in zip(track.poses, track.ranges, track.movers, strict=True):
            np.testing.assert_allclose(
                ranges, scan(build_arena(suite.arena, 0), pose[None], task.lidar, movers=movers)[0], atol=2e-3
            )
    assert len(ways) > 1


def test_robots_that_are_together_are_one_anothers_traffic() -> None:
    task = POLICY.card.training.task.model_copy(update={"together": 3})
    suite, moments = suite_for(task), Moments(task)
    table = run_suite(torch_policy(read_policy(POLICY.archive)[1]), task, suite, moments)
    recording = moments.recording(Driven(suite, task, table))
    tracks = [recording.track(episode) for episode in range(3)]
    for own, track in enumerate(tracks):
        arena = suite.arenas[suite.arena_indices[own]]
        others = [each for other, each in enumerate(tracks) if other != own]
        for moment, (pose, ranges, movers) in enumerate(zip(track.poses, track.ranges, track.movers, strict=True)):
            seen = scan(arena, pose[None], task.lidar, movers=movers)[0]
            np.testing.assert_allclose(ranges, seen, atol=4e-3)
            for mover, other in zip(movers, others, strict=True):
                # Who has ended its attempt is gone: a point is left of it.
                under_way = moment < len(other.poses)
                np.testing.assert_allclose(mover[:2], other.poses[moment if under_way else -1, :2], atol=1e-5)
                assert (mover[2] > 0.01) == under_way


def test_commands_speeds_and_reward_terms_are_those_of_each_step(recording: Recording) -> None:
    task = POLICY.card.training.task
    for episode in (0, 7, 199):
        track, result = recording.track(episode), recording.evaluation.episodes[episode]
        for numbers in (track.commands, track.twists, track.terms):
            assert len(numbers) == result.steps + 1
            assert not numbers[0].any()
        # Nothing limits or delays this robot: it does as it is told, and that is how it moved.
        np.testing.assert_allclose(track.twists[1:, [0, 2]], track.commands[1:], atol=1e-5)
        moved = np.hypot(*np.diff(track.poses[:-1, :2], axis=0).T) / task.control_period
        half = 0.5 * task.control_period * track.twists[1:-1, 2].astype(np.float64)
        np.testing.assert_allclose(moved, track.twists[1:-1, 0] * np.sinc(half / np.pi), atol=1e-4)
        assert track.terms.sum() == pytest.approx(result.reward, rel=1e-4)
        values = track.values()
        assert values[-1] == 0.0
        assert values[-2] == pytest.approx(track.terms[-1].sum())
        rewards = track.terms[1:].sum(axis=1, dtype=np.float64)
        assert values[0] == pytest.approx((recording.gamma ** np.arange(len(rewards)) * rewards).sum())


def test_its_file_gives_everything_back(recording: Recording, tmp_path: Path) -> None:
    recording.save(tmp_path / "recording.npz")
    assert [path.name for path in tmp_path.iterdir()] == ["recording.npz"]
    again = Recording.load(tmp_path / "recording.npz")
    assert (again.evaluation, again.arenas) == (recording.evaluation, recording.arenas)
    assert again.gamma == recording.gamma
    arrays = ("arena_indices", "targets", "offsets", "poses", "ranges", "movers", "mover_indices")
    for name in (*arrays, "commands", "twists", "terms"):
        np.testing.assert_array_equal(getattr(again, name), getattr(recording, name))


def test_what_is_no_recording_is_refused(recording: Recording, tmp_path: Path) -> None:
    recording.save(tmp_path / "whole.npz")
    whole = (tmp_path / "whole.npz").read_bytes()
    np.savez(tmp_path / "other.npz", poses=recording.poses)
    other = (tmp_path / "other.npz").read_bytes()
    for content in (b"", b"not a recording", whole[: len(whole) // 2], whole[:500] + b"x" * 100 + whole[600:], other):
        (tmp_path / "torn.npz").write_bytes(content)
        with pytest.raises(ValueError, match=r"."):
            Recording.load(tmp_path / "torn.npz")
    with pytest.raises(OSError, match="No such file"):
        Recording.load(tmp_path / "missing.npz")


@pytest.mark.parametrize("episode", [-1, 200])
def test_there_is_no_other_episode(recording: Recording, episode: int) -> None:
    with pytest.raises(IndexError, match="200 episodes"):
        recording.track(episode)


def test_what_does_not_fit_into_memory_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recorder, "MAX_MOMENT_NUMBERS", 10_000)
    with pytest.raises(EpisodesTooLongError, match="lower the step limit"):
        record(POLICY.archive, SHIPPED)

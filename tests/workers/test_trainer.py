"""The training loop on the real environment: it learns, tells, saves, stops and resumes exactly."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from sim.arenas import build_arena, with_maps_of
from sim.config import (
    ArenaConfig,
    GeneratedArenaConfig,
    JackalConfig,
    MoversConfig,
    ObservationConfig,
    RandomisationConfig,
    TaskConfig,
)
from workers.checkpoints import read_checkpoint, read_manifest, read_policy, write_checkpoint
from workers.config import DdpgConfig, EvaluationConfig, MlpNetwork, PpoConfig, SacConfig, Td3Config, TrainingConfig
from workers.errors import ArchiveMismatchError, NoDeviceError, NonFiniteError
from workers.frames import Frame
from workers.live.viewing import Unwatched
from workers.reporting import EpisodeResult, EvaluationResult, EventLevel, WatchRequest
from workers.training.evaluation import evaluation_metrics
from workers.training.metrics import TrainingMetrics
from workers.training.table import TableRow
from workers.training.trainer import Training, train

REWARD_TERMS = {"reward/arrival", "reward/collision", "reward/progress"}
METRICS = {
    *REWARD_TERMS,
    *("train/reward", "loss/policy", "loss/value", "policy/kl", "policy/entropy", "policy/clip_fraction"),
    *("policy/std_linear", "policy/std_angular", "value/explained_variance", "optim/learning_rate"),
    *("time/steps_per_second", "time/simulation", "time/inference", "time/update", "time/reporting", "time/evaluation"),
    *("time/wall_seconds", "time/cpu_seconds", "train/episodes"),
    *("train/linear_speed", "train/angular_speed", "train/spin", "policy/saturation", "observation/constant"),
}
ATTEMPT_METRICS = {  # only where an attempt ended
    *("train/success_rate", "train/collision_rate", "train/timeout_rate", "train/return", "train/episode_length"),
}
EVALUATION_METRICS = {
    *("eval/success_rate", "eval/collision_rate", "eval/timeout_rate", "eval/reward", "eval/return"),
    *("eval/steps", "eval/path_efficiency"),
}

TINY = TrainingConfig(
    algorithm=PpoConfig(network=MlpNetwork(hidden_sizes=(16,)), robots=32, rollout_steps=16, minibatch_size=128, epochs=2),
    steps=4_000,  # 7.8 updates of 512 steps: the last one goes past it
    evaluation=EvaluationConfig(every_steps=2_000),
)


class Recorder:
    """A reporter that keeps everything, and asks to stop once a number of reports is in."""

    def __init__(self, stop_after: int | None = None) -> None:
        self.rows: list[tuple[int, dict[str, float]]] = []
        self.events: list[str] = []
        self.checkpoints: list[tuple[int, Path, EvaluationResult | None]] = []
        self._stop_after = stop_after

    def metrics(self, step: int, values: Mapping[str, float]) -> None:
        self.rows.append((step, dict(values)))

    def event(self, step: int, level: EventLevel, message: str) -> None:
        self.events.append(message)

    def checkpoint(self, step: int, archive: Path, evaluation: EvaluationResult | None) -> None:
        assert self.rows[-1][0] >= step, "a checkpoint is never ahead of its metrics"
        self.checkpoints.append((step, archive, evaluation))

    def frames(self, frames: Sequence[Frame]) -> None:
        raise AssertionError("nobody watches")

    @property
    def watch(self) -> WatchRequest | None:
        return None

    @property
    def stop_requested(self) -> bool:
        return self._stop_after is not None and len(self.rows) >= self._stop_after


def learned(rows: list[tuple[int, dict[str, float]]]) -> list[tuple[int, dict[str, float]]]:
    """Without what depends on the clock."""
    return [(step, {k: v for k, v in values.items() if not k.startswith("time/")}) for step, values in rows]


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Recorder:
    recorder = Recorder()
    assert train(TINY, 5, recorder, tmp_path_factory.mktemp("whole"), report_interval=0.0) == "completed"
    return recorder


def test_metrics_have_their_standard_names_and_growing_steps(whole: Recorder) -> None:
    assert [step for step, _ in whole.rows] == [512 * update for update in range(1, 9)]
    names = [values.keys() for _, values in whole.rows]
    assert set.union(*map(set, names)) <= METRICS | ATTEMPT_METRICS | EVALUATION_METRICS
    assert set.intersection(*map(set, names)) >= METRICS
    assert names[2] & ATTEMPT_METRICS == ATTEMPT_METRICS
    phases = ("simulation", "inference", "update", "reporting", "evaluation")
    shares = [sum(values[f"time/{phase}"] for phase in phases) for _, values in whole.rows]
    assert all(0.0 < share <= 1.0 for share in shares)
    assert max(shares) > 0.5  # such short updates are often interrupted, but not all of them
    for step, values in whole.rows:
        assert ("eval/success_rate" in values) == (step in (2048, 4096))
    assert all(np.isfinite(value) for _, values in whole.rows for value in values.values())


def test_every_term_of_the_reward_is_told_and_together_they_are_the_reward(whole: Recorder) -> None:
    for _, values in whole.rows:
        assert sum(values[name] for name in REWARD_TERMS) == pytest.approx(values["train/reward"], abs=1e-3)
        # The basic reward: 120 on arrival, -100 on collision, progress, and no more.
        assert values["reward/arrival"] * 512 % 120 == pytest.approx(0.0, abs=1e-6)
        assert values["reward/collision"] * 512 % 100 == pytest.approx(0.0, abs=1e-6)
        assert {name for name in values if name.startswith("reward/")} == REWARD_TERMS
    assert any(values["reward/collision"] < 0.0 for _, values in whole.rows)


def test_every_evaluation_keeps_a_checkpoint(whole: Recorder) -> None:
    assert [step for step, _, _ in whole.checkpoints] == [2048, 4096]
    for step, archive, evaluation in whole.checkpoints:
        manifest = read_manifest(archive)
        assert (manifest.step, manifest.seed, manifest.training) == (step, 5, TINY)
        assert evaluation is not None
        assert manifest.evaluation is not None
        assert manifest.evaluation.episodes == len(evaluation.episodes) == 200
        assert len({number.name for number in manifest.observation.numbers}) == 16


def test_first_report_comes_with_the_first_update(tmp_path: Path) -> None:
    recorder = Recorder()
    train(TINY, 5, recorder, tmp_path, report_interval=1e9)
    assert [step for step, _ in recorder.rows] == [512, 2048, 4096]


def test_another_robot_among_movers_with_stacked_frames_and_drawn_disturbances_trains_and_resumes_as_well(
    tmp_path: Path,
) -> None:
    task = TaskConfig(
        arena=ArenaConfig(movers=MoversConfig(count=3)),
        robot=JackalConfig(),
        observation=ObservationConfig.preset("improved", frames=3),
        randomisation=RandomisationConfig(rate=(2.0, 10.0), heading_noise=(0.0, 0.1), command_delay=(0, 2)),
    )
    config = TINY.model_copy(update={"task": task, "steps": 2_000})
    whole, first, second = Recorder(), Recorder(stop_after=2), Recorder()
    train(config, 5, whole, tmp_path / "whole", report_interval=0.0)
    train(config, 5, first, tmp_path / "first", report_interval=0.0)
    train(config, 5, second, tmp_path / "second", resume=first.checkpoints[-1][1], report_interval=0.0)
    assert learned(first.rows + second.rows) == learned(whole.rows)
    manifest = read_manifest(whole.checkpoints[-1][1])
    assert len(manifest.observation.numbers) == 48
    assert manifest.evaluation is not None
    assert manifest.evaluation.suite == "simple-3-pedestrian-0.33m-200"


@pytest.mark.parametrize("updates", [3, 4])
def test_stopped_and_resumed_equals_uninterrupted(whole: Recorder, tmp_path: Path, updates: int) -> None:
    first = Recorder(stop_after=updates)
    assert train(TINY, 5, first, tmp_path / "first", report_interval=0.0) == "stopped"
    step, archive, _ = first.checkpoints[-1]
    assert step == 512 * updates
    second = Recorder()
    assert train(TINY, 5, second, tmp_path / "second", resume=archive, report_interval=0.0) == "completed"

    assert learned(first.rows + second.rows) == learned(whole.rows)
    interrupted, uninterrupted = (read_checkpoint(r.checkpoints[-1][1]) for r in (second, whole))
    for some, others in ((interrupted.weights, uninterrupted.weights), (interrupted.arrays, uninterrupted.arrays)):
        assert some.keys() == others.keys()
        for name in some:
            np.testing.assert_array_equal(some[name], others[name], err_msg=name)
    mine, theirs = interrupted.counters, uninterrupted.counters
    assert mine.effort is not None
    assert theirs.effort is not None
    assert mine.effort.episodes == theirs.effort.episodes
    assert mine.model_copy(update={"effort": None}) == theirs.model_copy(update={"effort": None})


@pytest.mark.parametrize("algorithm", [DdpgConfig, Td3Config, SacConfig])
def test_off_policy_training_resumes_exactly(
    tmp_path: Path, algorithm: type[DdpgConfig] | type[Td3Config] | type[SacConfig]
) -> None:
    """Stopped among warm actions with a memory that has gone round."""
    learner = algorithm(
        network=MlpNetwork(hidden_sizes=(16,)), robots=50, batch_size=32, warmup_steps=500, replay_size=1_000
    )
    config = TINY.model_copy(update={"algorithm": learner, "steps": 2_000})
    whole, first, second = Recorder(), Recorder(stop_after=27), Recorder()
    train(config, 1, whole, tmp_path / "whole", report_interval=0.0)
    assert train(config, 1, first, tmp_path / "first", report_interval=0.0) == "stopped"
    train(config, 1, second, tmp_path / "second", resume=first.checkpoints[-1][1], report_interval=0.0)
    assert learned(first.rows + second.rows) == learned(whole.rows)
    mine, theirs = (read_checkpoint(recorder.checkpoints[-1][1]).arrays for recorder in (second, whole))
    assert mine.keys() == theirs.keys()
    for name in mine:
        np.testing.assert_array_equal(mine[name], theirs[name], err_msg=name)


def test_stop_before_the_first_update_still_leaves_a_checkpoint(tmp_path: Path) -> None:
    recorder = Recorder(stop_after=0)
    recorder.rows.append((0, {}))
    assert train(TINY, 5, recorder, tmp_path) == "stopped"
    assert read_manifest(recorder.checkpoints[0][1]).step == 0


def test_finished_training_can_be_prolonged(whole: Recorder, tmp_path: Path) -> None:
    recorder = Recorder()
    longer = TINY.model_copy(update={"steps": 5_000})
    assert train(longer, 5, recorder, tmp_path, resume=whole.checkpoints[-1][1], report_interval=0.0) == "completed"
    assert [step for step, _ in recorder.rows] == [4608, 5120]


def test_checkpoint_of_another_training_is_refused(whole: Recorder, tmp_path: Path) -> None:
    other = TINY.model_copy(update={"task": TaskConfig(observation=ObservationConfig.preset("paper"))})
    for config, seed in ((other, 5), (TINY, 6)):
        with pytest.raises(ArchiveMismatchError, match="its own configuration"):
            train(config, seed, Recorder(), tmp_path, resume=whole.checkpoints[-1][1])


def test_nan_ends_the_training_with_advice(tmp_path: Path) -> None:
    exploding = TINY.model_copy(update={"algorithm": TINY.algorithm.model_copy(update={"learning_rate": float("inf")})})
    recorder = Recorder()
    with pytest.raises(NonFiniteError, match="lower the learning rate"):
        train(exploding, 5, recorder, tmp_path)
    # The state before it, from which it can be repeated.
    assert [step for step, _, _ in recorder.checkpoints] == [0]
    assert recorder.rows[-1][1]["policy/finite"] == 0.0


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_default_training_reaches_the_target_every_time(tmp_path: Path, seed: int) -> None:
    """The defaults of the form, on the simple arena."""
    recorder = Recorder()
    train(TrainingConfig(), seed, recorder, tmp_path)
    _, archive, evaluation = recorder.checkpoints[-1]
    assert evaluation is not None
    assert evaluation.success_rate >= 0.99
    assert evaluation_metrics(evaluation, 0.2)["eval/steps"] < 110
    _, policy = read_policy(archive)
    assert sum(weights.size for weights in policy.weights.values()) > 1000


def test_training_uses_one_thread(whole: Recorder) -> None:
    assert whole.rows
    assert torch.get_num_threads() == 1


def test_evaluation_metrics_by_hand() -> None:
    def episode(outcome: str, steps: int, reward: float, path: float, shortest: float) -> EpisodeResult:
        return EpisodeResult.model_validate(
            {
                "outcome": outcome,
                "steps": steps,
                "reward": reward,
                "path_length": path,
                "shortest_path": shortest,
                "min_clearance": 0.3,
            }
        )

    result = EvaluationResult(
        suite="s",
        suite_hash="h",
        episodes=(
            episode("arrival", 100, 1500.0, 4.0, 3.0),
            episode("arrival", 50, 1000.0, 2.0, 2.0),
            episode("collision", 30, -80.0, 1.0, 2.0),
            episode("timeout", 20, 80.0, 1.0, 2.0),
        ),
    )
    assert evaluation_metrics(result, arrival_distance=0.2) == pytest.approx(
        {
            "eval/success_rate": 0.5,
            "eval/collision_rate": 0.25,
            "eval/timeout_rate": 0.25,
            "eval/return": 625.0,
            "eval/reward": 2500.0 / 200,
            "eval/steps": 75.0,
            # Paths end at the arrival circle: 2.8 m of 4.0 m, and 1.8 m of 2.0 m.
            "eval/path_efficiency": (0.7 + 0.9) / 2,
        }
    )
    nothing = EvaluationResult(suite="s", suite_hash="h", episodes=result.episodes[2:])
    assert "eval/steps" not in evaluation_metrics(nothing, 0.2)


def test_reports_tell_means_over_updates() -> None:
    metrics = TrainingMetrics(robots=4)
    assert metrics.empty
    metrics.update({"loss/value": 1.0})
    metrics.update({"loss/value": 2.0})
    assert metrics.flush()["loss/value"] == 1.5
    assert metrics.empty


def test_drives_are_reported_once_at_the_end_and_checkpoints_only_where_asked_for(tmp_path: Path) -> None:
    evaluation = EvaluationConfig(every_steps=1_000, evaluations_per_checkpoint=2, drives=2, drive_steps=500)
    recorder = Recorder()
    assert train(TINY.model_copy(update={"evaluation": evaluation}), 5, recorder, tmp_path) == "completed"
    assert [step for step, values in recorder.rows if "eval/success_rate" in values] == [1_024, 2_048, 3_072, 4_096]
    assert [step for step, _, _ in recorder.checkpoints] == [2_048, 4_096]
    (measured,) = [(step, TableRow.from_metrics(values)) for step, values in recorder.rows if "table/steps" in values]
    assert measured[0] == 4_096
    assert measured[1] is not None
    assert measured[1].episodes * measured[1].steps == pytest.approx(500)


def test_seeds_train_on_maps_of_their_own_and_the_view_draws_these(tmp_path: Path) -> None:
    pool = GeneratedArenaConfig(name="rooms", maps=2)
    for own in (True, False):
        task = TaskConfig(arena=pool.model_copy(update={"own_maps": own}))
        config = TrainingConfig(task=task, algorithm=PpoConfig(robots=16, rollout_steps=8, minibatch_size=64), steps=1_000)
        first, second = (Training(config, seed, Recorder(), tmp_path, Unwatched(), 0.2).env.arenas for seed in (1, 2))
        assert (first[0].boxes.tolist() == second[0].boxes.tolist()) != own
        drawn = build_arena(with_maps_of(task, 1).arena, 0)
        assert drawn.boxes.tolist() == first[0].boxes.tolist()


def retold(whole: Recorder, path: Path, device: str) -> Path:
    """The last archive of a training on the CPU, as one that says to be of another device."""
    checkpoint = read_checkpoint(whole.checkpoints[-1][1])
    training = checkpoint.manifest.training.model_copy(update={"device": device})
    write_checkpoint(path, replace(checkpoint, manifest=checkpoint.manifest.model_copy(update={"training": training})))
    return path


def test_a_checkpoint_names_the_device_that_it_was_trained_on(tmp_path: Path) -> None:
    recorder = Recorder()
    anywhere = TINY.model_copy(update={"device": "auto", "steps": 1_000})
    train(anywhere, 5, recorder, tmp_path, report_interval=0.0)
    told = read_manifest(recorder.checkpoints[-1][1]).training.device
    assert told == ("cuda" if torch.cuda.is_available() else "cpu")


def test_a_training_goes_on_where_it_began_and_nowhere_else(whole: Recorder, tmp_path: Path) -> None:
    elsewhere = retold(whole, tmp_path / "cuda.zip", "cuda")
    with pytest.raises(ArchiveMismatchError, match="was trained on cuda, whose random numbers cpu does not have"):
        train(TINY, 5, Recorder(), tmp_path, resume=elsewhere)
    if not torch.cuda.is_available():
        with pytest.raises(NoDeviceError, match="This machine has no CUDA device"):
            train(TINY.model_copy(update={"device": "auto"}), 5, Recorder(), tmp_path, resume=elsewhere)
    # Earlier versions wrote what was asked for; whose random states an archive holds tells where it was trained.
    undecided = retold(whole, tmp_path / "auto.zip", "auto")
    assert train(TINY, 5, Recorder(), tmp_path, resume=undecided) == "completed"

"""Each diagnosis fires on a training that is broken on purpose, and all are silent on healthy ones."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from workers.config import TrainingConfig
from workers.diagnoses import Diagnosis, History, Series, diagnose
from workers.diagnoses.learning import largest_value
from workers.errors import NonFiniteError
from workers.frames import Frame
from workers.reporting import EvaluationResult, EventLevel, WatchRequest
from workers.training.trainer import train

SMALL_PPO = {
    "name": "ppo",
    "robots": 32,
    "rollout_steps": 16,
    "minibatch_size": 128,
    "epochs": 4,
    "learning_rate_schedule": "constant",
}
SMALL_DDPG = {
    "name": "ddpg",
    "robots": 16,
    "updates_per_step": 2,
    "batch_size": 64,
    "warmup_steps": 500,
    "replay_size": 20_000,
    "network": {"name": "mlp", "hidden_sizes": [32, 32]},
}


class Recorder:
    """A reporter that keeps the curves and the checkpoints, and asks to stop after some steps."""

    watch: WatchRequest | None = None

    def __init__(self, stop_after: int) -> None:
        self.rows: list[tuple[int, dict[str, float]]] = []
        self.archives: list[Path] = []
        self._stop_after = stop_after

    @property
    def stop_requested(self) -> bool:
        return bool(self.rows) and self.rows[-1][0] >= self._stop_after

    def metrics(self, step: int, values: Mapping[str, float]) -> None:
        self.rows.append((step, dict(values)))

    def event(self, step: int, level: EventLevel, message: str) -> None:
        pass

    def checkpoint(self, step: int, archive: Path, evaluation: EvaluationResult | None) -> None:
        self.archives.append(archive)

    def frames(self, frames: Sequence[Frame]) -> None:
        pass


def history_of(training: TrainingConfig, rows: Sequence[tuple[int, Mapping[str, float]]]) -> History:
    names = sorted({name for _, values in rows for name in values})
    columns = {name: [(step, values[name]) for step, values in rows if name in values] for name in names}
    return History(
        training,
        {
            name: Series(np.array([step for step, _ in points]), np.array([value for _, value in points], np.float64))
            for name, points in columns.items()
        },
    )


def run(changes: dict[str, Any], directory: Path, *, stop_after: int, seed: int = 0) -> tuple[TrainingConfig, Recorder]:
    training = TrainingConfig.model_validate({"steps": 2 * stop_after, **changes})
    recorder = Recorder(stop_after)
    train(training, seed, recorder, directory, report_interval=0.0)
    return training, recorder


def found(diagnoses: Sequence[Diagnosis]) -> dict[str, Diagnosis]:
    return {diagnosis.id: diagnosis for diagnosis in diagnoses}


@pytest.mark.parametrize("seed", [0, 1, 2])
def test_healthy_default_trainings_are_left_alone(seed: int, tmp_path: Path) -> None:
    training, recorder = run({"steps": 90_000}, tmp_path, stop_after=80_000, seed=seed)
    for rows in range(1, len(recorder.rows) + 1):
        assert diagnose(history_of(training, recorder.rows[:rows])) == ()
    assert history_of(training, recorder.rows).success > 0.9


@pytest.mark.parametrize(
    ("identifier", "stop_after", "changes"),
    [
        ("constant_observations", 10_000, {"task": {"lidar": {"range": 0.21}}, "algorithm": SMALL_PPO}),
        ("kl_exploded", 10_000, {"algorithm": {**SMALL_PPO, "learning_rate": 0.1}}),
        (
            "entropy_collapsed",
            10_000,
            {"algorithm": {**SMALL_PPO, "initial_std_linear": 0.011, "initial_std_angular": 0.011}},
        ),
        ("actions_saturate", 12_000, {"algorithm": {**SMALL_DDPG, "actor_learning_rate": 0.1, "logit_penalty": 0.0}}),
        ("spins", 12_000, {"algorithm": {**SMALL_DDPG, "actor_learning_rate": 0.1, "logit_penalty": 0.0}}),
        # A target that moves with what learns from it, and steps too large: the deadly triad with nothing against it.
        (
            "value_diverges",
            3_000,
            {
                "algorithm": {
                    **SMALL_DDPG,
                    "critic_learning_rate": 0.1,
                    "gamma": 0.99,
                    "tau": 1.0,
                    "network": {"name": "resblock"},
                }
            },
        ),
        (
            "success_stuck",
            40_000,
            {"task": {"reward": {"progress": 0.0, "arrival": 0.0, "collision": 0.0}}, "algorithm": SMALL_PPO},
        ),
        (
            "reward_hacked",
            80_000,
            {
                "task": {"reward": {"progress": -500.0, "collision": 0.0}},
                "algorithm": {**SMALL_PPO, "robots": 128, "minibatch_size": 512, "learning_rate": 1e-3},
            },
        ),
    ],
)
def test_a_broken_training_is_diagnosed(identifier: str, stop_after: int, changes: dict[str, Any], tmp_path: Path) -> None:
    # What breaks trainings makes them chaotic: by which seed, differs from one kind of processor to another.
    for seed in range(5):
        training, recorder = run(changes, tmp_path / str(seed), stop_after=stop_after, seed=seed)
        diagnoses = found(diagnose(history_of(training, recorder.rows)))
        if identifier in diagnoses:
            break
    diagnosis = diagnoses[identifier]
    assert diagnosis.evidence
    assert diagnosis.advice
    assert all(evidence.value is not None for evidence in diagnosis.evidence)
    assert diagnosis.step == recorder.rows[-1][0]


def test_nan_is_diagnosed_and_its_checkpoint_repeats_it(tmp_path: Path) -> None:
    # Beyond float32: the reward is infinite, and its returns are no numbers.
    training = TrainingConfig.model_validate(
        {"task": {"reward": {"progress": 1e300}}, "algorithm": SMALL_PPO, "steps": 5_000}
    )
    first, second = Recorder(5_000), Recorder(5_000)
    with np.errstate(all="ignore"):
        with pytest.raises(NonFiniteError, match=r"at step 512.* of step 0 repeats it"):
            train(training, 0, first, tmp_path / "first", report_interval=0.0)
        with pytest.raises(NonFiniteError, match="at step 512"):
            train(training, 0, second, tmp_path / "second", resume=first.archives[-1], report_interval=0.0)
    (diagnosis,) = diagnose(history_of(training, first.rows))
    assert diagnosis.id == "not_finite"
    assert diagnosis.evidence[0].metric == "policy/finite"
    timeless = [
        {name: value for name, value in recorder.rows[-1][1].items() if not name.startswith("time/")}
        for recorder in (first, second)
    ]
    np.testing.assert_equal(timeless[0], timeless[1])


def constant(value: float, points: int = 40) -> list[float]:
    return [value] * points


def drawn(training: dict[str, Any], **curves: Sequence[float] | NDArray[np.float64]) -> tuple[Diagnosis, ...]:
    """Diagnoses of curves with equally distant points over the whole training; '__' stands for '/'."""
    config = TrainingConfig.model_validate({"steps": 100_000, **training})
    series = {
        name.replace("__", "/"): Series(np.linspace(0, 100_000, len(values)).astype(np.int64), np.array(values, np.float64))
        for name, values in curves.items()
    }
    return diagnose(History(config, series))


def test_a_critic_that_gets_worse_is_diagnosed() -> None:
    loss = [0.3, 0.1, *np.geomspace(0.1, 50.0, 38)]
    explained = [0.0, 0.6, *np.linspace(0.6, -3.0, 38)]
    (diagnosis,) = drawn({}, loss__value=loss, value__explained_variance=explained)
    assert diagnosis.id == "value_diverges"
    assert {evidence.metric for evidence in diagnosis.evidence} == {"loss/value", "value/explained_variance"}
    # A loss that grows with the returns, while the critic still explains them, is no divergence.
    assert drawn({}, loss__value=loss, value__explained_variance=constant(0.7)) == ()


def test_values_that_no_policy_can_earn_are_diagnosed() -> None:
    ddpg = {"algorithm": {"name": "ddpg"}}
    # 500 per metre x 0.25 m/s x 0.2 s = 25 a step is less than the 120 of an arrival: 120 x 0.01 / (1 - 0.97) = 40.
    assert largest_value(TrainingConfig.model_validate(ddpg)) == pytest.approx(40.0)
    (diagnosis,) = drawn(ddpg, value__mean=np.geomspace(0.1, 1e4, 40))
    assert diagnosis.id == "value_diverges"
    assert drawn(ddpg, value__mean=np.linspace(0.0, 15.0, 40)) == ()


def test_a_robot_that_arrives_may_drive_as_it_likes() -> None:
    odd = {"train__spin": constant(0.9), "policy__saturation": constant(0.9), "policy__entropy": constant(-6.0)}
    assert drawn({}, train__success_rate=constant(0.95), **odd) == ()
    found_ids = {diagnosis.id for diagnosis in drawn({}, train__success_rate=constant(0.1), **odd)}
    assert {"spins", "actions_saturate", "entropy_collapsed"} <= found_ids


def test_what_is_over_is_forgotten() -> None:
    assert drawn({}, policy__kl=[*constant(0.2, 20), *constant(0.01, 60)]) == ()
    assert [diagnosis.id for diagnosis in drawn({}, policy__kl=[*constant(0.01, 60), *constant(0.2, 20)])] == ["kl_exploded"]


def test_a_plateau_is_stuck_only_where_there_is_room_above() -> None:
    for level, ids in ((0.4, ["success_stuck"]), (0.9, [])):
        evaluations = [0.1, 0.3, level, level, level, level]
        assert [diagnosis.id for diagnosis in drawn({}, eval__success_rate=evaluations)] == ids
    assert drawn({}, eval__success_rate=[0.1, 0.2, 0.3, 0.4, 0.5, 0.6]) == ()


def test_nothing_is_said_of_a_run_that_has_not_begun() -> None:
    assert diagnose(History(TrainingConfig(), {})) == ()
    assert drawn({}, policy__kl=[0.9], train__spin=[1.0]) == ()

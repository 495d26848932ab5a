"""Fine-tuning: a training that begins with the policy of another one, what it takes over, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from typer.testing import CliRunner

from sim.config import ArenaConfig, JackalConfig, ObservationConfig, OmnidirectionalDrive, RewardConfig, TaskConfig
from tests.workers.test_trainer import TINY, Recorder, learned
from workers.checkpoints import copy_policy, read_checkpoint, read_manifest, sha256_of, write_checkpoint
from workers.cli import app
from workers.config import DdpgConfig, GruNetwork, MlpNetwork, PpoConfig, SacConfig, Td3Config, TrainingConfig
from workers.errors import ArchiveError, ArchiveIntegrityError, ArchiveMismatchError
from workers.extending.learning import Inputs, Learner, Setting
from workers.misfit import misfit
from workers.shipped.library import shipped_policy
from workers.start import StartFrom
from workers.training.trainer import train

NETWORK = MlpNetwork(hidden_sizes=(16,))
OFF_POLICY = {"network": NETWORK, "robots": 16, "updates_per_step": 1, "warmup_steps": 256, "replay_size": 2_000}
GRU = GruNetwork(units=8, sequence_length=8)
RECURRENT = PpoConfig(network=GRU, robots=32, rollout_steps=16, minibatch_size=128, epochs=1)
SAC, TD3, DDPG = SacConfig(**OFF_POLICY), Td3Config(**OFF_POLICY), DdpgConfig(**OFF_POLICY)


def run(config: TrainingConfig, folder: Path, *, start: Path | None = None, seed: int = 5) -> Recorder:
    recorder = Recorder()
    assert train(config, seed, recorder, folder, start=start, report_interval=0.0) == "completed"
    return recorder


def from_archive(config: TrainingConfig, archive: Path) -> TrainingConfig:
    with archive.open("rb") as file:
        start = StartFrom(source="file", name=archive.name, sha256=sha256_of(file), title="The parent")
    return config.model_copy(update={"start_from": start})


@pytest.fixture(scope="module")
def parent(tmp_path_factory: pytest.TempPathFactory) -> Recorder:
    return run(TINY, tmp_path_factory.mktemp("parent"))


@pytest.mark.parametrize(
    "algorithm", [TINY.algorithm, RECURRENT, DDPG, TD3, SAC], ids=lambda one: f"{one.name}-{one.network.name}"
)
def test_the_policy_at_step_0_is_the_parents_and_does_as_it_did(algorithm: PpoConfig, tmp_path: Path) -> None:
    config = TINY.model_copy(update={"algorithm": algorithm, "steps": 1_024})
    _, archive, evaluation = run(config, tmp_path / "parent").checkpoints[-1]
    child = run(from_archive(config, archive), tmp_path / "child", start=archive, seed=9)
    step, own, measured = child.checkpoints[0]
    assert step == 0
    theirs, ours = read_checkpoint(archive), read_checkpoint(own)
    assert theirs.weights.keys() == ours.weights.keys()
    for name, array in theirs.weights.items():
        np.testing.assert_array_equal(ours.weights[name], array)
    assert measured == evaluation
    assert child.rows[0][0] == 0
    assert "eval/success_rate" in child.rows[0][1]


def test_of_the_same_algorithm_the_critic_and_the_scale_of_returns_come_along_and_nothing_else(
    parent: Recorder, tmp_path: Path
) -> None:
    _, archive, _ = parent.checkpoints[-1]
    child = run(from_archive(TINY, archive), tmp_path, start=archive, seed=9)
    assert child.events[0] == "Starts from The parent: its policy and critic and scale of returns."
    theirs, ours = (read_checkpoint(path).arrays for path in (archive, child.checkpoints[0][1]))
    values = ours["algorithm/optimizer/values"]
    assert isinstance(TINY.algorithm, PpoConfig)
    initial = np.log([TINY.algorithm.initial_std_linear, TINY.algorithm.initial_std_angular])
    differing = np.flatnonzero(values != theirs["algorithm/optimizer/values"])
    np.testing.assert_allclose(
        np.asarray(values[differing], np.float32), initial, rtol=1e-6
    )  # exploration begins as configured
    assert not ours["algorithm/optimizer/mean"].any()
    assert not ours["algorithm/optimizer/square"].any()
    assert ours["algorithm/optimizer/steps"] == 0
    moments = [arrays["algorithm/scaler/moments"] for arrays in (ours, theirs)]
    np.testing.assert_array_equal(moments[0][1:], moments[1][1:])
    assert moments[0][0] == TINY.algorithm.robots * TINY.algorithm.rollout_steps  # one rollout, that others soon outweigh
    assert not ours["algorithm/scaler/returns"].any()
    assert (ours["algorithm/generator"] != theirs["algorithm/generator"]).any()  # its own seed's


def test_slow_copies_begin_as_copies_and_the_memory_empty(tmp_path: Path) -> None:
    config = TINY.model_copy(update={"algorithm": SAC, "steps": 1_024})
    _, archive, _ = run(config, tmp_path / "parent").checkpoints[-1]
    child = run(from_archive(config, archive), tmp_path / "child", start=archive)
    theirs, ours = (read_checkpoint(path).arrays for path in (archive, child.checkpoints[0][1]))
    for network in ("actor", "critic"):
        np.testing.assert_array_equal(ours[f"algorithm/{network}/values"], theirs[f"algorithm/{network}/values"])
    np.testing.assert_array_equal(ours["algorithm/target_critic"], theirs["algorithm/critic/values"])
    assert ours["algorithm/temperature/values"] == np.float32(np.log(SAC.initial_temperature))
    assert ours["algorithm/steps"] == 0


@pytest.mark.parametrize("algorithm", [SAC, TD3], ids=lambda one: one.name)
def test_another_algorithm_takes_over_the_policy_alone(parent: Recorder, algorithm: SacConfig, tmp_path: Path) -> None:
    _, archive, _ = parent.checkpoints[-1]
    config = from_archive(TINY.model_copy(update={"algorithm": algorithm, "steps": 1_024}), archive)
    child = run(config, tmp_path, start=archive)
    assert child.events[0] == "Starts from The parent: its policy."
    theirs, ours = (read_checkpoint(path).weights for path in (archive, child.checkpoints[0][1]))
    for name, array in theirs.items():
        np.testing.assert_array_equal(ours[name], array)


def test_a_policy_without_its_training_s_state_is_enough(parent: Recorder, tmp_path: Path) -> None:
    copy_policy(parent.checkpoints[-1][1], tmp_path / "policy.zip")
    child = run(from_archive(TINY, tmp_path / "policy.zip"), tmp_path, start=tmp_path / "policy.zip")
    assert child.events[0] == "Starts from The parent: its policy."


def test_it_goes_on_bit_for_bit_from_its_own_checkpoints_without_the_parent(parent: Recorder, tmp_path: Path) -> None:
    _, archive, _ = parent.checkpoints[-1]
    config = from_archive(TINY, archive)
    whole = run(config, tmp_path / "whole", start=archive)
    for step, own, _ in whole.checkpoints[:2]:
        again = Recorder()
        train(config, 5, again, tmp_path / f"from-{step}", resume=own, report_interval=0.0)
        assert learned(again.rows) == learned([row for row in whole.rows if row[0] > step])
        assert read_manifest(again.checkpoints[-1][1]).training.start_from == config.start_from


def test_a_shipped_policy_does_at_step_0_what_its_card_says(tmp_path: Path) -> None:
    shipped = shipped_policy("simple")
    config = shipped.card.training.model_copy(update={"steps": 1_000})
    child = run(from_archive(config, shipped.archive), tmp_path, start=shipped.archive)
    assert child.rows[0][1]["eval/success_rate"] == pytest.approx(shipped.card.results[0].figures.arrivals / 200, abs=0.02)


TASK = TaskConfig()
FITTING: dict[str, dict[str, object]] = {
    "another arena": {"task": TASK.model_copy(update={"arena": ArenaConfig(name="complex")})},
    "another robot of the same drive": {"task": TASK.model_copy(update={"robot": JackalConfig()})},
    "another reward": {"task": TASK.model_copy(update={"reward": RewardConfig.preset("clearance")})},
    "another algorithm": {"algorithm": SacConfig(network=MlpNetwork())},
}
MISFITS: dict[str, tuple[dict[str, object], str]] = {
    "observation": (
        {"task": TASK.model_copy(update={"observation": ObservationConfig.preset("paper")})},
        "its observation is improved of",
    ),
    "drive": (
        {"task": TASK.model_copy(update={"robot": JackalConfig(drive=OmnidirectionalDrive())})},
        "its actions are linear from 0 to 1, angular from -1 to 1, and this one's linear",
    ),
    "network": (
        {"algorithm": PpoConfig(network=MlpNetwork(hidden_sizes=(32, 32)))},
        "its network is mlp (hidden_sizes [64, 64], activation relu), and this one's mlp (hidden_sizes [32, 32], ",
    ),
}


@pytest.mark.parametrize("name", FITTING)
def test_what_a_policy_drives_may_change(name: str) -> None:
    assert misfit(TrainingConfig(), TrainingConfig().model_copy(update=FITTING[name])) is None


@pytest.mark.parametrize("name", MISFITS)
def test_what_it_sees_does_and_is_may_not_and_the_difference_is_named(name: str) -> None:
    changes, sentence = MISFITS[name]
    found = misfit(TrainingConfig(), TrainingConfig().model_copy(update=changes))
    assert found is not None
    assert sentence in found


def test_longer_sequences_of_the_same_memory_fit() -> None:
    longer = RECURRENT.model_copy(update={"network": GRU.model_copy(update={"sequence_length": 16})})
    assert misfit(TrainingConfig(algorithm=RECURRENT), TrainingConfig(algorithm=longer)) is None


def test_another_archive_than_the_one_that_was_meant_is_refused(parent: Recorder, tmp_path: Path) -> None:
    config = from_archive(TINY, parent.checkpoints[-1][1])
    with pytest.raises(ArchiveMismatchError, match="is not the archive of The parent"):
        train(config, 5, Recorder(), tmp_path, start=parent.checkpoints[0][1])
    with pytest.raises(ArchiveMismatchError, match="bring its archive along"):
        train(config, 5, Recorder(), tmp_path)


def test_a_policy_that_does_not_fit_is_refused_before_anything_is_learned(parent: Recorder, tmp_path: Path) -> None:
    _, archive, _ = parent.checkpoints[-1]
    other = TINY.model_copy(update={"algorithm": PpoConfig(network=MlpNetwork(hidden_sizes=(8,)))})
    with pytest.raises(ArchiveMismatchError, match="The parent does not fit this training: its network is mlp"):
        train(from_archive(other, archive), 5, Recorder(), tmp_path, start=archive)


def test_a_damaged_archive_is_refused(parent: Recorder, tmp_path: Path) -> None:
    damaged = tmp_path / "damaged.zip"
    data = bytearray(parent.checkpoints[-1][1].read_bytes())
    data[data.index(b"policy.safetensors") + 400] ^= 1
    damaged.write_bytes(data)
    with pytest.raises(ArchiveError):
        train(from_archive(TINY, damaged), 5, Recorder(), tmp_path, start=damaged)


def test_weights_of_another_shape_than_their_manifest_says_are_refused(parent: Recorder, tmp_path: Path) -> None:
    checkpoint = read_checkpoint(parent.checkpoints[-1][1])
    first, *_ = checkpoint.weights
    checkpoint.weights[first] = checkpoint.weights[first][:-1]
    write_checkpoint(tmp_path / "cut.zip", checkpoint)
    with pytest.raises(ArchiveIntegrityError):
        train(from_archive(TINY, tmp_path / "cut.zip"), 5, Recorder(), tmp_path, start=tmp_path / "cut.zip")


def test_on_the_command_line_an_archive_or_the_name_of_a_shipped_policy(parent: Recorder, tmp_path: Path) -> None:
    arguments = ["train", "--steps", "1000", "--out", str(tmp_path)]
    assert CliRunner().invoke(app, [*arguments, "--start-from", "nobody"]).exit_code == 2
    refused = CliRunner().invoke(app, [*arguments, "--start-from", str(parent.checkpoints[0][1])])
    assert "does not fit this training" in " ".join(refused.output.split())
    done = CliRunner().invoke(app, [*arguments, "--start-from", "simple"])
    assert done.exit_code == 0, done.output
    start = read_manifest(tmp_path / "step-0.zip").training.start_from
    assert start is not None
    assert (start.source, start.name) == ("shipped", "simple")
    assert start.sha256 is not None


class Distilled(Learner):
    """As much of an extension's algorithm as its weights are: an actor, a critic, and one of another size if asked for."""

    def __init__(self, seed: int, units: int = 16) -> None:
        setting = Setting(4, Inputs(5), MlpNetwork(hidden_sizes=(units,)), seed, torch.device("cpu"))
        self.actor, self.critic = setting.build_actor(0.3), setting.build_network(1, number=1)
        modules = {"actor": self.actor, "critic": self.critic, "judge": setting.build_network(2 + seed, number=2)}
        optimizers = {"actor": torch.optim.Adam(self.actor.parameters())}
        generator = setting.generator()
        super().__init__(
            setting,
            policy=self.actor.network,
            modules=modules,
            optimizers=optimizers,
            generator=generator,
            steps_per_update=8,
        )

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        raise NotImplementedError

    def record(self, *_: object) -> None:
        raise NotImplementedError

    def update(self, progress: float) -> dict[str, float]:
        raise NotImplementedError


def test_an_extensions_algorithm_takes_over_the_modules_of_the_same_shape() -> None:
    theirs, ours = Distilled(seed=0), Distilled(seed=1)
    with torch.no_grad():
        theirs.actor.log_std.add_(1.0)
    initial = ours.actor.log_std.clone()
    assert ours.begin_with(theirs.policy_weights(), theirs.state()) == ("critic",)
    for name, array in theirs.policy_weights().items():
        np.testing.assert_array_equal(ours.policy_weights()[name], array)
    for own, parent in zip(ours.critic.parameters(), theirs.critic.parameters(), strict=True):
        torch.testing.assert_close(own, parent, rtol=0, atol=0)
    torch.testing.assert_close(ours.actor.log_std, initial, rtol=0, atol=0)  # exploration begins as configured
    assert Distilled(seed=1).begin_with(theirs.policy_weights(), None) == ()

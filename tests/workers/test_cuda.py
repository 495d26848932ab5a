"""Trainings on a CUDA device: the same bits twice, go on where they stopped, and leave policies that any CPU drives."""

from pathlib import Path

import numpy as np
import pytest
import torch

from tests.workers.test_trainer import TINY, Recorder
from workers.algorithms import build_algorithm
from workers.algorithms.ppo import Ppo
from workers.checkpoints import read_checkpoint, read_policy
from workers.config import (
    Algorithm,
    ConvNetwork,
    DdpgConfig,
    GruNetwork,
    MlpNetwork,
    Network,
    PpoConfig,
    ResBlockNetwork,
    SacConfig,
    Td3Config,
    TrainingConfig,
)
from workers.live.viewing import Unwatched
from workers.networks.inputs import inputs_of
from workers.policy import torch_policy
from workers.training.trainer import Training, train

pytestmark = pytest.mark.skipif(not torch.cuda.is_available(), reason="no CUDA device here")


def ppo(network: Network) -> PpoConfig:
    return PpoConfig(network=network, robots=32, rollout_steps=16, minibatch_size=128, epochs=2)


def off_policy(kind: type[DdpgConfig] | type[Td3Config] | type[SacConfig]) -> Algorithm:
    return kind(network=MlpNetwork(hidden_sizes=(16,)), robots=64, batch_size=32, warmup_steps=512, replay_size=1_024)


ALGORITHMS = {
    "ppo mlp": ppo(MlpNetwork(hidden_sizes=(16,))),
    "ppo resblock": ppo(ResBlockNetwork()),
    "ppo conv": ppo(ConvNetwork()),
    "ppo gru": ppo(GruNetwork()),
    "ppo told the way": ppo(MlpNetwork(hidden_sizes=(16,))).model_copy(update={"critic_sees": "path"}),
    "ddpg": off_policy(DdpgConfig),
    "td3": off_policy(Td3Config),
    "sac": off_policy(SacConfig),
}


@pytest.fixture(params=list(ALGORITHMS.values()), ids=list(ALGORITHMS))
def config(request: pytest.FixtureRequest) -> TrainingConfig:
    return TINY.model_copy(update={"algorithm": request.param, "device": "cuda", "steps": 4_096})


def test_a_training_on_cuda_ends_at_the_same_bits_twice_and_when_it_is_stopped_and_resumed(
    config: TrainingConfig, tmp_path: Path
) -> None:
    whole, again, first, second = Recorder(), Recorder(), Recorder(stop_after=3), Recorder()
    train(config, 5, whole, tmp_path / "whole", report_interval=0.0)
    train(config, 5, again, tmp_path / "again", report_interval=0.0)
    assert train(config, 5, first, tmp_path / "first", report_interval=0.0) == "stopped"
    train(config, 5, second, tmp_path / "second", resume=first.checkpoints[-1][1], report_interval=0.0)
    ends = [read_checkpoint(recorder.checkpoints[-1][1]) for recorder in (whole, again, second)]
    assert ends[0].manifest.training.device == "cuda"
    for other in ends[1:]:
        for mine, theirs in ((ends[0].weights, other.weights), (ends[0].arrays, other.arrays)):
            assert mine.keys() == theirs.keys()
            for name in mine:
                np.testing.assert_array_equal(mine[name], theirs[name], err_msg=name)


@pytest.mark.parametrize("name", [name for name in ALGORITHMS if name.startswith("ppo")])
def test_a_recorded_graph_learns_what_its_kernels_one_by_one_do(name: str, tmp_path: Path) -> None:
    ends = []
    for graphed in (True, False):
        config = TINY.model_copy(update={"algorithm": ALGORITHMS[name], "device": "cuda"})
        training = Training(config, 3, Recorder(), tmp_path, Unwatched(), 0.0)
        assert isinstance(training.algorithm, Ppo)
        assert training.algorithm.graphed is not None
        if not graphed:
            training.algorithm.graphed = None
        training.collect()
        training.update()
        ends.append(torch.from_numpy(training.algorithm.state()["optimizer/values"]))
    assert torch.allclose(ends[0], ends[1], rtol=0.0, atol=1e-5)


def test_what_a_training_on_cuda_leaves_drives_on_a_cpu(config: TrainingConfig, tmp_path: Path) -> None:
    recorder = Recorder()
    train(config, 5, recorder, tmp_path, report_interval=0.0)
    archive = recorder.checkpoints[-1][1]
    manifest, policy = read_policy(archive)
    observations = np.random.default_rng(0).uniform(-1.0, 1.0, (32, len(manifest.observation.numbers))).astype(np.float32)
    actions = torch_policy(policy)(observations)
    assert np.isfinite(actions).all()


def test_a_training_begins_with_the_same_weights_and_first_steps_on_every_device(config: TrainingConfig) -> None:
    """Random numbers differ from then on."""
    ours, theirs = (
        build_algorithm(config.algorithm, inputs_of(config.task), 3, torch.device(device)) for device in ("cpu", "cuda")
    )
    mine, others = ours.policy_weights(), theirs.policy_weights()
    assert mine.keys() == others.keys()
    for name in mine:
        np.testing.assert_array_equal(mine[name], others[name], err_msg=name)

"""The convolution over the scan and the recurrent network: trained, resumed, driven, taken away, and equal everywhere."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray
from pydantic import ValidationError
from torch.nn import functional

from sim.arenas import build_arenas
from sim.config import ArenaConfig, LidarConfig, ObservationConfig, TaskConfig
from sim.drivers import Driver
from sim.engine.guidance import GUIDANCE_SIZE, Guidance
from sim.engine.paths import Paths, RobotPaths
from tests.workers.test_trainer import Recorder
from workers.algorithms.ppo import build_ppo
from workers.algorithms.recurrent_ppo import RecurrentPpo
from workers.algorithms.storage.rollout import Samples
from workers.checkpoints import read_checkpoint, read_policy
from workers.config import (
    ConvNetwork,
    DdpgConfig,
    EvaluationConfig,
    GruNetwork,
    NetworkConfig,
    PpoConfig,
    SacConfig,
    Td3Config,
    TrainingConfig,
)
from workers.errors import NetworkError
from workers.export.bundle import export_checkpoint
from workers.networks.convolution import convolve
from workers.networks.inputs import Inputs, inputs_of
from workers.networks.modules import Described, build_network
from workers.policy import torch_policy
from workers.training.trainer import train

F = np.float32
CPU = torch.device("cpu")
TASK = TaskConfig(lidar=LidarConfig(rays=60), observation=ObservationConfig.preset("improved", batches=30, frames=2))


@pytest.mark.parametrize("network", [ConvNetwork(), GruNetwork(sequence_length=8)], ids=lambda network: network.name)
def test_trained_resumed_and_exported(network: NetworkConfig, tmp_path: Path) -> None:
    algorithm = PpoConfig(network=network, robots=32, rollout_steps=16, minibatch_size=128, epochs=2)
    config = TrainingConfig(task=TASK, algorithm=algorithm, steps=2_000, evaluation=EvaluationConfig(every_steps=1_000))
    whole, second = Recorder(), Recorder()
    assert train(config, 1, whole, tmp_path, report_interval=0.0) == "completed"
    train(config, 1, second, tmp_path / "second", resume=whole.checkpoints[0][1], report_interval=0.0)
    first, again = (read_checkpoint(recorder.checkpoints[-1][1]).arrays for recorder in (whole, second))
    assert first.keys() == again.keys()
    for name, array in first.items():
        np.testing.assert_array_equal(array, again[name], err_msg=name)

    archive = whole.checkpoints[-1][1]
    exported = export_checkpoint(archive)  # compares ONNX, NumPy runner and torch, memories included
    assert exported.report.policy_difference <= 1e-5
    _, policy = read_policy(archive)
    assert policy.memory_size == (32 if network.recurrent else 0)
    observations = np.random.default_rng(0).random((4, inputs_of(TASK).size), F)
    np.testing.assert_allclose(policy(observations), torch_policy(policy)(observations), rtol=0, atol=1e-6)


def test_the_convolution_is_pytorchs_over_all_ranges_of_all_frames() -> None:
    network = ConvNetwork(channels=(3,), kernel_size=3, stride=1, units=4)
    module = build_network(network, Inputs(14, ((0, 5), (7, 12))), 2)  # two numbers behind each frame's five ranges
    assert isinstance(module, Described)
    x = torch.randn(6, 14)
    weights = module.state_dict()
    scan = torch.stack((x[:, 0:5], x[:, 7:12]), dim=1)
    seen = functional.conv1d(scan, weights["convolutions.0.weight"], weights["convolutions.0.bias"], padding=1).relu()
    joined = torch.cat((seen.flatten(1), x[:, 5:7], x[:, 12:14]), dim=1)
    hidden = functional.linear(joined, weights["hidden.weight"], weights["hidden.bias"]).relu()
    torch.testing.assert_close(module(x), functional.linear(hidden, weights["head.weight"], weights["head.bias"]))


@pytest.mark.parametrize(("length", "stride", "kernel"), [(10, 2, 5), (10, 1, 3), (7, 3, 7), (1, 4, 9), (90, 2, 5)])
def test_a_convolution_as_a_matrix_product_is_pytorchs(length: int, stride: int, kernel: int) -> None:
    x, weight, bias = torch.randn(6, 4, length), torch.randn(3, 4, kernel), torch.randn(3)
    given = [tensor.requires_grad_() for tensor in (x, weight, bias)]
    results = []
    for convolution in (convolve, functional.conv1d):
        y = convolution(x, weight, bias, stride, kernel // 2)
        results.append((y, *torch.autograd.grad(y.square().sum(), given)))
    for ours, theirs in zip(*results, strict=True):
        torch.testing.assert_close(ours, theirs, rtol=1e-4, atol=1e-4)


def test_a_convolution_without_ranges_is_refused() -> None:
    with pytest.raises(NetworkError, match="needs ranges in the observation"):
        build_network(ConvNetwork(), Inputs(6), 2)


def gru(units: int = 8) -> Described:
    torch.manual_seed(0)
    network = build_network(GruNetwork(units=units), 5, 2)
    assert isinstance(network, Described)
    return network


def test_a_step_is_that_of_pytorchs_gru() -> None:
    network, theirs = gru(), torch.nn.GRUCell(8, 8)
    weights = network.state_dict()
    theirs.load_state_dict(
        {
            "weight_ih": weights["input.weight"],
            "bias_ih": weights["input.bias"],
            "weight_hh": weights["memory.weight"],
            "bias_hh": weights["memory.bias"],
        }
    )
    x, memory = torch.randn(7, 5), torch.randn(7, 8)
    seen = functional.linear(x, weights["encoder.weight"], weights["encoder.bias"]).relu()
    torch.testing.assert_close(network(x, memory)[1], theirs(seen, memory))


def test_a_sequence_is_its_steps_and_forgets_where_an_episode_begins() -> None:
    network = gru()
    inputs, before, keep = torch.randn(6, 3, 5), torch.randn(3, 8), torch.ones(6, 3, 1)
    keep[4, 1] = 0.0
    found, memory = network.unroll(inputs, before, keep), before
    for step in range(6):
        output, memory = network(inputs[step], memory * keep[step])
        torch.testing.assert_close(found[step], output)
    torch.testing.assert_close(found[4, 1], network(inputs[4])[1])


def test_the_compiled_sequence_is_that_of_the_formula() -> None:
    """Memory and every derivative, over episodes that begin on the way: as autograd has them of the lines, one by one."""
    network, grad_output = gru(), torch.randn(6, 3, 2)
    inputs, before = torch.randn(6, 3, 5, requires_grad=True), torch.randn(3, 8, requires_grad=True)
    keep = (torch.rand(6, 3, 1) < 0.8).float()
    assert 0.0 in keep

    def differentiate(outputs: torch.Tensor) -> tuple[torch.Tensor, ...]:
        return outputs, *torch.autograd.grad(outputs, [*network.parameters(), inputs, before], grad_output)

    memory, outputs = before, []
    for step in range(6):
        output, memory = network(inputs[step], memory * keep[step])
        outputs.append(output)
    torch.testing.assert_close(differentiate(network.unroll(inputs, before, keep)), differentiate(torch.stack(outputs)))


def drive(ppo: RecurrentPpo, steps: int, seed: int) -> NDArray[np.float32]:
    """So many steps with random ends; all actions."""
    rng, actions = np.random.default_rng(seed), []
    observations = rng.normal(size=(ppo.robots, 5)).astype(F)
    for _ in range(steps):
        actions.append(ppo.act(observations))
        observations = rng.normal(size=(ppo.robots, 5)).astype(F)
        ended = rng.random((2, ppo.robots)) < 0.2
        rewards = rng.normal(size=ppo.robots).astype(F)
        ppo.record(observations, rewards, ended[0], ended[1] & ~ended[0], rng.normal(size=(ppo.robots, 5)).astype(F))
    return np.array(actions)


def recurrent_ppo(**changes: object) -> RecurrentPpo:
    values = {"robots": 6, "rollout_steps": 8, "minibatch_size": 16, "epochs": 1, **changes}
    ppo = build_ppo(
        PpoConfig.model_validate({"network": {"name": "gru", "units": 8, "sequence_length": 4}} | values), 5, 0, CPU
    )
    assert isinstance(ppo, RecurrentPpo)
    return ppo


@pytest.mark.parametrize("critic_sees", ["observation", "path"])
def test_learning_sees_what_acting_saw(critic_sees: str) -> None:
    """Before the first step of an update every ratio is 1, over resets and over the seams of sequences and rollouts."""
    ppo = recurrent_ppo(critic_sees=critic_sees)
    if critic_sees == "path":
        ppo.guidance = Guidance(TaskConfig(), RobotPaths(Paths(build_arenas(ArenaConfig()), 0.2), ppo.robots), ppo.robots)
        ppo.guidance.now[:] = np.random.default_rng(5).random((ppo.robots, GUIDANCE_SIZE))
    drive(ppo, 8, 0)
    ppo.update(0.0)
    drive(ppo, 8, 1)
    storage = ppo.storage
    for rows in ppo.minibatches():
        known = torch.zeros(ppo.robots * 8)
        samples = storage.samples(known, known, known)
        batch = Samples(*(column[rows.flatten()] for column in samples))
        mean, values = ppo._gradients.predict(batch, rows)  # type: ignore[attr-defined]
        noise = storage.noise.flatten(0, 1)[rows.flatten()]
        acted = storage.actions.flatten(0, 1)[rows.flatten()]
        torch.testing.assert_close(mean + noise * ppo.actor.log_std.exp(), acted, rtol=0, atol=1e-6)
        torch.testing.assert_close(values, ppo.values()[:-1].flatten()[rows.flatten()], rtol=0, atol=1e-6)
    assert sorted(torch.cat([rows.flatten() for rows in ppo.minibatches()]).tolist()) == list(range(8 * 6))


def test_memory_is_kept_over_rollouts_and_forgotten_with_an_episode() -> None:
    ppo = recurrent_ppo(robots=4, rollout_steps=4)
    nothing, one = np.zeros(4, np.bool_), np.array([True, False, False, False])
    seen = np.ones((4, 5), F)
    for step in range(4):
        ppo.act(seen)
        ppo.record(seen, np.zeros(4, F), one if step == 3 else nothing, nothing, seen)
    forgotten, kept, *_ = ppo._memories[0]
    assert not forgotten.any()
    assert kept.abs().min() > 0.0


def test_a_policy_at_the_wheel_remembers_each_robot(make_checkpoint: Callable[..., Path]) -> None:
    _, policy = read_policy(make_checkpoint(GruNetwork()))
    rng = np.random.default_rng(0)
    first, second = rng.random((2, 3, 16), F)
    driver = Driver(policy, 3)
    driver(first)
    driver.forget(np.array([False, True, False]))
    actions = driver(second[1:], np.array([1, 2]))
    memory = policy.step(first, np.zeros((3, 32), F))[1]
    # Not to the last bit: a product of two rows may round otherwise than one of a single row.
    np.testing.assert_allclose(actions[0], policy(second[1:2])[0], rtol=0, atol=1e-6)
    np.testing.assert_allclose(actions[1], policy.step(second[2:], memory[2:])[0][0], rtol=0, atol=1e-6)
    assert not np.allclose(actions[1], policy(second[2:])[0])


@pytest.mark.parametrize("algorithm", [DdpgConfig, Td3Config, SacConfig])
def test_algorithms_that_replay_refuse_it_beside_its_field(algorithm: type[DdpgConfig | Td3Config | SacConfig]) -> None:
    with pytest.raises(ValidationError, match="recurrent networks are for PPO") as refused:
        algorithm.model_validate({"network": {"name": "gru"}})
    assert refused.value.errors()[0]["loc"] == ("network",)


def test_a_rollout_is_whole_sequences() -> None:
    with pytest.raises(ValidationError, match="a multiple of its sequences") as refused:
        PpoConfig.model_validate({"network": {"name": "gru", "sequence_length": 12}})
    assert refused.value.errors()[0]["loc"] == ("rollout_steps",)


def test_it_learns_what_only_memory_can() -> None:
    """To turn to the side that was shown three steps before: a policy that remembers nothing has 0 on average, at most 1."""
    network = GruNetwork(units=16, sequence_length=4)
    config = PpoConfig(network=network, robots=64, rollout_steps=16, minibatch_size=256, learning_rate=5e-3, gamma=0.5)
    ppo = build_ppo(config, 1, 3, CPU)
    rng, none, zeros = np.random.default_rng(0), np.zeros(64, np.bool_), np.zeros(64, F)
    for update in range(15):
        rewarded = []
        for _ in range(4):
            side = rng.choice([-1.0, 1.0], 64).astype(F)
            for step in range(4):
                actions = ppo.act((side if step == 0 else zeros)[:, None])
                rewards = np.clip(actions[:, 1], -1.0, 1.0) * side if step == 3 else zeros
                ppo.record(zeros[:, None], rewards, np.full(64, step == 3), none, zeros[:, None])
            rewarded.append(float(rewards.mean()))
        ppo.update(update / 15)
    assert np.mean(rewarded) > 0.5

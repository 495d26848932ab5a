"""The networks are those of the paper's tables, and their written-out backward passes equal autograd's."""

import copy

import numpy as np
import pytest
import torch
from torch import nn

from sim.config import TaskConfig
from tests.heads import head
from workers.algorithms.flat import FlatParameters
from workers.config import ConvNetwork, GruNetwork, MlpNetwork, Network, ResBlockNetwork
from workers.kernels.networks import backward, forward, input_gradient
from workers.networks.compiled import is_compiled, passes_of
from workers.networks.inputs import inputs_of
from workers.networks.modules import GaussianActor, build_network

NETWORKS: list[Network] = [
    ResBlockNetwork(),
    MlpNetwork(hidden_sizes=(64, 64), activation="relu"),
    MlpNetwork(hidden_sizes=(32,), activation="tanh"),
    MlpNetwork(hidden_sizes=(16, 24, 8), activation="tanh"),
]


def count(module: nn.Module) -> int:
    return sum(parameter.numel() for parameter in module.parameters())


def test_resblock_has_the_papers_parameter_counts() -> None:
    assert count(build_network(ResBlockNetwork(), 16, 1)) == 50_289
    actor = GaussianActor(build_network(ResBlockNetwork(), 16, 2), (0.2, 0.4))
    assert count(actor.network) == 50_354
    assert count(actor) == 50_354 + 2  # the two deviations


def test_resblock_without_its_concatenations_is_the_same_layers_one_after_another() -> None:
    """16 to 512 to 16 to 512 to 32 to the head: nothing goes round a layer."""
    network = build_network(ResBlockNetwork(concatenations=False), 16, 1)
    hidden = (16 * 512 + 512) + (512 * 16 + 16) + (16 * 512 + 512) + (512 * 32 + 32)
    assert count(network) == hidden + (32 + 1)
    with torch.no_grad():
        for parameter in network.get_submodule("layer1").parameters():
            parameter.zero_()
    observations = torch.randn(5, 16)
    assert torch.equal(network(observations), network(-observations)), "what the first layer drops is gone"
    assert not is_compiled(network)
    assert is_compiled(build_network(ResBlockNetwork(), 16, 1))


def test_mlp_has_the_parameters_of_its_layers() -> None:
    assert count(build_network(MlpNetwork(hidden_sizes=(64, 32)), 16, 2)) == (16 * 64 + 64) + (64 * 32 + 32) + (32 * 2 + 2)


def test_resblock_passes_its_input_to_the_head() -> None:
    """With every layer but the head silenced, what is left is the two shortcuts, through LeakyReLU twice."""
    network = build_network(ResBlockNetwork(), 2, 1)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.zero_()
        # second concatenation: layer 4 (4), then the first one: layer 2 (2), then the input (2)
        head(network).weight[0, -2:] = torch.tensor([1.0, 1.0])
        output = network(torch.tensor([[3.0, -2.0]]))
    assert output.item() == pytest.approx(3.0 - 2.0 * 0.01 * 0.01)


@pytest.mark.parametrize("config", NETWORKS, ids=repr)
def test_mean_actions_are_bounded_and_start_in_the_middle(config: Network) -> None:
    actor = GaussianActor(build_network(config, 16, 2), (0.2, 0.4))
    observations = torch.randn(256, 16)
    assert torch.allclose(actor(observations), torch.tensor([0.5, 0.0]), atol=0.05)
    with torch.no_grad():
        head(actor.network).weight.mul_(1e4)
        mean = actor(observations)
    assert mean[:, 0].min() >= 0.0
    assert mean[:, 0].max() <= 1.0
    assert mean[:, 1].min() >= -1.0
    assert mean[:, 1].max() <= 1.0


@pytest.mark.parametrize("rows", [48, 7])
@pytest.mark.parametrize("config", NETWORKS, ids=repr)
def test_written_out_gradients_equal_autograd(config: Network, rows: int) -> None:
    torch.manual_seed(0)
    network = build_network(config, 16, 3)
    flat = FlatParameters(network)
    inputs, grad_output = torch.randn(rows, 16).requires_grad_(), torch.randn(rows, 3)

    outputs = network(inputs)
    outputs.backward(grad_output)
    expected = flat.gradients.clone()
    rounding = 2e-6 * float(expected.abs().max())

    flat.gradients.fill_(float("nan"))  # whatever was there is overwritten
    passes = passes_of(network, 48)
    plain, derivative = inputs.detach().numpy(), grad_output.numpy()
    np.testing.assert_allclose(forward(passes, plain, False), outputs.detach().numpy(), rtol=0, atol=2e-6)
    backward(passes, plain, derivative, False)
    assert torch.allclose(flat.gradients, expected, rtol=0, atol=rounding)
    assert inputs.grad is not None
    np.testing.assert_allclose(input_gradient(passes, derivative), inputs.grad.numpy(), rtol=0, atol=2e-6)
    forward(passes, plain, True)
    backward(passes, plain, derivative, True)  # the second half of a minibatch, as it were
    assert torch.allclose(flat.gradients, 2 * expected, rtol=0, atol=2 * rounding)


@pytest.mark.parametrize("config", [MlpNetwork(hidden_sizes=(8,)), ResBlockNetwork(), ConvNetwork(), GruNetwork()], ids=str)
def test_a_copy_of_a_network_computes_with_its_own_weights(config: Network) -> None:
    network = build_network(config, inputs_of(TaskConfig()), 2)
    twin, observations = copy.deepcopy(network), torch.randn(3, inputs_of(TaskConfig()).size)
    before = network(observations)
    with torch.no_grad():
        for parameter in network.parameters():
            parameter.add_(1.0)
    assert torch.equal(twin(observations), before)
    assert not torch.equal(network(observations), before)

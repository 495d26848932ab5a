"""The networks: the paper's ResBlock network, a plain MLP, and the actor that turns either into bounded actions."""

from itertools import pairwise

import torch
from torch import Tensor, nn
from torch.nn import functional

from workers.config import MlpNetwork, Network, ResBlockNetwork
from workers.networks.layout import LEAKY_SLOPE, RESBLOCK_WIDTH

# A policy head this small starts every training at the middle of the actions, whatever the observation.
_POLICY_HEAD_SCALE = 0.01

# Larger, since a deterministic policy gradient has to find its way through this head.
_DETERMINISTIC_HEAD_SCALE = 0.1


class ResBlock(nn.Module):
    """The paper's network: two blocks whose shortcut is a concatenation (tables 'PPO Critic network structure details').

    With 16 inputs: 16 -> 512 -> 16, concatenated with the input to 32; -> 512 -> 32, concatenated with those 32 to 64;
    -> outputs. LeakyReLU where the tables have it: on layers 1, 3 and 4 and on both concatenations, so that the half of
    the second one that comes from layer 4 goes through it twice. With one output 50,289 parameters, with two 50,354.
    """

    def __init__(self, inputs: int, outputs: int) -> None:
        super().__init__()
        self.layer1 = nn.Linear(inputs, RESBLOCK_WIDTH)
        self.layer2 = nn.Linear(RESBLOCK_WIDTH, inputs)
        self.layer3 = nn.Linear(2 * inputs, RESBLOCK_WIDTH)
        self.layer4 = nn.Linear(RESBLOCK_WIDTH, 2 * inputs)
        self.head = nn.Linear(4 * inputs, outputs)

    def forward(self, inputs: Tensor) -> Tensor:
        """(n, inputs) to (n, outputs), the last layer linear."""
        hidden = self.layer2(_leaky(self.layer1(inputs)))
        first = _leaky(torch.cat((hidden, inputs), dim=1))
        hidden = _leaky(self.layer4(_leaky(self.layer3(first))))
        second = _leaky(torch.cat((hidden, first), dim=1))
        output: Tensor = self.head(second)
        return output


class Mlp(nn.Module):
    """Fully connected layers with one activation between them; the last one is linear."""

    def __init__(self, inputs: int, outputs: int, config: MlpNetwork) -> None:
        super().__init__()
        sizes = (inputs, *config.hidden_sizes)
        self.layers = nn.ModuleList(nn.Linear(a, b) for a, b in pairwise(sizes))
        self.head = nn.Linear(sizes[-1], outputs)
        self.activation = config.activation

    def forward(self, inputs: Tensor) -> Tensor:
        """(n, inputs) to (n, outputs), the last layer linear."""
        activate = torch.relu if self.activation == "relu" else torch.tanh
        hidden = inputs
        for layer in self.layers:
            hidden = activate(layer(hidden))
        output: Tensor = self.head(hidden)
        return output


Body = ResBlock | Mlp


def build_network(config: Network, inputs: int, outputs: int) -> Body:
    """The network of a configuration, freshly initialised from torch's global generator."""
    if isinstance(config, ResBlockNetwork):
        return ResBlock(inputs, outputs)
    return Mlp(inputs, outputs, config)


def bound_actions(logits: Tensor) -> Tensor:
    """(n, 2) network outputs to (n, 2) actions: a sigmoid for the linear, a tanh for the angular velocity."""
    return torch.cat((torch.sigmoid(logits[:, :1]), torch.tanh(logits[:, 1:])), dim=1)


class GaussianActor(nn.Module):
    """A normal distribution over actions: a bounded mean from the observation, a deviation of its own per action.

    Samples are not bounded; the environment clips them.
    """

    def __init__(self, network: Body, initial_std: tuple[float, float]) -> None:
        super().__init__()
        self.network = network
        self.log_std = nn.Parameter(torch.log(torch.tensor(initial_std)))
        with torch.no_grad():
            network.head.weight.mul_(_POLICY_HEAD_SCALE)
            network.head.bias.zero_()

    def forward(self, observations: Tensor) -> Tensor:
        """The mean action (n, 2) for observations (n, size): also the deterministic policy."""
        return bound_actions(self.network(observations))


class DeterministicActor(nn.Module):
    """Observations to bounded actions."""

    def __init__(self, network: Body, observation_size: int) -> None:
        super().__init__()
        self.network = network
        self.observation_size = observation_size
        with torch.no_grad():
            network.head.weight.mul_(_DETERMINISTIC_HEAD_SCALE)
            network.head.bias.zero_()

    def forward(self, observations: Tensor) -> Tensor:
        """Actions (n, 2) for observations (n, size)."""
        return bound_actions(self.network(observations))


def _leaky(values: Tensor) -> Tensor:
    return functional.leaky_relu(values, LEAKY_SLOPE)

"""Algorithms that extensions add: built by the extension, from what it may rely on."""

from dataclasses import dataclass

import torch
from torch import nn

from sim.actions import DEFAULT_ACTIONS, ActionLayout
from sim.extending.discovery import implementation
from sim.streams import EXPLORATION, WEIGHTS, stream_seed
from workers.algorithms.base import Algorithm
from workers.algorithms.storage.rollout import RolloutStorage
from workers.config import AddedAlgorithmConfig, NetworkConfig
from workers.networks.inputs import Inputs, as_inputs
from workers.networks.modules import GaussianActor, build_network


@dataclass(frozen=True)
class Setting:
    """What an algorithm of an extension is to learn with.

    Attributes:
        robots: that collect experience side by side.
        inputs: what an observation is: `inputs.size` numbers.
        network: the configuration of its network.
        seed: of the training.
        device: where it learns.
        actions: what an action is.
    """

    robots: int
    inputs: Inputs
    network: NetworkConfig
    seed: int
    device: torch.device
    actions: ActionLayout = DEFAULT_ACTIONS

    def build_network(self, outputs: int, number: int = 0) -> nn.Module:
        """A network from observations (n, inputs.size) to (n, outputs), on the device.

        Args:
            outputs: how many.
            number: of the network in its algorithm: each has weights of its own, the same for the same seed.
        """
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(stream_seed(self.seed, (*WEIGHTS, number)))
            return build_network(self.network, self.inputs, outputs).to(self.device)

    def build_actor(self, initial_std: float) -> GaussianActor:
        """A Gaussian policy of bounded mean, whose `network` is what the checkpoint holds.

        Args:
            initial_std: deviation of the actions at first, in halves of their ranges.
        """
        deviations = tuple(initial_std * half for half in self.actions.half_spans)
        return GaussianActor(self.build_network(self.actions.size), deviations, self.actions).to(self.device)

    def build_rollout(self, steps: int) -> RolloutStorage:
        """Arrays for so many steps of all robots."""
        return RolloutStorage(steps, self.robots, self.inputs.size, self.actions.size, self.device)

    def generator(self) -> torch.Generator:
        """Where exploration comes from, the same for the same seed."""
        return torch.Generator(self.device).manual_seed(stream_seed(self.seed, EXPLORATION))


def build_added(
    config: AddedAlgorithmConfig, inputs: Inputs | int, seed: int, device: torch.device, actions: ActionLayout
) -> Algorithm:
    """The algorithm that an extension makes of its configuration."""
    setting = Setting(config.robots, as_inputs(inputs), config.network, seed, device, actions)
    algorithm: Algorithm = implementation(config)(config, setting)
    return algorithm

"""How the network computes: any module from (n, inputs.size) to (n, outputs)."""

import torch
from torch import nn

from my_lab import GatedNetwork
from workers.extending.learning import Inputs


class Gated(nn.Module):
    """tanh of one layer times the sigmoid of another."""

    def __init__(self, inputs: int, units: int, outputs: int) -> None:
        super().__init__()
        self.values, self.gates = nn.Linear(inputs, units), nn.Linear(inputs, units)
        self.head = nn.Linear(units, outputs)

    def forward(self, observations):
        """(n, inputs) to (n, outputs)."""
        return self.head(torch.tanh(self.values(observations)) * torch.sigmoid(self.gates(observations)))


def gated(config: GatedNetwork, inputs: Inputs, outputs: int) -> nn.Module:
    """Freshly initialised."""
    return Gated(inputs.size, config.units, outputs)

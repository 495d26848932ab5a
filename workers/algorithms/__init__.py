"""The algorithms: each a module of its own behind the same few methods (`workers.algorithms.base`)."""

import torch

from workers.algorithms.base import Algorithm
from workers.algorithms.ppo import build_ppo
from workers.config import PpoConfig

__all__ = ["Algorithm", "build_algorithm"]


def build_algorithm(config: PpoConfig, observation_size: int, seed: int, device: torch.device) -> Algorithm:
    """The algorithm of a configuration with freshly initialised networks."""
    return build_ppo(config, observation_size, seed, device)

"""The algorithms: each a module of its own behind the same few methods (`workers.algorithms.base`)."""

import torch

from workers.algorithms.base import Algorithm
from workers.algorithms.ddpg import build_ddpg
from workers.algorithms.ppo import build_ppo
from workers.algorithms.sac import build_sac
from workers.algorithms.td3 import build_td3
from workers.config import Algorithm as AlgorithmConfig
from workers.config import DdpgConfig, PpoConfig, SacConfig, Td3Config

__all__ = ["Algorithm", "build_algorithm"]


def build_algorithm(config: AlgorithmConfig, observation_size: int, seed: int, device: torch.device) -> Algorithm:
    """The algorithm of a configuration with freshly initialised networks; the same seed gives the same weights."""
    match config:
        case PpoConfig():
            return build_ppo(config, observation_size, seed, device)
        case DdpgConfig():
            return build_ddpg(config, observation_size, seed, device)
        case Td3Config():
            return build_td3(config, observation_size, seed, device)
        case SacConfig():
            return build_sac(config, observation_size, seed, device)

"""The algorithms: each a module of its own behind the same few methods (`workers.algorithms.base`)."""

import torch

from sim.actions import DEFAULT_ACTIONS, ActionLayout
from workers.algorithms.added import build_added
from workers.algorithms.base import Algorithm
from workers.algorithms.ddpg import build_ddpg
from workers.algorithms.ppo import build_ppo
from workers.algorithms.sac import build_sac
from workers.algorithms.td3 import build_td3
from workers.config import AddedAlgorithmConfig, DdpgConfig, PpoConfig, SacConfig, Td3Config
from workers.config import Algorithm as AlgorithmConfig
from workers.networks.inputs import Inputs

__all__ = ["Algorithm", "build_algorithm"]


def build_algorithm(
    config: AlgorithmConfig,
    inputs: Inputs | int,
    seed: int,
    device: torch.device,
    actions: ActionLayout = DEFAULT_ACTIONS,
) -> Algorithm:
    """The algorithm of a configuration with freshly initialised networks; the same seed gives the same weights.

    Args:
        config: which one, and its hyperparameters.
        inputs: what an observation is, or how many numbers it has.
        seed: of weights and exploration, each a stream of its own (`sim.streams`).
        device: of the networks.
        actions: what an action is.

    Raises:
        NetworkError: the module of its network cannot be trained.
    """
    match config:
        case PpoConfig():
            return build_ppo(config, inputs, seed, device, actions)
        case DdpgConfig():
            return build_ddpg(config, inputs, seed, device, actions)
        case Td3Config():
            return build_td3(config, inputs, seed, device, actions)
        case SacConfig():
            return build_sac(config, inputs, seed, device, actions)
        case AddedAlgorithmConfig():
            return build_added(config, inputs, seed, device, actions)

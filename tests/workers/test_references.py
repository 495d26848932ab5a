"""What each algorithm's first updates give today, bit for bit, from the same experience.

Whoever writes an algorithm anew proves with these that nothing has changed; `tests.references` says what other processors
do.
"""

from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.typing import NDArray

from tests.references import check, digest
from workers.algorithms import build_algorithm
from workers.algorithms.base import Algorithm
from workers.algorithms.ddpg import NoisyPolicy
from workers.algorithms.gradients.actor_critic import AutogradActorCritic
from workers.algorithms.gradients.ppo import AutogradPpo
from workers.algorithms.gradients.sac import AutogradSac
from workers.algorithms.ppo import Ppo
from workers.algorithms.sac import Sac
from workers.config import Algorithm as AlgorithmConfig
from workers.config import DdpgConfig, MlpNetwork, PpoConfig, ResBlockNetwork, SacConfig, Td3Config

FILE = Path(__file__).parent / "references.json"
SIZE, ROBOTS, UPDATES = 16, 16, 6
CPU = torch.device("cpu")

ROLLOUT = {"robots": ROBOTS, "rollout_steps": 8, "minibatch_size": 48, "epochs": 2}
REPLAY = {"robots": ROBOTS, "batch_size": 32, "replay_size": 1000, "warmup_steps": 48, "updates_per_step": 3}
CASES: dict[str, AlgorithmConfig] = {
    "ppo": PpoConfig.model_validate(ROLLOUT),
    "ppo, tanh": PpoConfig.model_validate(ROLLOUT | {"network": MlpNetwork(hidden_sizes=(24, 24), activation="tanh")}),
    "ppo, resblock, constant rate, plain returns": PpoConfig.model_validate(
        ROLLOUT | {"network": ResBlockNetwork(), "learning_rate_schedule": "constant", "scale_returns": False}
    ),
    "ddpg": DdpgConfig.model_validate(REPLAY),
    "ddpg, resblock, no penalty": DdpgConfig.model_validate(REPLAY | {"network": ResBlockNetwork(), "logit_penalty": 0.0}),
    "td3": Td3Config.model_validate(REPLAY),
    "sac": SacConfig.model_validate(REPLAY),
    "sac, tanh": SacConfig.model_validate(REPLAY | {"network": MlpNetwork(hidden_sizes=(24, 24), activation="tanh")}),
}


def learn(algorithm: Algorithm, updates: int) -> list[list[NDArray[np.generic]]]:
    """All that the algorithm has after each update: the actions it took, its diagnostics and its state."""
    rng = np.random.default_rng(3)
    found = []
    observations = rng.uniform(-1.0, 1.0, (ROBOTS, SIZE)).astype(np.float32)
    for update in range(updates):
        arrays: list[NDArray[np.generic]] = []
        for _ in range(algorithm.steps_per_update):
            arrays.append(algorithm.act(observations).copy())
            last = rng.uniform(-1.0, 1.0, (ROBOTS, SIZE)).astype(np.float32)
            observations = rng.uniform(-1.0, 1.0, (ROBOTS, SIZE)).astype(np.float32)
            ended = rng.random((2, ROBOTS)) < 0.1
            algorithm.record(
                observations, rng.normal(0.0, 50.0, ROBOTS).astype(np.float32), ended[0], ended[1] & ~ended[0], last
            )
        diagnostics = algorithm.update(update / updates)
        arrays.append(np.array([value for _, value in sorted(diagnostics.items())]))
        arrays += [np.array(array) for _, array in sorted(algorithm.state().items())]
        found.append(arrays)
    return found


@pytest.mark.parametrize("name", CASES)
def test_first_updates_are_those_that_were_recorded(name: str) -> None:
    algorithm = build_algorithm(CASES[name], SIZE, 7, CPU)
    hashes = [digest(arrays) for arrays in learn(algorithm, UPDATES)]
    assert len(set(hashes)) == UPDATES
    check(FILE, name, hashes, lambda: hold_against_autograd(name))


def differentiate_plainly(algorithm: Algorithm) -> None:
    """Let an algorithm's gradients be autograd's."""
    if isinstance(algorithm, Ppo):
        config = algorithm.config
        algorithm._gradients = AutogradPpo(algorithm.actor, algorithm.critic, config.clip_range, config.entropy_coefficient)
    elif isinstance(algorithm, NoisyPolicy):
        algorithm.gradients = AutogradActorCritic(
            algorithm.actor,
            algorithm.critics,
            algorithm.actor_optimizer,
            algorithm.critic_optimizer,
            algorithm.config.logit_penalty,
        )
    else:
        assert isinstance(algorithm, Sac)
        algorithm.gradients = AutogradSac(
            algorithm.actor, algorithm.critics, algorithm.actor_optimizer, algorithm.critic_optimizer
        )


def hold_against_autograd(name: str) -> None:
    """One update that learns, by the fastest gradients and by autograd: the same policy but for rounding."""
    updates = 1 if name.startswith("ppo") else 4  # the off-policy ones explore for three steps before they learn
    before, ours, theirs = (build_algorithm(CASES[name], SIZE, 7, CPU) for _ in range(3))
    differentiate_plainly(theirs)
    for algorithm in (ours, theirs):
        learn(algorithm, updates)
    for key, weights in ours.policy_weights().items():
        moved = np.abs(weights - before.policy_weights()[key])
        assert moved.max() > 1e-4
        # Adam makes steps of the same size of gradients of any, so that some of next to nothing go the other way.
        apart = np.abs(weights - theirs.policy_weights()[key])
        assert np.quantile(apart, 0.98) <= 0.02 * moved.max()


@pytest.mark.parametrize("name", CASES)
def test_the_plain_twin_agrees_where_nothing_is_recorded(name: str) -> None:
    hold_against_autograd(name)

"""The page that PPO is read from, and the code that trains: the same weights after the same steps on the real task.

Both round differently, and where a ReLU or the clip has a kink a last bit turns a gradient: over long trainings with large
steps they part like two trainings on two processors. Small steps keep them together to a few millionths of what was learned.
"""

import math
from pathlib import Path

import pytest
import torch
from torch import Tensor, nn

from sim.actions import action_layout
from sim.config import ArenaConfig, LidarConfig, ObservationConfig, TaskConfig
from tests.workers.test_trainer import Recorder
from workers.algorithms import plain_ppo
from workers.algorithms.ppo import Ppo, build_actor_critic
from workers.config import ConvNetwork, EvaluationConfig, MlpNetwork, Network, PpoConfig, ResBlockNetwork, TrainingConfig
from workers.live.viewing import Unwatched
from workers.networks.inputs import inputs_of
from workers.training.trainer import Training

SEED = 3
NETWORKS = [MlpNetwork(), MlpNetwork(activation="tanh"), ResBlockNetwork(), ConvNetwork()]
SMALL_STEPS = {"learning_rate": 1e-4, "epochs": 1}

# Measured: a few millionths; with any line of the page wrong at least half a thousandth in one of the tests.
TOLERANCE = 5e-5

# Of 10 steps each: every rollout has time-outs, the last of them in its last step.
TIMED_OUT = TaskConfig(step_limit=10)
TWO_ROBOTS = {"robots": 2, "rollout_steps": 500, "minibatch_size": 96}
# A second at a time: robots that explore drive into walls within a few steps.
COLLIDING = TaskConfig(
    lidar=LidarConfig(rays=60), observation=ObservationConfig.preset("improved", frames=2), control_period=1.0
)


def vector(*modules: nn.Module) -> Tensor:
    return torch.cat([parameter.detach().flatten() for module in modules for parameter in module.parameters()])


def apart(task: TaskConfig, algorithm: PpoConfig, updates: int, directory: Path) -> tuple[float, dict[str, float]]:
    """How far the weights of the two are apart, as a part of what was learned; the last diagnostics of the quick one."""
    steps = updates * algorithm.robots * algorithm.rollout_steps
    config = TrainingConfig(task=task, algorithm=algorithm, steps=steps, evaluation=EvaluationConfig(every_steps=10**9))
    training = Training(config, SEED, Recorder(), directory, Unwatched(), 0.0)
    ppo = training.algorithm
    assert isinstance(ppo, Ppo)
    for update in range(updates):
        training.collect()
        diagnostics = ppo.update(update / updates)
    plain = plain_ppo.train(config, SEED)
    untrained = vector(*build_actor_critic(algorithm, inputs_of(task), SEED, action_layout(task.robot)))
    quick, slow = vector(ppo.actor, ppo.critic), vector(plain.actor, plain.critic)
    return float((quick - slow).norm() / (slow - untrained).norm()), diagnostics


@pytest.mark.parametrize("network", NETWORKS, ids=repr)
def test_both_learn_the_same(network: Network, tmp_path: Path) -> None:
    algorithm = PpoConfig(network=network, entropy_coefficient=0.1, **SMALL_STEPS)
    distance, _ = apart(TaskConfig(), algorithm, 3, tmp_path)
    assert distance < TOLERANCE


@pytest.mark.parametrize("network", NETWORKS, ids=repr)
@pytest.mark.parametrize("task", [TIMED_OUT, COLLIDING], ids=["timed out", "colliding"])
def test_two_robots_whose_episodes_end(task: TaskConfig, network: Network, tmp_path: Path) -> None:
    algorithm = PpoConfig(
        network=network, learning_rate_schedule="constant", scale_returns=False, **TWO_ROBOTS, **SMALL_STEPS
    )
    distance, _ = apart(task, algorithm, 2, tmp_path)
    assert distance < TOLERANCE


@pytest.mark.parametrize("task", [TIMED_OUT, COLLIDING], ids=["timed out", "colliding"])
def test_a_critic_that_is_told_the_way(task: TaskConfig, tmp_path: Path) -> None:
    """Among obstacles, over time-outs, whose value is what the path was there, and collisions."""
    task = task.model_copy(update={"arena": ArenaConfig(name="complex")})
    algorithm = PpoConfig(critic_sees="path", learning_rate_schedule="constant", **TWO_ROBOTS, **SMALL_STEPS)
    distance, _ = apart(task, algorithm, 2, tmp_path)
    assert distance < TOLERANCE


@pytest.mark.parametrize("network", [MlpNetwork(), ConvNetwork()], ids=["compiled", "by autograd"])
def test_exploration_that_is_to_end(network: Network, tmp_path: Path) -> None:
    """Three updates, of which the last stands at two thirds: the limit has fallen by a third of the way, to 1.03."""
    algorithm = PpoConfig(network=network, final_std=0.15, initial_std_linear=2.0, initial_std_angular=2.0, **SMALL_STEPS)
    distance, diagnostics = apart(TaskConfig(), algorithm, 3, tmp_path)
    assert distance < TOLERANCE
    assert diagnostics["policy/std_linear"] == pytest.approx(math.exp(1 - (1 - math.log(0.15)) / 3))


def test_the_defaults_hyperparameters_lead_to_the_same_place(tmp_path: Path) -> None:
    """48 large steps an update, so that many ratios are clipped; a network without kinks keeps the two together."""
    distance, diagnostics = apart(TaskConfig(), PpoConfig(network=MlpNetwork(activation="tanh")), 4, tmp_path)
    assert distance < 1e-3
    assert diagnostics["policy/clip_fraction"] > 0.02

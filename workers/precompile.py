"""`python -m workers.precompile`: compile everything into the caches beside it, so that no training waits for the compiler.

`make` runs it when the sources have changed; without it the first training on a machine would take a minute more.
"""

from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context

import numpy as np
import torch

import sim.precompile
from sim.config import TaskConfig
from sim.envs.vector import NavigationVectorEnv
from sim.observations import observation_layout
from sim.suites import run_suite, suite_for
from workers.algorithms import build_algorithm
from workers.algorithms.flat import FlatParameters
from workers.config import GruNetwork, MlpNetwork, Network, PpoConfig, ResBlockNetwork
from workers.networks.compiled import TensorPasses
from workers.networks.modules import build_network


def warm_up() -> None:
    """Loads what a training's first second would be spent on: compiled code, the default suite, PyTorch's lazy imports."""
    task = TaskConfig()
    run_suite(lambda observations: np.zeros((len(observations), 2), np.float32), task, suite_for(task))
    NavigationVectorEnv(task, 1, seed=0).reset()
    update_all()


def update_all() -> None:
    """Everything that learns, once."""
    task = TaskConfig()
    networks: tuple[Network, ...] = (MlpNetwork(), ResBlockNetwork(), GruNetwork(sequence_length=2))
    for network in networks:
        _update_once(PpoConfig(network=network, robots=4, rollout_steps=4, minibatch_size=16, epochs=1), task)
    critic = build_network(MlpNetwork(), 1, 1)
    FlatParameters(critic)
    # What only the off-policy algorithms need.
    TensorPasses(critic, 1).input_gradient(torch.zeros(1, 1))


def _update_once(config: PpoConfig, task: TaskConfig) -> None:
    """One update from a rollout in which nothing happens."""
    size = observation_layout(task).size
    algorithm = build_algorithm(config, size, 0, torch.device("cpu"))
    observations, rewards = np.zeros((config.robots, size), np.float32), np.zeros(config.robots, np.float32)
    nothing = np.zeros(config.robots, np.bool_)
    for _ in range(algorithm.steps_per_update):
        algorithm.act(observations)
        algorithm.record(observations, rewards, nothing, nothing, observations)
    algorithm.update(0.0)


if __name__ == "__main__":
    # The learners' kernels beside the simulator's: they know nothing of each other, and compiling is half a minute of each.
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        learners = pool.submit(update_all)
        sim.precompile.main()
        learners.result()
    warm_up()

"""Streams of random numbers: nothing shares its chance with anything else."""

import numpy as np
import pytest
import torch

from sim.arenas import build_arenas
from sim.config import ArenaConfig, MoversConfig, TaskConfig
from sim.envs.vector import NavigationVectorEnv
from sim.streams import ENVIRONMENT, EVALUATION, EXPLORATION, MAPS, MOVERS, WEIGHTS, stream_seed
from sim.suites.scenarios import scenario_world
from workers.algorithms import build_algorithm
from workers.config import Algorithm, DdpgConfig, PpoConfig, SacConfig, Td3Config

CROWD = TaskConfig(arena=ArenaConfig(movers=MoversConfig(count=4)))


def test_no_two_streams_are_alike_and_none_is_its_own_childrens() -> None:
    streams = (EVALUATION, ENVIRONMENT, WEIGHTS, EXPLORATION, MAPS)
    named = [*streams, *((*stream, *MOVERS) for stream in streams)]
    assert len(set(named)) == len(named)
    seeds = [stream_seed(seed, stream) for seed in range(50) for stream in named]
    assert len(set(seeds)) == len(seeds)
    assert all(0 <= seed < 2**63 for seed in seeds)
    assert stream_seed(1, MAPS, bits=31) < 2**31


@pytest.mark.parametrize("seed", [0, 1])
def test_no_training_meets_the_movers_that_it_is_measured_with(seed: int) -> None:
    envs = NavigationVectorEnv(CROWD, 1, seed=seed)
    envs.reset(seed=seed)
    measured = scenario_world(CROWD, build_arenas(CROWD.arena), 1)
    measured.movers.place()
    apart = np.hypot(*(envs.discs[0, :, None, :2] - measured.movers.discs[0, None, :, :2]).T)
    assert apart.min() > 1e-3


@pytest.mark.parametrize("config", [PpoConfig(), DdpgConfig(robots=8), Td3Config(robots=8), SacConfig(robots=8)])
def test_exploration_does_not_repeat_the_chance_that_the_weights_were_drawn_with(config: Algorithm) -> None:
    algorithm = build_algorithm(config, 16, 5, torch.device("cpu"))
    generator = torch.Generator()
    generator.set_state(torch.from_numpy(np.array(algorithm.state()["generator"], np.uint8)))
    explored = torch.rand(1024, generator=generator).numpy()
    # PyTorch draws a layer's weights uniformly within one over the root of its inputs; the first layer's come first.
    drawn = 0.5 + 2.0 * algorithm.policy_weights()["layers.0.weight"].ravel()[:1024]
    assert drawn.min() >= 0.0
    assert drawn.max() <= 1.0
    assert np.abs(drawn - explored[: len(drawn)]).mean() > 0.2  # a third where they have nothing to do with each other


def test_a_suites_stream_never_changes() -> None:
    # The hash of `crowd-200` and every recorded evaluation in a crowd depend on it.
    world = scenario_world(CROWD, build_arenas(CROWD.arena), 2)
    root = np.random.SeedSequence(0).generate_state(1, np.uint64)[0]
    child = np.random.SeedSequence(0, spawn_key=(1,)).generate_state(1, np.uint64)[0]
    assert stream_seed(0, EVALUATION, bits=64) == root
    assert stream_seed(0, (*EVALUATION, *MOVERS), bits=64) == child
    assert len(set(world.robots.records["random"].tolist())) == 2

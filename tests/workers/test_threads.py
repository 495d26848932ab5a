"""A training on two threads ends at the same bits; how many it takes follows what others leave free."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from sim.config import ObservationConfig, OpeningsPart, TaskConfig, TrailPart
from sim.engine.stretches import Crew
from tests.workers.test_trainer import Recorder
from workers.algorithms.flat import FlatParameters
from workers.algorithms.gradients.ppo import WrittenPpo
from workers.algorithms.ppo import Ppo
from workers.config import EvaluationConfig, MlpNetwork, Network, PpoConfig, ResBlockNetwork, Threads, TrainingConfig
from workers.kernels.ppo import CRITIC
from workers.live.viewing import Unwatched
from workers.networks.compiled import Inference
from workers.networks.inputs import as_inputs
from workers.networks.modules import build_network
from workers.training.threads import ThreadCount, runnable_threads
from workers.training.trainer import Training


def trained(
    threads: Threads, network: Network, directory: Path, task: TaskConfig | None = None, robots: int = 24
) -> dict[str, np.ndarray]:
    """The state after three updates, whose minibatches are not all of one size."""
    algorithm = PpoConfig(network=network, robots=robots, rollout_steps=16, epochs=3, minibatch_size=150)
    config = TrainingConfig(
        task=task or TaskConfig(),
        algorithm=algorithm,
        steps=100_000,
        evaluation=EvaluationConfig(every_steps=100_000),
        threads=threads,
    )
    training = Training(config, 3, Recorder(), directory, Unwatched(), 0.0)
    for _ in range(3):
        training.collect()
        training.update()
    assert isinstance(training.algorithm, Ppo)
    assert training.algorithm.threads == training.env.threads == int(threads)
    metrics = {name: np.array(value) for name, value in training.metrics.flush().items() if not name.startswith("time/")}
    return {**training.algorithm.state(), **training.env.get_state(), **metrics}


@pytest.mark.parametrize("network", [MlpNetwork(hidden_sizes=(48, 32)), ResBlockNetwork()], ids=lambda one: str(one.name))
def test_two_threads_end_at_the_same_bits(network: Network, tmp_path: Path) -> None:
    alone, beside = (trained(threads, network, tmp_path / threads) for threads in ("1", "2"))
    assert alone.keys() == beside.keys()
    for name, array in alone.items():
        assert np.array_equal(array, beside[name]), name


def test_networks_see_some_robots_on_each_thread(tmp_path: Path) -> None:
    """300 are 256 on one and 44 on the other; those of one step and of the next go through a critic together."""
    alone, beside = (
        trained(threads, MlpNetwork(hidden_sizes=(24, 16)), tmp_path / threads, robots=300) for threads in ("1", "2")
    )
    for name, array in alone.items():
        assert np.array_equal(array, beside[name]), name


@pytest.mark.parametrize("threads", [1, 2, 3])
@pytest.mark.parametrize("rows", [16, 256, 257, 900])
def test_parts_of_the_rows_come_out_as_all_of_them(threads: int, rows: int) -> None:
    network = build_network(MlpNetwork(hidden_sizes=(24, 16)), as_inputs(9), 2)
    FlatParameters(network)
    seen = torch.randn(rows, 9, generator=torch.Generator().manual_seed(1))
    infer = Inference(network, rows)
    for _ in range(2):
        with torch.no_grad():
            torch.testing.assert_close(infer(seen, Crew(threads)), network(seen), rtol=1e-5, atol=1e-6)
            for parameter in network.parameters():
                parameter.add_(0.1)


def test_robots_that_see_what_takes_long_are_followed_by_two_threads_alike(tmp_path: Path) -> None:
    task = TaskConfig(observation=ObservationConfig(parts=(TrailPart(), OpeningsPart())))
    alone, beside = (trained(threads, MlpNetwork(), tmp_path / threads, task, robots=128) for threads in ("1", "2"))
    for name, array in alone.items():
        assert np.array_equal(array, beside[name]), name


def test_all_minibatches_in_one_call_end_where_one_after_the_other_does(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    compiled = trained("1", MlpNetwork(hidden_sizes=(48, 32)), tmp_path)
    monkeypatch.setattr(Ppo, "_learn_compiled", lambda ppo, _, *rest: ppo._learn(*rest))
    by_turns = trained("1", MlpNetwork(hidden_sizes=(48, 32)), tmp_path)
    assert compiled.keys() == by_turns.keys()
    for name, array in compiled.items():
        assert np.array_equal(array, by_turns[name]), name


def test_the_other_thread_flushes_denormal_numbers_too(tmp_path: Path) -> None:
    """Adam's moments of dead units decay into them; a thread that kept them would end at other bits."""
    torch.set_flush_denormal(True)
    try:
        alone, beside = (trained(threads, MlpNetwork(hidden_sizes=(8,)), tmp_path / threads) for threads in ("1", "2"))
    finally:
        torch.set_flush_denormal(False)
    assert all(np.array_equal(array, beside[name]) for name, array in alone.items())


def test_a_fault_of_the_other_thread_ends_the_update(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    learn = WrittenPpo.learn

    def broken(self: WrittenPpo, whose: int, *rest: Any) -> torch.Tensor:
        if whose == CRITIC:
            raise MemoryError
        return learn(self, whose, *rest)

    monkeypatch.setattr(WrittenPpo, "learn", broken)
    with pytest.raises(MemoryError):
        trained("2", MlpNetwork(hidden_sizes=(8,)), tmp_path)


@pytest.mark.parametrize(
    ("cores", "seen", "threads"),
    [
        (1, [1, 1], [1, 1]),
        (2, [1, 1], [2, 2]),  # nobody else
        (2, [2, 2, 2], [1, 1, 1]),  # one other computes all the time
        (2, [1, 4, 1], [2, 1, 2]),  # three others for a moment: 0.6 and then 0.48 of them are believed in
        (2, [9, *[1] * 15], [*[1] * 13, 2, 2, 2]),  # eight leave: 8 x 0.8^13 = 0.44 is left of them
        (64, [60, 60], [2, 2]),  # no training can use more
    ],
)
def test_auto_takes_what_others_leave_free(cores: int, seen: list[int], threads: list[int]) -> None:
    looks = iter(seen)
    count = ThreadCount("auto", cores, lambda: next(looks))
    assert [count.now() for _ in seen] == threads


def test_a_number_is_taken_as_it_is() -> None:
    assert ThreadCount("2", 1, lambda: 50).now() == 2
    assert ThreadCount("1", 64, lambda: 1).now() == 1


def test_this_thread_is_among_those_that_run() -> None:
    assert runnable_threads() >= 1

"""Networks that an extension says as a formula: trained, resumed and exported like those that ship, memory included."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pytest
import torch
from pydantic import Field, ValidationError

from sim.config import TaskConfig
from tests.workers.test_trainer import Recorder
from workers.algorithms.ppo import build_ppo
from workers.algorithms.recurrent_ppo import RecurrentPpo
from workers.checkpoints import read_checkpoint, read_policy
from workers.config import AddedAlgorithmConfig, EvaluationConfig, PpoConfig, SacConfig, TrainingConfig
from workers.errors import NetworkError
from workers.export.bundle import export_checkpoint
from workers.extending.formulas import OPERATORS, Description, FormulaNetwork, Inputs, RecurrentNetwork
from workers.networks import expressions
from workers.networks.config import NETWORKS, NetworkConfig, complete_network
from workers.networks.inputs import inputs_of
from workers.networks.modules import Described, build_network
from workers.policy import torch_policy
from workers.training.trainer import train


class ElmanNetwork(RecurrentNetwork):
    """A hidden layer that sees what it was a step before (Elman 1990)."""

    name: Literal["lab.elman"] = Field("lab.elman", title="Elman")
    units: int = Field(24, ge=4, le=512, title="Units")
    implementation = "tests.workers.test_described_networks:elman"


class ProductNetwork(FormulaNetwork):
    """Two layers, one times the other."""

    name: Literal["lab.product"] = Field("lab.product", title="Product")
    lines: tuple[str, ...] = ("y = head(multiply(tanh(first(x)), sigmoid(second(x))))",)
    memory: int = 0
    implementation = "tests.workers.test_described_networks:product"


def elman(config: ElmanNetwork, inputs: Inputs, outputs: int) -> Description:
    units = config.units
    return Description(
        # Reads x among the lines that go step by step, too.
        lines=("i = input(x)", "h = tanh(add(add(i, memory(h)), again(x)))", "y = head(h)"),
        layers={
            "input": (units, inputs.size),
            "memory": (units, units),
            "again": (units, inputs.size),
            "head": (outputs, units),
        },
        activation="tanh",
        memory=units,
    )


def product(config: ProductNetwork, inputs: Inputs, outputs: int) -> Description:
    layers: dict[str, tuple[int, ...]] = {"first": (8, inputs.size), "second": (8, inputs.size), "head": (outputs, 8)}
    return Description(config.lines, layers, "tanh", config.memory)


Elman: Any = complete_network(ElmanNetwork)
Product: Any = complete_network(ProductNetwork)


@pytest.fixture(autouse=True)
def _known() -> Iterator[None]:
    """As if an extension had brought them."""
    for network in (Elman, Product):
        NETWORKS.add(network)
    yield
    for network in (Elman, Product):
        NETWORKS.remove(network)


@pytest.mark.parametrize("network", [Elman(sequence_length=8), Product()], ids=lambda network: network.name)
def test_trained_resumed_and_exported(network: NetworkConfig, tmp_path: Path) -> None:
    algorithm = PpoConfig(network=network, robots=32, rollout_steps=16, minibatch_size=128, epochs=2)
    config = TrainingConfig(algorithm=algorithm, steps=2_000, evaluation=EvaluationConfig(every_steps=1_000))
    whole, second = Recorder(), Recorder()
    assert train(config, 1, whole, tmp_path, report_interval=0.0) == "completed"
    train(config, 1, second, tmp_path / "second", resume=whole.checkpoints[0][1], report_interval=0.0)
    first, again = (read_checkpoint(recorder.checkpoints[-1][1]).arrays for recorder in (whole, second))
    assert first.keys() == again.keys()
    for name, array in first.items():
        np.testing.assert_array_equal(array, again[name], err_msg=name)

    exported = export_checkpoint(whole.checkpoints[-1][1])  # compares ONNX, NumPy runner and torch, memories included
    assert exported.report.policy_difference <= 1e-5
    assert exported.specification.memory == (24 if network.recurrent else 0)
    manifest, policy = read_policy(whole.checkpoints[-1][1])
    assert "y = head(" in " ".join(manifest.network.formula)
    observations = np.random.default_rng(0).random((4, policy.inputs.size), np.float32)
    np.testing.assert_allclose(policy(observations), torch_policy(policy)(observations), rtol=0, atol=1e-6)


def test_a_recurrent_one_is_learned_through_time() -> None:
    """Gradients of a sequence are those of the formula, step by step."""
    network = build_network(Elman(), 5, 2)
    assert isinstance(network, Described)
    observations, keep = torch.randn(6, 3, 5), torch.ones(6, 3, 1)
    keep[2, 1] = 0.0
    memory = torch.randn(3, 24)
    at_once = network.unroll(observations, memory, keep)
    remembered, one_by_one = memory, []
    for step in range(6):
        outputs, remembered = network(observations[step], remembered * keep[step])
        one_by_one.append(outputs)
    torch.testing.assert_close(at_once, torch.stack(one_by_one))
    algorithm = build_ppo(PpoConfig(network=Elman()), inputs_of(TaskConfig()), 1, torch.device("cpu"))
    assert isinstance(algorithm, RecurrentPpo)


@pytest.mark.parametrize("algorithm", [SacConfig, AddedAlgorithmConfig])
def test_only_ppo_takes_one_that_remembers(algorithm: Callable[..., object]) -> None:
    name = {} if algorithm is SacConfig else {"name": "lab.search"}
    with pytest.raises(ValidationError, match="recurrent networks are for PPO"):
        algorithm(network=Elman(), **name)


@pytest.mark.parametrize(
    ("network", "reason"),
    [
        (Product(lines=("y = head(first(z))",)), r"formula of the network 'lab.product' can't be computed: KeyError\('z'\)"),
        (Product(lines=("y = wide(x)",)), "can't be computed"),
        (Product(lines=("y = first(x)",)), r"makes \(3, 8\).* not \(3, 2\)"),
        (Product(memory=4), "describes 4 numbers of memory: a RecurrentNetwork has some, every other none"),
    ],
)
def test_a_formula_that_can_not_be_is_refused(network: NetworkConfig, reason: str) -> None:
    with pytest.raises(NetworkError, match=reason):
        build_network(network, 5, 2)


def test_the_operators_that_are_documented_are_those_that_there_are() -> None:
    assert OPERATORS.keys() == expressions._OPERATORS.keys()

"""Any module from (n, size) to (n, outputs) is a network: registered in one place, trained by every algorithm."""

import io
import zipfile
from collections.abc import Iterator
from pathlib import Path
from typing import Literal

import numpy as np
import pytest
import torch
from pydantic import Field, ValidationError
from torch import Tensor, nn

from tests.workers.test_trainer import Recorder
from workers.checkpoints import read_checkpoint, read_policy
from workers.config import (
    Algorithm,
    DdpgConfig,
    EvaluationConfig,
    MlpNetwork,
    NetworkConfig,
    PpoConfig,
    ResBlockNetwork,
    SacConfig,
    Td3Config,
    TrainingConfig,
)
from workers.errors import NetworkError
from workers.export.bundle import bundle, export_checkpoint
from workers.export.ros2.mapless_navigator.policy import Policy as Runner
from workers.networks.compiled import is_compiled
from workers.networks.inputs import Inputs
from workers.networks.modules import build_network, head_of
from workers.networks.registry import forget_network, register_network
from workers.policy import torch_policy
from workers.training.trainer import train


class GatedNetwork(NetworkConfig):
    """A network that the project knows nothing of."""

    name: Literal["gated"] = Field("gated", title="Gated")
    units: int = Field(12, ge=1, title="Units")


class Gated(nn.Module):
    """A hidden layer, half of which decides how much of the other half counts."""

    def __init__(self, inputs: int, units: int, outputs: int) -> None:
        super().__init__()
        self.norm = nn.LayerNorm(inputs)
        self.hidden = nn.Linear(inputs, 2 * units)
        self.out = nn.Linear(units, outputs)

    def forward(self, inputs: Tensor) -> Tensor:
        """(n, inputs) to (n, outputs)."""
        outputs: Tensor = self.out(nn.functional.glu(self.hidden(self.norm(inputs)), dim=1))
        return outputs


@pytest.fixture(autouse=True)
def gated() -> Iterator[None]:
    register_network(GatedNetwork, lambda config, inputs, outputs: Gated(inputs.size, config.units, outputs))
    yield
    forget_network(GatedNetwork)


OFF_POLICY = {"robots": 50, "batch_size": 32, "warmup_steps": 500, "replay_size": 1_000, "network": {"name": "gated"}}
ALGORITHMS: list[tuple[type[PpoConfig | DdpgConfig | Td3Config | SacConfig], dict[str, object]]] = [
    (PpoConfig, {"robots": 32, "rollout_steps": 16, "minibatch_size": 128, "epochs": 2, "network": {"name": "gated"}}),
    (DdpgConfig, OFF_POLICY),
    (Td3Config, OFF_POLICY),
    (SacConfig, OFF_POLICY),
]


@pytest.mark.parametrize(("kind", "values"), ALGORITHMS, ids=lambda value: getattr(value, "__name__", ""))
def test_every_algorithm_trains_saves_and_resumes_it_bit_for_bit(
    kind: type[Algorithm], values: dict[str, object], tmp_path: Path
) -> None:
    algorithm = kind.model_validate(values)
    config = TrainingConfig(algorithm=algorithm, steps=2_000, evaluation=EvaluationConfig(every_steps=1_000))
    # What a run's row holds is read back as it was.
    assert TrainingConfig.model_validate_json(config.model_dump_json()) == config

    whole, second = Recorder(), Recorder()
    assert train(config, 1, whole, tmp_path, report_interval=0.0) == "completed"
    train(config, 1, second, tmp_path / "second", resume=whole.checkpoints[0][1], report_interval=0.0)
    first, again = read_checkpoint(whole.checkpoints[-1][1]), read_checkpoint(second.checkpoints[-1][1])
    assert first.arrays.keys() == again.arrays.keys()
    for name, array in first.arrays.items():
        np.testing.assert_array_equal(array, again.arrays[name], err_msg=name)
    start = read_checkpoint(whole.checkpoints[0][1])
    assert any(not np.array_equal(array, first.weights[name]) for name, array in start.weights.items())

    manifest, policy = read_policy(whole.checkpoints[-1][1])
    assert manifest.network.name == "gated"
    assert set(policy.weights) == {"norm.weight", "norm.bias", "hidden.weight", "hidden.bias", "out.weight", "out.bias"}
    assert policy.weights["out.weight"].shape == (2, 12)
    observations = np.random.default_rng(0).random((5, 16), np.float32)
    np.testing.assert_array_equal(policy(observations), torch_policy(policy)(observations))
    # By onnxruntime, of the graph that PyTorch makes; compared with the module before anybody gets it.
    exported = export_checkpoint(whole.checkpoints[-1][1])
    assert exported.specification.formula == ()
    with zipfile.ZipFile(io.BytesIO(bundle(exported))) as file:
        file.extractall(tmp_path / "bundle")
    runner = Runner.load(tmp_path / "bundle" / "mapless-policy" / "policy")
    np.testing.assert_allclose(runner.actions(observations), policy(observations), rtol=0, atol=1e-5)


def test_compiled_passes_are_for_the_networks_that_they_are_written_for() -> None:
    mlp, resblock = build_network(MlpNetwork(), 4, 2), build_network(ResBlockNetwork(), 4, 2)
    ours = build_network(GatedNetwork(), 4, 2)
    assert is_compiled(mlp, resblock)
    assert not is_compiled(mlp, ours)
    assert not is_compiled(mlp.to("meta"))


def test_an_actor_of_any_network_starts_in_the_middle() -> None:
    assert head_of(build_network(GatedNetwork(units=3), Inputs(4), 2)).weight.shape == (2, 3)  # type: ignore[union-attr]
    assert head_of(nn.Sequential(nn.Conv1d(1, 1, 1), nn.Flatten())) is None


def test_it_is_in_the_schema_while_it_is_registered() -> None:
    networks = PpoConfig.model_json_schema()["properties"]["network"]["discriminator"]["mapping"]
    assert networks["gated"] == "#/$defs/GatedNetwork"
    with pytest.raises(ValidationError) as refused:
        PpoConfig.model_validate({"network": {"name": "gated", "units": 0}})
    assert refused.value.errors()[0]["loc"] == ("network", "gated", "units")
    forget_network(GatedNetwork)
    with pytest.raises(ValidationError, match="does not match any of the expected tags"):
        PpoConfig.model_validate({"network": {"name": "gated"}})
    register_network(GatedNetwork, lambda config, inputs, outputs: nn.Linear(inputs.size, outputs))


def test_a_name_belongs_to_one_network() -> None:
    class Other(NetworkConfig):
        name: Literal["mlp"] = "mlp"

    with pytest.raises(ValueError, match="there is a 'mlp' already"):
        register_network(Other, lambda config, inputs, outputs: nn.Linear(inputs.size, outputs))


class Wrong(nn.Module):
    """Makes a number too few."""

    def __init__(self) -> None:
        super().__init__()
        self.layer = nn.Linear(4, 1)

    def forward(self, inputs: Tensor) -> Tensor:
        """(n, 4) to (n, 1)."""
        outputs: Tensor = self.layer(inputs)
        return outputs


@pytest.mark.parametrize(
    ("module", "reason"),
    [
        (lambda: nn.Sequential(nn.Linear(4, 2), nn.BatchNorm1d(2)), "running averages"),
        (lambda: nn.Linear(4, 2, dtype=torch.float64), "float32"),
        (nn.Tanh, "must have parameters"),
        (Wrong, r"makes \(3, 1\) of \(3, 4\), not \(3, 2\)"),
    ],
    ids=["buffers", "doubles", "nothing to learn", "shape"],
)
def test_what_cannot_be_trained_is_refused_with_the_reason(module: type[nn.Module], reason: str) -> None:
    forget_network(GatedNetwork)
    register_network(GatedNetwork, lambda config, inputs, outputs: module())
    with pytest.raises(NetworkError, match=reason):
        build_network(GatedNetwork(), 4, 2)

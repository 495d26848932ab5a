"""The exported graph computes what the policy does, and says what it is."""

import json

import numpy as np
import onnx
import onnxruntime
import pytest
import torch

from workers.config import MlpNetwork, Network, PpoConfig, ResBlockNetwork, TrainingConfig
from workers.errors import ExportError
from workers.layout import layout
from workers.manifest import Manifest, Number, Observation
from workers.networks import build_network
from workers.onnx_export import check_onnx, export_onnx
from workers.policy import Policy, torch_policy

NETWORKS: list[Network] = [ResBlockNetwork(), MlpNetwork(), MlpNetwork(hidden_sizes=(8, 4, 4), activation="tanh")]


def make_policy(network: Network) -> tuple[Policy, Manifest]:
    torch.manual_seed(0)
    module = build_network(network, 16, 2)
    manifest = Manifest(
        training=TrainingConfig(algorithm=PpoConfig(network=network)),
        seed=0,
        step=0,
        observation=Observation(
            name="improved",
            version=1,
            numbers=tuple(Number(index=i, name=f"n{i}", meaning="a number", low=-1, high=1) for i in range(16)),
        ),
        action=(),
        network=layout(network),
        evaluation=None,
        versions={},
        files={},
    )
    return Policy(network, {name: tensor.numpy() for name, tensor in module.state_dict().items()}), manifest


@pytest.mark.parametrize("network", NETWORKS, ids=repr)
def test_graph_equals_torch(network: Network) -> None:
    policy, manifest = make_policy(network)
    session = onnxruntime.InferenceSession(export_onnx(policy, manifest))
    observations = np.random.default_rng(1).normal(size=(500, 16)).astype(np.float32)
    action, velocity = session.run(["action", "velocity"], {"observation": observations})
    np.testing.assert_allclose(action, torch_policy(network, policy.weights)(observations), atol=1e-5, rtol=0)
    np.testing.assert_allclose(velocity, action * np.array([0.25, 1.0], np.float32), rtol=1e-6)


def test_graph_carries_its_manifest() -> None:
    policy, manifest = make_policy(MlpNetwork())
    model = onnx.load_model_from_string(export_onnx(policy, manifest))
    (entry,) = model.metadata_props
    assert Manifest.model_validate(json.loads(entry.value)) == manifest


def test_a_graph_that_differs_is_not_handed_out() -> None:
    policy, manifest = make_policy(MlpNetwork())
    data = export_onnx(policy, manifest)
    policy.weights["head.bias"][0] += 1e-3
    with pytest.raises(ExportError, match="do not use it"):
        check_onnx(data, policy, 16)

"""A checkpoint archive gives back what was put in, and refuses whatever is not one."""

import hashlib
import io
import json
import os
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors.numpy import load, save

from workers.checkpoints import Checkpoint, check_archive, read_checkpoint, read_manifest, read_policy, write_checkpoint
from workers.config import MlpNetwork, Network, PpoConfig, ResBlockNetwork, TrainingConfig
from workers.errors import ArchiveError, ArchiveFormatError, ArchiveIntegrityError
from workers.manifest import EvaluationSummary, Manifest, Number, Observation, TrainingCounters
from workers.networks.inputs import Inputs
from workers.networks.layout import layout, policy_shapes
from workers.networks.modules import build_network
from workers.networks.squashing import bound_actions
from workers.policy import Policy, torch_policy

NETWORKS: list[Network] = [
    ResBlockNetwork(),
    ResBlockNetwork(concatenations=False),
    MlpNetwork(),
    MlpNetwork(hidden_sizes=(8, 4), activation="tanh"),
]


def make_checkpoint(network: Network) -> Checkpoint:
    torch.manual_seed(3)
    module = build_network(network, 16, 2)
    return Checkpoint(
        manifest=Manifest(
            training=TrainingConfig(algorithm=PpoConfig(network=network)),
            seed=7,
            step=4096,
            observation=Observation(
                name="improved",
                version=1,
                numbers=tuple(Number(index=i, name=f"n{i}", meaning="a number", low=-1, high=1) for i in range(16)),
            ),
            action=(
                Number(index=0, name="linear", meaning="x 0.25 m/s", low=0, high=1),
                Number(index=1, name="angular", meaning="x 1 rad/s", low=-1, high=1),
            ),
            network=layout(network, 16),
            evaluation=EvaluationSummary(suite="simple-200", suite_hash="abc", episodes=200, arrivals=199),
            versions={"mapless": "0.1.0"},
            files={},
        ),
        weights={name: tensor.numpy() for name, tensor in module.state_dict().items()},
        arrays={"generator": np.arange(9, dtype=np.uint8), "moments": np.array([1.5, 2.5]), "count": np.array(3)},
        counters=TrainingCounters(step=4096, updates=1, evaluations=0),
    )


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    path = tmp_path / "checkpoint.zip"
    write_checkpoint(path, make_checkpoint(MlpNetwork()))
    return path


@pytest.mark.parametrize("network", NETWORKS, ids=repr)
def test_archive_gives_back_everything(tmp_path: Path, network: Network) -> None:
    written = make_checkpoint(network)
    write_checkpoint(tmp_path / "new" / "c.zip", written)
    read = read_checkpoint(tmp_path / "new" / "c.zip")
    assert read.manifest.model_copy(update={"files": {}}) == written.manifest
    assert read.counters == written.counters
    for mine, theirs in ((read.weights, written.weights), (read.arrays, written.arrays)):
        assert mine.keys() == theirs.keys()
        for name, array in mine.items():
            assert (array.dtype, array.shape) == (theirs[name].dtype, theirs[name].shape)
            np.testing.assert_array_equal(array, theirs[name])


def test_an_archive_is_compared_block_by_block_without_being_loaded(archive: Path) -> None:
    with archive.open("rb") as file:
        check_archive(file, archive.name)
    whole = archive.read_bytes()
    with zipfile.ZipFile(archive) as files:
        policy = files.getinfo("policy.safetensors").header_offset
    # What stands before the policy's file is the manifest, and of that file's own header not every bit counts.
    for place in range(policy + 100, len(whole), 997):
        data = bytearray(whole)
        data[place] ^= 4
        with pytest.raises(ArchiveError):
            check_archive(io.BytesIO(data), archive.name)


def test_same_content_gives_same_bytes(tmp_path: Path, archive: Path) -> None:
    write_checkpoint(tmp_path / "again.zip", make_checkpoint(MlpNetwork()))
    assert archive.read_bytes() == (tmp_path / "again.zip").read_bytes()


@pytest.mark.parametrize("network", NETWORKS, ids=repr)
def test_numpy_and_torch_runners_agree(tmp_path: Path, network: Network) -> None:
    write_checkpoint(tmp_path / "c.zip", make_checkpoint(network))
    _, policy = read_policy(tmp_path / "c.zip")
    observations = np.random.default_rng(0).normal(size=(1000, 16)).astype(np.float32) * 3
    actions = policy(observations)
    assert actions.shape == (1000, 2)
    assert actions.dtype == np.float32
    np.testing.assert_allclose(actions, torch_policy(policy)(observations), atol=1e-5, rtol=0)
    torch.manual_seed(3)
    module = build_network(network, 16, 2)
    expected = bound_actions(module(torch.from_numpy(observations))).detach().numpy()
    np.testing.assert_allclose(actions, expected, atol=1e-5, rtol=0)


@pytest.mark.parametrize("network", NETWORKS, ids=repr)
def test_documented_shapes_are_the_networks(network: Network) -> None:
    module = build_network(network, 16, 2)
    assert policy_shapes(network, Inputs(16)) == {name: tuple(tensor.shape) for name, tensor in module.state_dict().items()}


def test_a_stranger_can_run_the_policy_from_what_the_archive_says(archive: Path) -> None:
    """As a reader of the manifest would: zipfile, json, safetensors, NumPy, and none of this project's code."""
    with zipfile.ZipFile(archive) as file:
        manifest = json.loads(file.read("manifest.json"))
        weights = load(file.read("policy.safetensors"))
    assert manifest["network"]["formula"][:2] == ["x = relu(layers.0(x))", "x = relu(layers.1(x))"]
    observation = np.linspace(-1, 1, 16, dtype=np.float32)
    x = observation
    for layer in manifest["network"]["layers"]:
        x = weights[f"{layer}.weight"] @ x + weights[f"{layer}.bias"]
        if layer != "head":
            x = np.maximum(x, 0)
    expected = [1 / (1 + np.exp(-x[0])), np.tanh(x[1])]
    _, policy = read_policy(archive)
    np.testing.assert_allclose(policy(observation[None])[0], expected, atol=1e-6)


def test_policy_only_archive_runs_and_says_that_it_cannot_resume(tmp_path: Path, archive: Path) -> None:
    rewrite(archive, lambda files: [files.pop(name) for name in ("state.safetensors", "state.json")])
    assert isinstance(read_policy(archive)[1], Policy)
    with pytest.raises(ArchiveIntegrityError, match="cannot be resumed"):
        read_checkpoint(archive)


def rewrite(archive: Path, change: Callable[[dict[str, bytes]], object], compression: int = zipfile.ZIP_STORED) -> None:
    with zipfile.ZipFile(archive) as file:
        files = {name: file.read(name) for name in file.namelist()}
    change(files)
    with zipfile.ZipFile(archive, "w", compression) as file:
        for name, data in files.items():
            file.writestr(name, data)


def put_policy(files: dict[str, bytes], weights: dict[str, np.ndarray]) -> None:
    """Replaces the policy and tells the manifest, as a forger would."""
    files["policy.safetensors"] = save(weights)
    manifest = json.loads(files["manifest.json"])
    entry = manifest["files"]["policy.safetensors"]
    entry["sha256"] = hashlib.sha256(files["policy.safetensors"]).hexdigest()
    entry["size"] = len(files["policy.safetensors"])
    files["manifest.json"] = json.dumps(manifest).encode()


def test_changed_weights_are_refused(archive: Path) -> None:
    def flip(files: dict[str, bytes]) -> None:
        data = bytearray(files["policy.safetensors"])
        data[-1] ^= 1
        files["policy.safetensors"] = bytes(data)

    rewrite(archive, flip)
    with pytest.raises(ArchiveIntegrityError, match="not the file that the manifest describes"):
        read_policy(archive)
    assert read_manifest(archive).seed == 7


def test_weights_of_another_network_are_refused(archive: Path) -> None:
    rewrite(archive, lambda files: put_policy(files, {"head.weight": np.zeros((2, 16), np.float32)}))
    with pytest.raises(ArchiveIntegrityError, match="arrays of its network"):
        read_policy(archive)


def test_weights_that_are_not_safetensors_are_refused(archive: Path) -> None:
    def put(files: dict[str, bytes]) -> None:
        put_policy(files, {})
        files["policy.safetensors"] = os.urandom(64)
        manifest = json.loads(files["manifest.json"])
        manifest["files"]["policy.safetensors"] = {
            "sha256": hashlib.sha256(files["policy.safetensors"]).hexdigest(),
            "size": 64,
        }
        files["manifest.json"] = json.dumps(manifest).encode()

    rewrite(archive, put)
    with pytest.raises(ArchiveIntegrityError, match="not a safetensors file"):
        read_policy(archive)


@pytest.mark.parametrize("name", ["../escape", "/etc/passwd", "policy.pkl"])
def test_foreign_members_are_refused(archive: Path, name: str) -> None:
    rewrite(archive, lambda files: files.update({name: b"x"}))
    with pytest.raises(ArchiveFormatError, match="nothing else"):
        read_policy(archive)


def test_archive_without_manifest_is_refused(archive: Path) -> None:
    rewrite(archive, lambda files: files.pop("manifest.json"))
    with pytest.raises(ArchiveFormatError):
        read_manifest(archive)


def test_compressed_members_are_refused(archive: Path) -> None:
    """So that nothing can inflate: 100 MB of zeros would be 100 kB here."""
    rewrite(archive, lambda files: files.update({"state.safetensors": bytes(10**8)}), zipfile.ZIP_DEFLATED)
    assert archive.stat().st_size < 10**6
    with pytest.raises(ArchiveFormatError, match="compressed"):
        read_policy(archive)


def test_oversized_members_are_refused(archive: Path) -> None:
    rewrite(archive, lambda files: files.update({"state.json": b" " * 70_000}))
    with pytest.raises(ArchiveFormatError, match="70000 bytes"):
        read_policy(archive)


def test_manifest_of_a_newer_version_is_refused(archive: Path) -> None:
    def age(files: dict[str, bytes]) -> None:
        files["manifest.json"] = files["manifest.json"].replace(b'"version": 1', b'"version": 2')

    rewrite(archive, age)
    with pytest.raises(ArchiveFormatError, match="newer release"):
        read_manifest(archive)


def test_what_is_no_archive_is_refused(tmp_path: Path, archive: Path) -> None:
    torn = tmp_path / "torn.zip"
    torn.write_bytes(archive.read_bytes()[:1000])
    with pytest.raises(ArchiveFormatError, match="download it again"):
        read_manifest(torn)

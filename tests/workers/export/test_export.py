"""An exported policy computes what was trained, in every form that leaves the house, or it does not leave."""

import io
import json
import subprocess
import sys
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import onnx
import pytest
import typer
from typer.testing import CliRunner

from sim.actions import action_layout
from sim.config import (
    ActionsPart,
    BearingPart,
    BurgerConfig,
    DifferentialDrive,
    DoubleMount,
    DwellPart,
    JackalConfig,
    KnownPart,
    LidarConfig,
    ObservationConfig,
    OpeningsPart,
    RacecarConfig,
    RangesPart,
    ReachPart,
    RidgebackConfig,
    SpeedsPart,
    TaskConfig,
    TrailPart,
    WayPart,
)
from workers.checkpoints import read_policy
from workers.config import ConvNetwork, GruNetwork, MlpNetwork, Network, ResBlockNetwork
from workers.errors import ArchiveFormatError, ExportError
from workers.export.bundle import bundle, export_checkpoint
from workers.export.check import check_export, run_graph
from workers.export.command import export as export_command
from workers.export.graph import observation_graph
from workers.export.readme import readme
from workers.export.ros2.mapless_navigator.policy import Policy, PolicyFileError, read_safetensors
from workers.manifest import Manifest
from workers.policy import torch_policy

NETWORKS: list[Network] = [ResBlockNetwork(), MlpNetwork(), MlpNetwork(hidden_sizes=(8, 4, 4), activation="tanh")]
TWO = DoubleMount(x=0.2, y=0.1, yaw=30.0, second_x=-0.2, second_y=-0.1, second_yaw=-150.0)
TASKS = [
    TaskConfig(),
    TaskConfig(observation=ObservationConfig.preset("paper")),
    TaskConfig(
        lidar=LidarConfig(rays=24, field_of_view=360.0, range=5.0),
        observation=ObservationConfig.preset("improved", batches=24),
        robot=BurgerConfig(max_linear_speed=0.5, max_angular_speed=2.5),
    ),
    TaskConfig(observation=ObservationConfig.preset("improved", frames=3)),
    TaskConfig(robot=BurgerConfig(drive=DifferentialDrive(reverse=0.4))),
    TaskConfig(robot=RidgebackConfig()),
    TaskConfig(robot=RacecarConfig(), observation=ObservationConfig.preset("improved", frames=2)),
    TaskConfig(
        robot=JackalConfig(),
        lidar=LidarConfig(rays=12, mount=TWO),
        observation=ObservationConfig.preset("improved", batches=6),
    ),
    TaskConfig(
        observation=ObservationConfig(
            parts=(
                BearingPart(encoding="sine_cosine", frames=2),
                RangesPart(batches=30, inverse=False, frames=3),
                ActionsPart(frames=4),
            )
        )
    ),
    TaskConfig(observation=ObservationConfig(parts=(SpeedsPart(), RangesPart()))),
    TaskConfig(observation=ObservationConfig(parts=(RangesPart(), BearingPart(), TrailPart(sectors=8, frames=2)))),
    TaskConfig(observation=ObservationConfig(parts=(RangesPart(), BearingPart(), TrailPart(sectors=8, memory="long")))),
    TaskConfig(
        robot=JackalConfig(),
        lidar=LidarConfig(rays=12, mount=TWO),
        observation=ObservationConfig(parts=(SpeedsPart(), RangesPart(batches=6), WayPart(frames=2))),
    ),
    TaskConfig(
        robot=JackalConfig(),
        lidar=LidarConfig(rays=12, mount=TWO),
        observation=ObservationConfig(parts=(ReachPart(sectors=6, frames=2),)),
    ),
    TaskConfig(
        robot=JackalConfig(),
        lidar=LidarConfig(rays=12, mount=TWO),
        observation=ObservationConfig(parts=(ReachPart(sectors=6, progress=True, frames=2), BearingPart())),
    ),
    TaskConfig(observation=ObservationConfig(parts=(RangesPart(), TrailPart(sectors=8), KnownPart(sectors=8, frames=2)))),
    TaskConfig(observation=ObservationConfig(parts=(RangesPart(), KnownPart(sectors=8, progress=True)))),
    TaskConfig(observation=ObservationConfig(parts=(RangesPart(), OpeningsPart(count=3, frames=2), DwellPart(frames=2)))),
]


@pytest.mark.parametrize("network", NETWORKS, ids=repr)
@pytest.mark.parametrize(
    "task",
    TASKS,
    ids=[
        "improved",
        "paper",
        "full circle",
        "stacked",
        "reverse",
        "omnidirectional",
        "ackermann",
        "two LiDARs",
        "parts",
        "no target",
        "trail",
        "long trail",
        "way",
        "reach",
        "reach with progress",
        "known",
        "known with progress",
        "openings",
    ],
)
def test_every_form_equals_torch(make_checkpoint: Callable[..., Path], network: Network, task: TaskConfig) -> None:
    archive = make_checkpoint(network, task)
    exported = export_checkpoint(archive)

    assert exported.report.policy_difference <= 1e-5
    assert exported.report.observation_difference <= 1e-5
    _, policy = read_policy(archive)
    size = len(exported.manifest.observation.numbers)
    observations = np.random.default_rng(1).normal(size=(300, size)).astype(np.float32)
    expected = torch_policy(policy)(observations)
    found = run_graph(exported.by_observation, {"observation": observations})
    np.testing.assert_allclose(found["action"], expected, rtol=0, atol=1e-5)
    limits = np.array(action_layout(task.robot).limits, np.float32)
    assert exported.specification.action_limits == pytest.approx(limits)
    assert exported.specification.action_lows == action_layout(task.robot).lows
    np.testing.assert_allclose(found["velocity"], expected * limits, rtol=0, atol=1e-5)


def test_the_bundle_says_which_body_the_policy_was_trained_for(make_checkpoint: Callable[..., Path]) -> None:
    for robot, words in (
        (BurgerConfig(), "A differential-drive robot with a round body of radius 0.105 m"),
        (BurgerConfig(drive=DifferentialDrive(reverse=0.5)), "0.125 m/s backwards"),
        (JackalConfig(), "0.508 m long and 0.43 m wide"),
        (RidgebackConfig(), "An omnidirectional robot"),
        (RacecarConfig(), "axles 0.3302 m apart"),
    ):
        exported = export_checkpoint(make_checkpoint(task=TaskConfig(robot=robot)))
        assert words in readme(exported.manifest, exported.specification, exported.report)


def test_velocities_stay_within_the_limits_whatever_comes_in(make_checkpoint: Callable[..., Path]) -> None:
    exported = export_checkpoint(make_checkpoint())
    wild = np.random.default_rng(2).normal(scale=1e6, size=(500, 16)).astype(np.float32)
    velocity = run_graph(exported.by_observation, {"observation": wild})["velocity"]
    assert velocity.min(axis=0)[0] >= 0.0
    assert velocity.max(axis=0)[0] <= np.float32(0.25)
    assert np.abs(velocity[:, 1]).max() <= 1.0


def test_graph_carries_its_manifest(make_checkpoint: Callable[..., Path]) -> None:
    exported = export_checkpoint(make_checkpoint())
    (entry,) = onnx.load_model_from_string(exported.by_scan).metadata_props
    assert Manifest.model_validate_json(entry.value) == exported.manifest


def test_an_export_that_differs_is_refused(make_checkpoint: Callable[..., Path]) -> None:
    exported = export_checkpoint(make_checkpoint())
    manifest, policy = read_policy(make_checkpoint())
    trained = torch_policy(policy)
    shipped = Policy(exported.specification, read_safetensors(exported.weights))
    policy.weights["head.bias"] = policy.weights["head.bias"] + np.float32(1e-3)
    wrong = observation_graph(policy, exported.specification, manifest)
    with pytest.raises(ExportError, match="do not use it"):
        check_export(trained, shipped, manifest, wrong, exported.by_scan)


def test_an_export_that_is_not_a_number_is_refused(make_checkpoint: Callable[..., Path]) -> None:
    exported = export_checkpoint(make_checkpoint())
    manifest, policy = read_policy(make_checkpoint())
    shipped = Policy(exported.specification, read_safetensors(exported.weights))
    policy.weights["head.bias"] = np.full_like(policy.weights["head.bias"], np.nan)
    broken = observation_graph(policy, exported.specification, manifest)
    with pytest.raises(ExportError, match="nan off"):
        check_export(torch_policy(policy), shipped, manifest, broken, exported.by_scan)


def unpack(archive: Path, directory: Path) -> Path:
    with zipfile.ZipFile(io.BytesIO(bundle(export_checkpoint(archive)))) as zipped:
        zipped.extractall(directory)
    return directory / "mapless-policy"


@pytest.fixture
def unpacked(make_checkpoint: Callable[..., Path], tmp_path: Path) -> Path:
    return unpack(make_checkpoint(ResBlockNetwork()), tmp_path)


def test_the_same_checkpoint_gives_the_same_bundle(make_checkpoint: Callable[..., Path]) -> None:
    archive = make_checkpoint()
    assert bundle(export_checkpoint(archive)) == bundle(export_checkpoint(archive))


@pytest.mark.parametrize("network", [ResBlockNetwork(), ConvNetwork(), GruNetwork(units=8)], ids=lambda one: str(one.name))
@pytest.mark.parametrize(
    "observation",
    [
        ObservationConfig.preset("improved"),
        ObservationConfig.preset("improved", frames=4),
        ObservationConfig(parts=(RangesPart(), BearingPart(), TrailPart())),
        ObservationConfig(parts=(RangesPart(), BearingPart(), TrailPart(memory="long"))),
        ObservationConfig(parts=(RangesPart(), TrailPart(), KnownPart(sectors=8))),
        ObservationConfig(parts=(RangesPart(), ReachPart(progress=True), KnownPart(sectors=8, progress=True))),
        ObservationConfig(parts=(RangesPart(), TrailPart(), OpeningsPart(), DwellPart())),
    ],
    ids=["one moment", "four moments", "trail", "long trail", "known", "progress", "openings"],
)
def test_readme_examples_run_and_agree(
    make_checkpoint: Callable[..., Path], tmp_path: Path, network: Network, observation: ObservationConfig
) -> None:
    unpacked = unpack(make_checkpoint(network, TaskConfig(observation=observation)), tmp_path)
    readme = (unpacked / "README.md").read_text()
    assert ("`next_memory`" in readme) == isinstance(network, GruNetwork)
    numpy_example, onnx_example = (part.split("```")[0] for part in readme.split("```python\n")[1:])

    said = [
        subprocess.run(
            [sys.executable, "-I", "-c", example], cwd=unpacked, capture_output=True, text=True, check=True
        ).stdout
        for example in (numpy_example, onnx_example)
    ]
    assert said[0] == said[1]
    assert "m/s" in said[0]


def test_numpy_runner_is_one_file_that_needs_numpy_only(unpacked: Path, tmp_path: Path) -> None:
    alone = tmp_path / "alone"
    alone.mkdir()
    (unpacked / "run_policy.py").rename(alone / "run_policy.py")
    program = (
        "import sys, json; sys.path.insert(0, '.'); import numpy as np; from run_policy import Policy; "
        f"policy = Policy.load({str(unpacked / 'policy')!r}); "
        "print(json.dumps(policy.velocities(np.full((2, 16), 0.5, np.float32)).tolist())); "
        "print(sorted(m for m in sys.modules if m.split('.')[0] in ('torch', 'onnx', 'safetensors', 'workers', 'sim')))"
    )
    run = subprocess.run([sys.executable, "-I", "-c", program], cwd=alone, capture_output=True, text=True, check=True)
    velocities, imported = run.stdout.splitlines()
    assert imported == "[]"
    expected = run_graph((unpacked / "policy.onnx").read_bytes(), {"observation": np.full((2, 16), 0.5, np.float32)})
    np.testing.assert_allclose(json.loads(velocities), expected["velocity"], rtol=0, atol=1e-6)


def test_damaged_weights_are_refused(unpacked: Path) -> None:
    weights = unpacked / "policy" / "policy.safetensors"
    weights.write_bytes(weights.read_bytes()[:-4] + b"\0\0\0\1")
    with pytest.raises(PolicyFileError, match="does not belong"):
        Policy.load(unpacked / "policy")


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"\x02\0\0\0\0\0\0\0[]",
        b"\xff" * 16,
        (48).to_bytes(8, "little") + b'{"a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]}}'[:48],
        (53).to_bytes(8, "little") + b'{"a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]}}' + b"1234",
        (53).to_bytes(8, "little") + b'{"a":{"dtype":"F64","shape":[1],"data_offsets":[0,8]}}' + b"12345678",
    ],
)
def test_what_is_not_a_float32_safetensors_file_is_refused(data: bytes) -> None:
    with pytest.raises(PolicyFileError):
        read_safetensors(data)


def test_a_specification_of_another_version_is_refused(unpacked: Path) -> None:
    path = unpacked / "policy" / "policy.json"
    path.write_text(path.read_text().replace('"kind": "inverse_ranges"', '"kind": "smells"'))
    with pytest.raises(PolicyFileError, match="another version"):
        Policy.load(unpacked / "policy")


def test_shipped_code_is_of_the_oldest_python_that_a_supported_ros_has() -> None:
    import ast

    from workers.export.bundle import ROS2_PACKAGE

    for path in ROS2_PACKAGE.rglob("*.py"):
        ast.parse(path.read_text(), feature_version=(3, 10))


def command_line() -> typer.Typer:
    app = typer.Typer()
    app.command()(export_command)
    return app


@pytest.mark.parametrize(("name", "file"), [("onnx", "c.onnx"), ("onnx-scan", "c-scan.onnx"), ("bundle", "c-bundle.zip")])
def test_command_writes_beside_the_checkpoint(make_checkpoint: Callable[..., Path], name: str, file: str) -> None:
    archive = make_checkpoint()
    archive = archive.rename(archive.with_name("c.zip"))
    result = CliRunner().invoke(command_line(), [str(archive), "--format", name])
    assert result.exit_code == 0, result.output
    assert "equal to torch within" in result.output
    assert archive.with_name(file).stat().st_size > 1000


def test_command_refuses_what_is_no_checkpoint(tmp_path: Path) -> None:
    (tmp_path / "c.zip").write_bytes(b"no")
    result = CliRunner().invoke(command_line(), [str(tmp_path / "c.zip")])
    assert result.exit_code == 1
    assert "not a readable archive" in result.output
    with pytest.raises(ArchiveFormatError):
        export_checkpoint(tmp_path / "c.zip")

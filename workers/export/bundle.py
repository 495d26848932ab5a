"""The deployment bundle: one .zip that holds all that it takes to drive a robot with a policy."""

import io
import json
import zipfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path

from workers.checkpoints import read_policy
from workers.export.check import CheckReport, check_export
from workers.export.graph import observation_graph, scan_graph
from workers.export.readme import readme
from workers.export.ros2.mapless_navigator.navigator import Safety
from workers.export.ros2.mapless_navigator.policy import (
    GRAPH,
    SPECIFICATION,
    WEIGHTS,
    Specification,
    read_safetensors,
)
from workers.export.ros2.mapless_navigator.policy import Policy as ShippedPolicy
from workers.export.specification import pack_weights, specify
from workers.manifest import MANIFEST, Manifest
from workers.policy import torch_policy

ROS2_PACKAGE = Path(__file__).parent / "ros2"
_ROOT = "mapless-policy"
_PACKAGE = f"{_ROOT}/ros2/mapless_navigator"
_SHIPPED = (".py", ".xml", ".cfg", "")

# The same checkpoint gives the same bytes, whenever it is exported.
_TIMESTAMP = (1980, 1, 1, 0, 0, 0)


@dataclass(frozen=True)
class Export:
    """A policy in every form that leaves the house, checked.

    Attributes:
        manifest: the checkpoint's.
        specification: `policy.json`.
        weights: `policy.safetensors`.
        by_observation: the ONNX graph on observations.
        by_scan: the ONNX graph on what the observation is made of: scan, pose, target and so on.
        report: what the check found.
    """

    manifest: Manifest
    specification: Specification
    weights: bytes
    by_observation: bytes
    by_scan: bytes
    report: CheckReport


def export_checkpoint(archive: Path) -> Export:
    """Exports an archive's policy and compares it with torch.

    Raises:
        ArchiveError: it is not a checkpoint, or it is damaged.
        ExportError: the export does not compute what was trained.
    """
    manifest, policy = read_policy(archive)
    weights = pack_weights(policy.weights)
    specification = specify(manifest, policy.description, weights)
    by_observation = observation_graph(policy, specification, manifest)
    by_scan = scan_graph(policy, specification, manifest)
    shipped = ShippedPolicy(specification, read_safetensors(weights), by_observation)
    trained = torch_policy(policy)
    report = check_export(trained, shipped, manifest, by_observation, by_scan)
    return Export(manifest, specification, weights, by_observation, by_scan, report)


def bundle(export: Export) -> bytes:
    """The deployment bundle as a .zip."""
    specification = json.dumps(asdict(export.specification), indent=2).encode()
    files: dict[str, bytes] = {
        f"{_ROOT}/README.md": readme(export.manifest, export.specification, export.report).encode(),
        f"{_ROOT}/{MANIFEST}": export.manifest.model_dump_json(indent=2).encode(),
        f"{_ROOT}/policy.onnx": export.by_observation,
        f"{_ROOT}/policy_from_scan.onnx": export.by_scan,
        f"{_ROOT}/run_policy.py": (ROS2_PACKAGE / "mapless_navigator" / "policy.py").read_bytes(),
        f"{_PACKAGE}/config/navigator.yaml": _parameters(Safety.of(export.specification)).encode(),
    }
    for directory in (f"{_ROOT}/policy", f"{_PACKAGE}/policy"):
        files |= {f"{directory}/{SPECIFICATION}": specification, f"{directory}/{WEIGHTS}": export.weights}
        if not export.specification.formula:
            files[f"{directory}/{GRAPH}"] = export.by_observation
    for path in ROS2_PACKAGE.rglob("*"):
        if path.is_file() and path.suffix in _SHIPPED:
            files[f"{_PACKAGE}/{path.relative_to(ROS2_PACKAGE).as_posix()}"] = path.read_bytes()
    return _zip(files)


def _parameters(safety: Safety) -> str:
    """The node's parameters with the policy's own values, for people to change."""
    lines = [f"    {name}: {float(value):.4g}" for name, value in vars(safety).items()]
    numbers = "\n".join(line if "." in line or "e" in line.split(": ")[1] else f"{line}.0" for line in lines)
    return (
        "# Lengths in metres, angles in radians, times in seconds; mapless_navigator/navigator.py says what each one does.\n"
        f"mapless_navigator:\n  ros__parameters:\n    stamped_twist: true\n    measured_speeds: true\n{numbers}\n"
    )


def _zip(files: Mapping[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name in sorted(files):
            info = zipfile.ZipInfo(name, _TIMESTAMP)
            info.compress_type = zipfile.ZIP_DEFLATED
            info.external_attr = 0o644 << 16
            archive.writestr(info, files[name])
    return buffer.getvalue()

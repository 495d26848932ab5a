"""Compares what is exported with what was trained, before anybody gets it."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from workers.errors import ExportError
from workers.export.graph import LAST_ACTION, POSE, PREVIOUS, RANGES, SPEEDS, TARGET, VELOCITY, scan_inputs
from workers.export.names import ACTION, MEMORY, NEXT_MEMORY, OBSERVATION
from workers.export.ros2.mapless_navigator.observation import observe
from workers.export.ros2.mapless_navigator.policy import Policy as ShippedPolicy
from workers.manifest import Manifest
from workers.onnx_runtime import session
from workers.policy import TorchPolicy

TOLERANCE = 1e-5
_ROWS = 1000

Floats = NDArray[np.float32]


@dataclass(frozen=True)
class CheckReport:
    """How far an export is from what was trained; both are at most `TOLERANCE`."""

    rows: int
    policy_difference: float
    observation_difference: float


def check_export(
    trained: TorchPolicy, shipped: ShippedPolicy, manifest: Manifest, by_observation: bytes, by_scan: bytes
) -> CheckReport:
    """Compares both ONNX graphs and the NumPy runner with a trained policy over random observations and random scenes.

    Args:
        trained: the policy as it was trained, by torch.
        shipped: the same as the bundle's own code read it.
        manifest: the checkpoint's.
        by_observation: the ONNX graph on observations.
        by_scan: the ONNX graph on what the observation is made of.

    Raises:
        ExportError: an observation or an action differs by more than `TOLERANCE`.
    """
    rng = np.random.default_rng(0)
    numbers = manifest.observation.numbers
    low, high = np.array([number.low for number in numbers]), np.array([number.high for number in numbers])
    observations = rng.uniform(low, high, (_ROWS, len(numbers))).astype(np.float32)
    remembered = rng.uniform(-1.0, 1.0, (_ROWS, trained.memory_size)).astype(np.float32)
    memory = {MEMORY: remembered} if trained.memory_size else {}
    graph = run_graph(by_observation, {OBSERVATION: observations, **memory})
    expected, following = trained.step(observations, remembered)
    ran, ran_following = shipped.step(observations, remembered)
    limits = np.array(shipped.specification.action_limits)

    scene = _scene(rng, shipped)
    by_scene = run_graph(by_scan, {name: scene[name] for name in scan_inputs(shipped.specification)} | memory)
    seen = observe(
        shipped.specification, scene[RANGES], scene[POSE], scene[TARGET], scene[LAST_ACTION], scene[SPEEDS],
        added={part.kind: scene[part.kind] for part in shipped.specification.parts if part.brought},
    )  # fmt: skip
    seen = np.concatenate((seen, scene[PREVIOUS]), axis=1)
    policy_difference = max(
        _difference(graph[ACTION], expected, "the ONNX graph's actions"),
        _difference(graph[VELOCITY] / limits, expected, "the ONNX graph's velocities, as fractions of their limits,"),
        _difference(ran, expected, "the NumPy runner's actions"),
        # On its own observation: how far that one is off is the next line's business.
        _difference(by_scene[ACTION], trained.step(by_scene[OBSERVATION], remembered)[0], "the scan graph's actions"),
    )
    if trained.memory_size:
        _difference(graph[NEXT_MEMORY], following, "the ONNX graph's memories")
        _difference(ran_following, following, "the NumPy runner's memories")
    return CheckReport(_ROWS, policy_difference, _difference(by_scene[OBSERVATION], seen, "the scan graph's observations"))


def run_graph(model: bytes, inputs: Mapping[str, Floats]) -> dict[str, Floats]:
    """All outputs of an ONNX file by name, computed by onnxruntime on one thread."""
    runs = session(model)
    names = [output.name for output in runs.get_outputs()]
    return dict(zip(names, runs.run(names, dict(inputs)), strict=True))


def _scene(rng: np.random.Generator, shipped: ShippedPolicy) -> dict[str, Floats]:
    """Random robots: scans up to twice the range, poses with headings of several turns, targets all round."""
    specification = shipped.specification
    half = specification.diagonal / np.sqrt(8.0)
    scene = {
        RANGES: rng.uniform(0.0, 2.0 * specification.range, (_ROWS, specification.scan_size)),
        POSE: rng.uniform((-half, -half, -7.0), (half, half, 7.0), (_ROWS, 3)),
        TARGET: rng.uniform(-half, half, (_ROWS, 2)),
        LAST_ACTION: rng.uniform(specification.action_lows, 1.0, (_ROWS, len(specification.action_limits))),
        SPEEDS: rng.uniform(specification.action_lows, 1.0, (_ROWS, len(specification.action_limits))),
        PREVIOUS: rng.uniform(0.0, 1.0, (_ROWS, len(specification.carried))),
    }
    # Only now, so that what is drawn before them is what it is without them.
    scene |= {part.kind: rng.uniform(-1.0, 1.0, (_ROWS, part.size)) for part in specification.parts if part.brought}
    cast = {name: values.astype(np.float32) for name, values in scene.items()}
    cast[RANGES] = np.minimum(cast[RANGES], np.float32(specification.range))
    return cast


def _difference(found: NDArray[np.floating], expected: Floats, what: str) -> float:
    difference = float(np.abs(found - expected).max())
    # Written so that nan fails too.
    if not difference <= TOLERANCE:
        raise ExportError(
            f"{what} are up to {difference:.1e} off, more than {TOLERANCE:.0e}: do not use it, and report this"
        )
    return difference

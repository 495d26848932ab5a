"""Runs an exported policy with NumPy alone: weights from a safetensors file, observations in, velocities out.

A policy is a directory with two files: `policy.json`, which says what it is (`Specification`), and `policy.safetensors`, its
weights. This file needs nothing else, so that it can be copied into any program:

    policy = Policy.load("policy")
    linear, angular = policy.velocities(observations)[0]     # observations (n, size) float32; m/s and rad/s
"""

import hashlib
import json
import math
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

SPECIFICATION = "policy.json"
WEIGHTS = "policy.safetensors"
_LEAKY_SLOPE = np.float32(0.01)


class PolicyFileError(ValueError):
    """A policy's files are missing, damaged, or of a version that this file does not know."""


@dataclass(frozen=True)
class Specification:
    """What it takes to run a policy on a robot; lengths in metres, angles in radians, times in seconds.

    Attributes:
        format, version: of this specification.
        observation: layout of the observation, 'improved' or 'paper'.
        observation_version: version of that layout.
        rays: rays of a scan.
        batches: numbers that they become, each the minimum of rays / batches neighbours.
        frames: observations of the latest steps that the policy sees at once.
        field_of_view: of the scan, symmetric about the heading.
        range: what a ray without a hit reads.
        near: distance at which the inverse range of 'improved' reaches 1.
        diagonal: of the arena; the distance to the target is divided by it in 'paper'.
        max_linear_speed: metres per second for action 1.
        max_angular_speed: radians per second for action 1, positive to the left.
        control_period: between two actions.
        arrival_distance: to the target, that counted as arrived.
        collision_distance: a shorter ray was a collision.
        robot_radius: of the largest disc within the robot's body: its radius if it is round.
        robot_length, robot_width: of the body if it is rectangular, about the LiDAR; 0 if it is round.
        network: 'mlp' or 'resblock'.
        layers: prefixes of the arrays '<prefix>.weight' (outputs, inputs) and '<prefix>.bias' (outputs,), in order.
        activation: of the hidden layers, 'relu', 'tanh' or 'leaky_relu'.
        weights_sha256: of `policy.safetensors`.
    """

    format: str
    version: int
    observation: str
    observation_version: int
    rays: int
    batches: int
    frames: int
    field_of_view: float
    range: float
    near: float
    diagonal: float
    max_linear_speed: float
    max_angular_speed: float
    control_period: float
    arrival_distance: float
    collision_distance: float
    robot_radius: float
    robot_length: float
    robot_width: float
    network: str
    layers: tuple[str, ...]
    activation: str
    weights_sha256: str

    @property
    def frame_size(self) -> int:
        """Numbers of one moment: the batches, two velocities, and four of the target."""
        return self.batches + 6

    @property
    def observation_size(self) -> int:
        """Numbers in an observation: all frames."""
        return self.frames * self.frame_size

    @classmethod
    def load(cls, path: Path) -> "Specification":
        """Read `policy.json`.

        Raises:
            PolicyFileError: it is missing, or not one that this file knows.
        """
        try:
            values = json.loads(path.read_text(encoding="utf-8"))
            values["layers"] = tuple(values["layers"])
            specification = cls(**{field.name: values[field.name] for field in fields(cls)})
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise PolicyFileError(f"{path} is not a policy's specification ({error!r}): export the policy again") from error
        known = ("mapless-deployment", 2), ("improved", "paper"), ("mlp", "resblock"), ("relu", "tanh", "leaky_relu")
        if (
            (specification.format, specification.version) != known[0]
            or (specification.observation not in known[1] or specification.observation_version != 1)
            or (specification.network not in known[2] or specification.activation not in known[3])
        ):
            raise PolicyFileError(f"{path} is of another version than this program: use the program of the same bundle")
        return specification


class Policy:
    """A deterministic policy.

    Args:
        specification: what it is.
        weights: its arrays by name.
    """

    def __init__(self, specification: Specification, weights: dict[str, Floats]) -> None:
        self.specification = specification
        self._layers = [(weights[f"{name}.weight"].T, weights[f"{name}.bias"]) for name in specification.layers]
        self._limits = np.array([specification.max_linear_speed, specification.max_angular_speed], np.float32)

    @classmethod
    def load(cls, directory: str | Path) -> "Policy":
        """Read a policy's directory.

        Raises:
            PolicyFileError: a file is missing or damaged, or of a version that this file does not know.
        """
        specification = Specification.load(Path(directory) / SPECIFICATION)
        path = Path(directory) / WEIGHTS
        try:
            data = path.read_bytes()
        except OSError as error:
            raise PolicyFileError(f"{path} can't be read ({error.strerror}): unpack the bundle again") from error
        if hashlib.sha256(data).hexdigest() != specification.weights_sha256:
            raise PolicyFileError(f"{path} does not belong to {SPECIFICATION}: unpack the bundle again")
        return cls(specification, read_safetensors(data))

    def actions(self, observations: Floats) -> Floats:
        """Observations (n, size) to actions (n, 2): fractions of the speed limits, in [0, 1] and [-1, 1]."""
        outputs = self._resblock(observations) if self.specification.network == "resblock" else self._mlp(observations)
        # A sigmoid as a tanh, which does not overflow.
        linear = np.float32(0.5) * (np.float32(1.0) + np.tanh(np.float32(0.5) * outputs[:, :1]))
        return np.concatenate((linear, np.tanh(outputs[:, 1:])), axis=1)

    def velocities(self, observations: Floats) -> Floats:
        """Observations (n, size) to velocities (n, 2): m/s forwards and rad/s to the left, within the policy's limits."""
        return self.actions(observations) * self._limits

    def _mlp(self, values: Floats) -> Floats:
        activate = _relu if self.specification.activation == "relu" else np.tanh
        *hidden, (weight, bias) = self._layers
        for hidden_weight, hidden_bias in hidden:
            values = activate(values @ hidden_weight + hidden_bias)
        return values @ weight + bias

    def _resblock(self, inputs: Floats) -> Floats:
        (w1, b1), (w2, b2), (w3, b3), (w4, b4), (weight, bias) = self._layers
        first = _leaky_relu(np.concatenate((_leaky_relu(inputs @ w1 + b1) @ w2 + b2, inputs), axis=1))
        hidden = _leaky_relu(_leaky_relu(first @ w3 + b3) @ w4 + b4)
        return _leaky_relu(np.concatenate((hidden, first), axis=1)) @ weight + bias


def _relu(values: Floats) -> Floats:
    return np.maximum(values, np.float32(0.0))


def _leaky_relu(values: Floats) -> Floats:
    leaky: Floats = np.maximum(values, _LEAKY_SLOPE * values)
    return leaky


def read_safetensors(data: bytes) -> dict[str, Floats]:
    """The float32 arrays of a safetensors file: 8 bytes header length, a JSON header, then the arrays' bytes.

    Raises:
        PolicyFileError: it is not such a file, or holds anything but float32.
    """
    try:
        length = int.from_bytes(data[:8], "little")
        header = json.loads(data[8 : 8 + length])
        header.pop("__metadata__", None)
        body = data[8 + length :]
        arrays = {}
        for name, entry in header.items():
            start, end = entry["data_offsets"]
            shape = tuple(entry["shape"])
            if entry["dtype"] != "F32" or not 0 <= start <= end <= len(body) or end - start != 4 * math.prod(shape):
                raise PolicyFileError(f"{WEIGHTS}: {name} is not a float32 array of shape {shape}")
            arrays[name] = np.frombuffer(body[start:end], "<f4").astype(np.float32).reshape(shape)
    except PolicyFileError:
        raise
    except (ValueError, KeyError, TypeError, AttributeError) as error:
        raise PolicyFileError(f"{WEIGHTS} is not a safetensors file ({error!r}): unpack the bundle again") from error
    return arrays

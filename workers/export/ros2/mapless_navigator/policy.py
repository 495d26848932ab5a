"""Runs an exported policy with NumPy alone: weights from a safetensors file, observations in, commands out.

A policy is a directory with two files: `policy.json`, which says what it is (`Specification`), and `policy.safetensors`, its
weights. This file needs nothing else, so that it can be copied into any program; only where the network is of somebody's
own, `policy.onnx` is there too, and onnxruntime runs it.

    policy = Policy.load("policy")
    linear, angular = policy.velocities(observations)[0]     # observations (n, size) float32; m/s and rad/s
"""

import hashlib
import json
import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float32]

SPECIFICATION = "policy.json"
WEIGHTS = "policy.safetensors"
GRAPH = "policy.onnx"
KINDS = (
    "ranges",
    "inverse_ranges",
    "speeds",
    "actions",
    "distance",
    "distance_of_diagonal",
    "direction",
    "bearing",
    "bearing_sine_cosine",
    "heading",
    "heading_turn",
    "deviation",
    "trail",
    "long_trail",
    "way",
    "reach",
    "reach_progress",
    "known",
    "known_progress",
    "openings",
    "dwell",
)
"""What a part of an observation may be; `observation.py` has a table of them. A name with a dot is an extension's part."""

_MEMORIES = {
    "trail": "trail",
    "long_trail": "trail",
    "known": "views",
    "known_progress": "views",
    "openings": "openings",
    "dwell": "dwell",
}

_LEAKY_SLOPE = np.float32(0.01)


class PolicyFileError(ValueError):
    """A policy's files are missing, damaged, or of a version that this file does not know."""


@dataclass(frozen=True)
class Part:
    """One part of an observation.

    Attributes:
        kind: one of `KINDS`, or the name of an extension's part, "extension.part".
        size: numbers at one moment.
    """

    kind: str
    size: int

    @property
    def added(self) -> bool:
        """Whether an extension's code makes it, which this program does not have."""
        return "." in self.kind

    @property
    def remembered_by(self) -> str:
        """Which memory of the robot's way makes it, each in a file of that name, such as trail; '' for none."""
        return _MEMORIES.get(self.kind, "")

    @property
    def brought(self) -> bool:
        """Whether its numbers are no function of scan, pose, target and commands of one moment: whoever asks brings them."""
        return self.added or bool(self.remembered_by)


@dataclass(frozen=True)
class Specification:
    """What it takes to run a policy on a robot; lengths in metres, angles in radians, times in seconds.

    Attributes:
        format, version: of this specification.
        parts: of the observation, in order.
        repeated: of a way's first observation, the places in its newest moment where the numbers of earlier moments are.
        carried: of the observations that follow, the places in the one before where the numbers of earlier moments are.
        rays: rays of each LiDAR's scan.
        mounts: of each LiDAR, in the order of the scan: x ahead and y to the left of the body's middle, and yaw.
        field_of_view: of each LiDAR, symmetric about where it looks.
        range: what a ray without a hit reads.
        near: distance at which an inverse range reaches 1.
        diagonal: of the arena.
        drive: 'differential', 'omnidirectional' or 'ackermann'.
        reverse: fastest backwards, as a share of the top speed.
        sideways: of an omnidirectional drive, fastest to either side, likewise; else 0.
        wheel_base: of an Ackermann drive, else 0.
        steering_limit: likewise, to either side.
        max_linear_speed: metres per second for action 1.
        max_angular_speed: radians per second for action 1, positive to the left; an Ackermann drive turns no faster.
        control_period: between two actions.
        arrival_distance: to the target, that counted as arrived.
        collision_distance: of what a ray meets from the body's middle, within which it was a collision.
        robot_radius: of the largest disc within the robot's body: its radius if it is round.
        robot_length, robot_width: of the body if it is rectangular; 0 if it is round.
        network: its name.
        formula: what it computes, see `Forward`; empty where only `policy.onnx` says so.
        memory: numbers that it remembers of a robot from step to step; 0 where it remembers nothing.
        weights_sha256: of `policy.safetensors`.
    """

    format: str
    version: int
    parts: tuple[Part, ...]
    repeated: tuple[int, ...]
    carried: tuple[int, ...]
    rays: int
    mounts: tuple[tuple[float, float, float], ...]
    field_of_view: float
    range: float
    near: float
    diagonal: float
    drive: str
    reverse: float
    sideways: float
    wheel_base: float
    steering_limit: float
    max_linear_speed: float
    max_angular_speed: float
    control_period: float
    arrival_distance: float
    collision_distance: float
    robot_radius: float
    robot_length: float
    robot_width: float
    network: str
    formula: tuple[str, ...]
    memory: int
    weights_sha256: str

    @property
    def action_limits(self) -> tuple[float, ...]:
        """What 1 stands for in each number of an action: m/s forwards, [m/s to the left,] rad/s or, of steering, rad."""
        if self.drive == "ackermann":
            return self.max_linear_speed, self.steering_limit
        if self.drive == "omnidirectional":
            return self.max_linear_speed, self.sideways * self.max_linear_speed, self.max_angular_speed
        return self.max_linear_speed, self.max_angular_speed

    @property
    def action_lows(self) -> tuple[float, ...]:
        """The lowest of each number of an action; the highest is 1."""
        return (0.0 - self.reverse, *(-1.0 for _ in self.action_limits[1:]))

    @property
    def scan_size(self) -> int:
        """Rays of all LiDARs together."""
        return self.rays * len(self.mounts)

    @property
    def newest_size(self) -> int:
        """Numbers of the newest moment."""
        return sum(part.size for part in self.parts)

    @property
    def observation_size(self) -> int:
        """Numbers in an observation: of all moments."""
        return self.newest_size + len(self.carried)

    @classmethod
    def load(cls, path: Path) -> "Specification":
        """Read `policy.json`.

        Raises:
            PolicyFileError: it is missing, or not one that this file knows.
        """
        try:
            values = json.loads(path.read_text(encoding="utf-8"))
            values |= {name: tuple(values[name]) for name in ("formula", "repeated", "carried")}
            values["parts"] = tuple(Part(**part) for part in values["parts"])
            values["mounts"] = tuple((float(x), float(y), float(yaw)) for x, y, yaw in values["mounts"])
            specification = cls(**{field.name: values[field.name] for field in fields(cls)})
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise PolicyFileError(f"{path} is not a policy's specification ({error!r}): export the policy again") from error
        if (
            (specification.format, specification.version) != ("mapless-deployment", 4)
            or not {part.kind for part in specification.parts if not part.added}.issubset(KINDS)
            or specification.drive not in ("differential", "omnidirectional", "ackermann")
        ):
            raise PolicyFileError(f"{path} is of another version than this program: use the program of the same bundle")
        return specification


class Policy:
    """A deterministic policy.

    Args:
        specification: what it is.
        weights: its arrays by name.
        graph: its ONNX file, where there is no formula: onnxruntime runs it.
    """

    def __init__(self, specification: Specification, weights: dict[str, Floats], graph: bytes = b"") -> None:
        self.specification = specification
        self._network = NumpyNetwork(specification.formula, weights)
        self._session = None if specification.formula else _session(graph)
        self._limits = np.array(specification.action_limits, np.float32)

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
        graph = b"" if specification.formula else (Path(directory) / GRAPH).read_bytes()
        return cls(specification, read_safetensors(data), graph)

    def actions(self, observations: Floats) -> Floats:
        """Observations (n, size) to actions (n, A): fractions of the limits, each from its low to 1.

        Those of a policy that remembers are of robots that begin; see `step`.
        """
        return self.step(observations, self.memory(len(observations)))[0]

    def memory(self, robots: int) -> Floats:
        """The memory (n, m) of robots that begin; of a policy that does not remember, m is 0."""
        return np.zeros((robots, self.specification.memory), np.float32)

    def step(self, observations: Floats, memory: Floats) -> tuple[Floats, Floats]:
        """Observations (n, size) and the memory (n, m) from the step before to actions (n, A) and the new memory."""
        if self._session is not None:
            (actions,) = self._session.run(["action"], {"observation": observations})
            return actions, memory
        outputs, following = self._network(observations, memory)
        columns = [_bounded(outputs[:, k : k + 1], low) for k, low in enumerate(self.specification.action_lows)]
        return np.concatenate(columns, axis=1), following

    def velocities(self, observations: Floats) -> Floats:
        """Observations (n, size) to commands (n, A) within the policy's limits, see `Specification.action_limits`."""
        return self.actions(observations) * self._limits


def _session(graph: bytes) -> Any:
    """The ONNX file, ready to run.

    Raises:
        PolicyFileError: onnxruntime is not installed here.
    """
    # Since 1.29 it reports what it runs to its maker, unless it is told not to before it is loaded: a robot tells nobody.
    os.environ["ORT_DISABLE_TELEMETRY"] = "1"
    try:
        import onnxruntime
    except ImportError as error:
        raise PolicyFileError("this policy's network runs by onnxruntime: install it (pip install onnxruntime)") from error
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    return onnxruntime.InferenceSession(graph, options, providers=["CPUExecutionProvider"])


class Forward:
    """A network's formula, run on any kind of numbers: NumPy's arrays here, tensors and ONNX nodes elsewhere.

    A formula is lines 'name = expression'; an expression is a name, a whole number, or 'name(expression, ...)', which
    applies an operator or, where there is none of that name, the layer of that name. `x` is given, `y` comes out; a network
    that remembers is given its memory as `h` as well, and its new memory is what `h` is at the end.

    Args:
        lines: the formula.

    Raises:
        PolicyFileError: it is not a formula.
    """

    def __init__(self, lines: Sequence[str]) -> None:
        self.lines = [_parse(line) for line in lines]

    def run(self, values: dict[str, Any], apply: Callable[..., Any]) -> dict[str, Any]:
        """Computes line by line what the names stand for.

        Args:
            values: what is given, by name; overwritten.
            apply: makes a value of the name of an operator or a layer and its arguments, values or whole numbers.
        """
        for name, expression in self.lines:
            values[name] = evaluate(expression, values, apply)
        return values


def evaluate(expression: Any, values: Mapping[str, Any], apply: Callable[..., Any]) -> Any:
    """What an expression stands for; see `Forward`."""
    if isinstance(expression, tuple):
        name, arguments = expression
        return apply(name, *(evaluate(argument, values, apply) for argument in arguments))
    return values[expression] if isinstance(expression, str) else expression


def _parse(line: str) -> tuple[str, Any]:
    """A line of a formula as a name and an expression: a name, a number, or (name, expressions)."""
    target, _, text = line.partition(" = ")
    tokens = re.findall(r"[\w.]+|[(),]", text)
    if not target.isidentifier() or "".join(tokens) != text.replace(" ", ""):
        raise PolicyFileError(f"{line!r} is not a line of a formula: use the program of the same bundle")
    tokens.append("")

    def expression() -> Any:
        word = tokens.pop(0)
        if word.isdigit():
            return int(word)
        if tokens[0] != "(":
            return word
        arguments = []
        while tokens.pop(0) in ("(", ",") and tokens[0]:
            arguments.append(expression())
        return word, tuple(arguments)

    return target, expression()


class NumpyNetwork:
    """A network on NumPy's arrays.

    Args:
        lines: its formula, see `Forward`.
        weights: its arrays by name.
    """

    def __init__(self, lines: Sequence[str], weights: Mapping[str, Floats]) -> None:
        self._forward, self._weights = Forward(lines), weights

    def __call__(self, observations: Floats, memory: Floats) -> tuple[Floats, Floats]:
        """Observations (n, size) and memory (n, m) to outputs and the new memory."""
        values = self._forward.run({"x": observations, "h": memory}, self._apply)
        return values["y"], values["h"]

    def _apply(self, name: str, *arguments: Any) -> Floats:
        operator = _OPERATORS.get(name)
        if operator is not None:
            return operator(*arguments)
        weight, bias = self._weights[f"{name}.weight"], self._weights[f"{name}.bias"]
        if weight.ndim == 3:
            return _convolution(weight, bias, *arguments)
        # In place: half the time of a small network is that of making arrays.
        product: Floats = arguments[0] @ weight.T
        product += bias
        return product


def _convolution(weight: Floats, bias: Floats, values: Floats, stride: int, padding: int) -> Floats:
    """Values (n, in, length) by a weight (out, in, width) to (n, out, length of the result)."""
    padded = np.pad(values, ((0, 0), (0, 0), (padding, padding)))
    windows = np.lib.stride_tricks.sliding_window_view(padded, weight.shape[2], axis=2)[:, :, ::stride]
    sums: Floats = np.tensordot(windows, weight, axes=([1, 3], [1, 2])).transpose(0, 2, 1)
    return np.ascontiguousarray(sums + bias[:, None])


def _sigmoid(values: Floats) -> Floats:
    """As a tanh, which does not overflow."""
    sigmoid: Floats = np.float32(0.5) * (np.float32(1.0) + np.tanh(np.float32(0.5) * values))
    return sigmoid


def _bounded(outputs: Floats, low: float) -> Floats:
    """A network's outputs as numbers from `low` to 1: by a tanh where that is -1, else by a sigmoid."""
    if low == -1.0:
        bounded: Floats = np.tanh(outputs)
        return bounded
    return np.float32(low) + np.float32(1.0 - low) * _sigmoid(outputs)


def _relu(values: Floats) -> Floats:
    return np.maximum(values, np.float32(0.0))


def _leaky_relu(values: Floats) -> Floats:
    leaky: Floats = np.maximum(values, _LEAKY_SLOPE * values)
    return leaky


_OPERATORS: dict[str, Callable[..., Floats]] = {
    "relu": _relu,
    "leaky_relu": _leaky_relu,
    "tanh": np.tanh,
    "sigmoid": _sigmoid,
    "add": np.add,
    "subtract": np.subtract,
    "multiply": np.multiply,
    "concatenate": lambda *parts: np.concatenate(parts, axis=1),
    "columns": lambda values, start, end: values[:, start:end],
    "channels": lambda values, count: values.reshape(len(values), count, -1),
    "flatten": lambda values: values.reshape(len(values), -1),
}


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

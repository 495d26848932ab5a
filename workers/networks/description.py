"""What the networks that ship compute, said once: a formula and the shapes of its layers (no torch).

PyTorch's modules, the ONNX graph, the NumPy runner and the robot's node all run these lines; `Forward` in
`workers/export/ros2/mapless_navigator/policy.py` says how they read. A layer called with x alone is weight @ x + bias; one
called with (x, stride, padding) is a convolution along the last dimension.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

from sim.extending.discovery import implementation
from workers.errors import NetworkError
from workers.networks.config import (
    AddedFormulaNetworkConfig,
    ConvNetwork,
    GruNetwork,
    MlpNetwork,
    NetworkConfig,
    ResBlockNetwork,
)
from workers.networks.inputs import Inputs

RESBLOCK_WIDTH = 512


@dataclass(frozen=True)
class Description:
    """A network of given inputs and outputs.

    Attributes:
        lines: its formula.
        layers: shape of each layer's weight, (outputs, inputs) or (outputs, inputs, kernel), the outputs' layer last; they
            are initialised in this order.
        activation: of its hidden layers.
        memory: numbers that it remembers of a robot.
    """

    lines: tuple[str, ...]
    layers: dict[str, tuple[int, ...]]
    activation: str
    memory: int = 0

    @property
    def shapes(self) -> dict[str, tuple[int, ...]]:
        """Of every array, by name."""
        arrays: dict[str, tuple[int, ...]] = {}
        for layer, shape in self.layers.items():
            arrays |= {f"{layer}.weight": shape, f"{layer}.bias": shape[:1]}
        return arrays


def describe(network: NetworkConfig, inputs: Inputs, outputs: int) -> Description | None:
    """A network in words; None where only its module knows what it computes.

    Raises:
        NetworkError: it cannot be of these inputs, or its extension describes something else than it declares.
    """
    if isinstance(network, AddedFormulaNetworkConfig):
        return _of_extension(network, inputs, outputs)
    description = _DESCRIPTIONS.get(type(network))
    return None if description is None else description(network, inputs, outputs)


def _of_extension(network: AddedFormulaNetworkConfig, inputs: Inputs, outputs: int) -> Description:
    description = implementation(network)(network, inputs, outputs)
    if not isinstance(description, Description):
        raise NetworkError(f"the network {network.name!r} should be a Description, not a {type(description).__name__}")
    if network.recurrent != (description.memory > 0):
        raise NetworkError(
            f"the network {network.name!r} describes {description.memory} numbers of memory: a RecurrentNetwork has some, "
            "every other none"
        )
    return description


def _resblock(network: ResBlockNetwork, inputs: Inputs, outputs: int) -> Description:
    size, wide = inputs.size, RESBLOCK_WIDTH
    if not network.concatenations:
        return Description(
            lines=(
                "a = leaky_relu(layer2(leaky_relu(layer1(x))))",
                "b = leaky_relu(layer4(leaky_relu(layer3(a))))",
                "y = head(b)",
            ),
            layers={
                "layer1": (wide, size),
                "layer2": (size, wide),
                "layer3": (wide, size),
                "layer4": (2 * size, wide),
                "head": (outputs, 2 * size),
            },
            activation="leaky_relu",
        )
    sizes = {"layer1": (wide, size), "layer2": (size, wide), "layer3": (wide, 2 * size), "layer4": (2 * size, wide)}
    return Description(
        lines=(
            "a = leaky_relu(concatenate(layer2(leaky_relu(layer1(x))), x))",
            "b = leaky_relu(concatenate(leaky_relu(layer4(leaky_relu(layer3(a)))), a))",
            "y = head(b)",
        ),
        layers={**sizes, "head": (outputs, 4 * size)},
        activation="leaky_relu",
    )


def _mlp(network: MlpNetwork, inputs: Inputs, outputs: int) -> Description:
    hidden = {
        f"layers.{index}": (after, before)
        for index, (before, after) in enumerate(pairwise((inputs.size, *network.hidden_sizes)))
    }
    return Description(
        lines=(*(f"x = {network.activation}({layer}(x))" for layer in hidden), "y = head(x)"),
        layers={**hidden, "head": (outputs, network.hidden_sizes[-1])},
        activation=network.activation,
    )


def _conv(network: ConvNetwork, inputs: Inputs, outputs: int) -> Description:
    if not inputs.ranges:
        raise NetworkError("a convolution over the scan needs ranges in the observation: add them, or take another network")
    frames, length = len(inputs.ranges), inputs.ranges[0][1] - inputs.ranges[0][0]
    padding = network.kernel_size // 2
    scan = ", ".join(f"columns(x, {start}, {end})" for start, end in inputs.ranges)
    lines, layers = [f"s = channels(concatenate({scan}), {frames})"], {}
    for index, (before, after) in enumerate(pairwise((frames, *network.channels))):
        layers[f"convolutions.{index}"] = (after, before, network.kernel_size)
        lines.append(f"s = relu(convolutions.{index}(s, {network.stride}, {padding}))")
        length = (length + 2 * padding - network.kernel_size) // network.stride + 1
    # What lies between, before and behind the ranges.
    edges = [0, *(edge for span in inputs.ranges for edge in span), inputs.size]
    others = [(start, end) for start, end in zip(edges[::2], edges[1::2], strict=True) if end > start]
    rest = "".join(f", columns(x, {start}, {end})" for start, end in others)
    lines += [f"a = relu(hidden(concatenate(flatten(s){rest})))", "y = head(a)"]
    joined = network.channels[-1] * length + sum(end - start for start, end in others)
    return Description(
        lines=tuple(lines),
        layers={**layers, "hidden": (network.units, joined), "head": (outputs, network.units)},
        activation="relu",
    )


def _gru(network: GruNetwork, inputs: Inputs, outputs: int) -> Description:
    """Cho et al. 2014, with the reset gate behind the matrix as in cuDNN and PyTorch."""
    units = network.units
    reset, update, new = (f"{{}}, {gate * units}, {(gate + 1) * units}" for gate in range(3))

    def part(gate: str, of: str) -> str:
        return f"columns({gate.format(of)})"

    return Description(
        lines=(
            "i = input(relu(encoder(x)))",
            "g = memory(h)",
            f"r = sigmoid(add({part(reset, 'i')}, {part(reset, 'g')}))",
            f"z = sigmoid(add({part(update, 'i')}, {part(update, 'g')}))",
            f"n = tanh(add({part(new, 'i')}, multiply(r, {part(new, 'g')})))",
            "h = add(n, multiply(z, subtract(h, n)))",
            "y = head(h)",
        ),
        layers={
            "encoder": (units, inputs.size),
            "input": (3 * units, units),
            "memory": (3 * units, units),
            "head": (outputs, units),
        },
        activation="relu",
        memory=units,
    )


_DESCRIPTIONS: dict[type[NetworkConfig], Callable[[Any, Inputs, int], Description]] = {
    ResBlockNetwork: _resblock,
    MlpNetwork: _mlp,
    ConvNetwork: _conv,
    GruNetwork: _gru,
}

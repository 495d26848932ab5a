"""How the networks are laid out, for those who run them without torch: constants, array names, shapes, formulas."""

from itertools import pairwise

from workers.config import Network, ResBlockNetwork
from workers.kernels.constants import LEAKY_SLOPE as LEAKY_SLOPE
from workers.manifest import NetworkLayout

ACTION_SIZE = 2
"""Linear velocity in [0, 1] and angular velocity in [-1, 1], as fractions of the robot's limits."""

RESBLOCK_WIDTH = 512


def layout(network: Network) -> NetworkLayout:
    """Names and meaning of a policy's arrays."""
    if isinstance(network, ResBlockNetwork):
        return NetworkLayout(
            name="resblock",
            layers=("layer1", "layer2", "layer3", "layer4", "head"),
            activation="leaky_relu",
            formula=(
                f"leaky_relu(z) = z where z > 0, else {LEAKY_SLOPE:g} z",
                "a = leaky_relu(concatenate(layer2(leaky_relu(layer1(x))), x))",
                "b = leaky_relu(concatenate(leaky_relu(layer4(leaky_relu(layer3(a)))), a))",
                "y = head(b)",
                "action = (1 / (1 + exp(-y[0])), tanh(y[1]))",
            ),
        )
    hidden = tuple(f"layers.{index}" for index in range(len(network.hidden_sizes)))
    return NetworkLayout(
        name="mlp",
        layers=(*hidden, "head"),
        activation=network.activation,
        formula=(
            *(f"x = {network.activation}({layer}(x))" for layer in hidden),
            "y = head(x)",
            "action = (1 / (1 + exp(-y[0])), tanh(y[1]))",
        ),
    )


def weight_shapes(network: Network, observation_size: int) -> dict[str, tuple[int, ...]]:
    """Shape of every array of a policy, by name."""
    if isinstance(network, ResBlockNetwork):
        wide, size = RESBLOCK_WIDTH, observation_size
        sizes = [(size, wide), (wide, size), (2 * size, wide), (wide, 2 * size), (4 * size, ACTION_SIZE)]
    else:
        sizes = list(pairwise((observation_size, *network.hidden_sizes, ACTION_SIZE)))
    shapes: dict[str, tuple[int, ...]] = {}
    for layer, (inputs, outputs) in zip(layout(network).layers, sizes, strict=True):
        shapes[f"{layer}.weight"] = (outputs, inputs)
        shapes[f"{layer}.bias"] = (outputs,)
    return shapes

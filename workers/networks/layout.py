"""How the networks are laid out, for those who run them without torch: array names, shapes, formulas."""

from sim.actions import DEFAULT_ACTIONS, ActionLayout
from workers.kernels.constants import LEAKY_SLOPE
from workers.manifest import NetworkLayout
from workers.networks.config import NetworkConfig
from workers.networks.description import describe
from workers.networks.inputs import Inputs, as_inputs


def layout(network: NetworkConfig, inputs: Inputs | int, actions: ActionLayout = DEFAULT_ACTIONS) -> NetworkLayout:
    """Names and meaning of a policy's arrays."""
    action = f"action = ({actions.formula})"
    description = describe(network, as_inputs(inputs), actions.size)
    if description is None:
        own = f"y = the network {network.name!r} of x: its ONNX graph computes it"
        return NetworkLayout(name=network.name, layers=(), activation="", formula=(own, action))
    slope = f"leaky_relu(z) = z where z > 0, else {LEAKY_SLOPE:g} z"
    said = (slope,) if description.activation == "leaky_relu" else ()
    return NetworkLayout(
        name=network.name,
        layers=tuple(description.layers),
        activation=description.activation,
        formula=(*said, *description.lines, action),
    )


def known_shapes(
    network: NetworkConfig, inputs: Inputs, actions: ActionLayout = DEFAULT_ACTIONS
) -> dict[str, tuple[int, ...]] | None:
    """Shape of every array of a policy, by name; None where only the network's module knows."""
    description = describe(network, inputs, actions.size)
    return None if description is None else description.shapes


def policy_shapes(
    network: NetworkConfig, inputs: Inputs, actions: ActionLayout = DEFAULT_ACTIONS
) -> dict[str, tuple[int, ...]]:
    """Shape of every array of a policy, by name; torch is imported where only the network's module knows."""
    known = known_shapes(network, inputs, actions)
    if known is not None:
        return known
    from workers.networks.modules import fresh_network

    module = fresh_network(network, inputs, actions.size)
    return {name: tuple(parameter.shape) for name, parameter in module.named_parameters()}

"""Which module belongs to which network's configuration: the one place where a network is made known.

    class Wide(NetworkConfig):
        name: Literal["wide"] = Field("wide", title="Wide")
        units: int = Field(512, ge=1, title="Units")

    def build_wide(config: Wide, inputs: Inputs, outputs: int) -> nn.Module:
        return nn.Sequential(nn.Linear(inputs.size, config.units), nn.ReLU(), nn.Linear(config.units, outputs))

    register_network(Wide, build_wide)

From then on it is in the form, the API's schema and the manifest, and every algorithm trains it. This file needs no torch.
"""

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, TypeVar

from sim.extending.discovery import implementation
from workers.networks.config import NETWORKS, AddedNetworkConfig, NetworkConfig
from workers.networks.inputs import Inputs

if TYPE_CHECKING:
    from torch import nn

Config = TypeVar("Config", bound=NetworkConfig)
Build = Callable[[Config, Inputs, int], "nn.Module"]
"""A configuration, what the network is given and how many outputs to a module from (n, inputs.size) to (n, outputs)."""

_BUILDS: dict[type[NetworkConfig], Build[Any]] = {}


def register_network(config: type[Config], build: Build[Config]) -> None:
    """Makes a network known.

    Args:
        config: its configuration; the literal default of its field `name` is the network's name.
        build: makes the module, freshly initialised from torch's global generator; called on the CPU. Its last linear layer
            should make the outputs: an actor's is scaled down, so that a training starts in the middle of the actions.

    Raises:
        ValueError: another network has that name.
    """
    if config not in NETWORKS.members:
        NETWORKS.add(config)
    _BUILDS[config] = build


def forget_network(config: type[NetworkConfig]) -> None:
    """Undoes `register_network`."""
    NETWORKS.remove(config)
    del _BUILDS[config]


def build_of(config: NetworkConfig) -> Build[Any]:
    """How the module of a configuration is made.

    Raises:
        KeyError: nobody has said so.
    """
    if isinstance(config, AddedNetworkConfig):
        build: Build[Any] = implementation(config)
        return build
    return _BUILDS[type(config)]

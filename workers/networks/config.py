"""What a network is called and how large it is; what it computes stands elsewhere in this folder (pydantic only)."""

from typing import Annotated, ClassVar, Literal

from pydantic import Field, field_validator, model_validator

from sim.config import ADVANCED, Frozen, OpenUnion
from sim.extending.discovery import added, complete
from workers.extending.parts import FormulaNetwork, RecurrentNetwork
from workers.extending.parts import Network as AddedNetwork

_LEAST_UNITS, _MOST_UNITS = 4, 1024
# Refused in words of our own; the form knows the limits all the same.
_Units = Annotated[int, Field(json_schema_extra={"minimum": _LEAST_UNITS, "maximum": _MOST_UNITS})]


class NetworkConfig(Frozen):
    """Base of every network's configuration: a form of its own, chosen by `name`.

    Attributes:
        name: one literal value, its default: the network's name in files and in the API; its title is that in the form.
        recurrent: whether it remembers: such a network takes and gives a memory beside its inputs and outputs.
    """

    recurrent: ClassVar[bool] = False

    name: str


class ResBlockNetwork(NetworkConfig):
    """The paper's network (tables 'PPO Critic network structure details'): two residual concatenations, 512 wide."""

    name: Literal["resblock"] = Field("resblock", title="ResBlock")
    concatenations: bool = Field(
        True,
        title="Concatenations",
        description="Off: the same layers one after another, to learn what the residual connections are worth.",
        json_schema_extra=ADVANCED,
    )


class MlpNetwork(NetworkConfig):
    """A plain multi-layer perceptron."""

    name: Literal["mlp"] = Field("mlp", title="MLP")
    hidden_sizes: tuple[_Units, ...] = Field(
        (64, 64),
        min_length=1,
        max_length=4,
        title="Hidden layers",
        description="Units of each hidden layer, 4 to 1024.",
        json_schema_extra=ADVANCED,
    )
    activation: Literal["relu", "tanh"] = Field("relu", title="Activation", json_schema_extra=ADVANCED)

    @field_validator("hidden_sizes")
    @classmethod
    def _sizes_in_range(cls, sizes: tuple[int, ...]) -> tuple[int, ...]:
        if any(not _LEAST_UNITS <= size <= _MOST_UNITS for size in sizes):
            raise ValueError(f"every hidden layer needs between {_LEAST_UNITS} and {_MOST_UNITS} units")
        return sizes


class ConvNetwork(NetworkConfig):
    """Convolutions along the scan, one channel for each stacked frame; every other number joins behind them."""

    name: Literal["conv"] = Field("conv", title="Conv")
    channels: tuple[int, ...] = Field(
        (8, 16),
        min_length=1,
        max_length=4,
        title="Channels",
        description="Of each convolution along the scan, 1 to 128. Worth it with many LiDAR batches.",
        json_schema_extra=ADVANCED,
    )
    kernel_size: Literal[3, 5, 7, 9] = Field(
        5, title="Kernel size", description="Neighbouring ranges that one number sees.", json_schema_extra=ADVANCED
    )
    stride: int = Field(
        2, ge=1, le=4, title="Stride", description="Ranges between two numbers of a convolution.", json_schema_extra=ADVANCED
    )
    units: int = Field(
        64, ge=4, le=1024, title="Units", description="Of the hidden layer behind it.", json_schema_extra=ADVANCED
    )

    @model_validator(mode="after")
    def _channels_in_range(self) -> "ConvNetwork":
        if any(not 1 <= channels <= 128 for channels in self.channels):
            raise ValueError("every convolution needs between 1 and 128 channels")
        return self


class RecurrentNetworkConfig(NetworkConfig):
    """Base of every recurrent network's configuration."""

    recurrent: ClassVar[bool] = True

    sequence_length: int = Field(
        16,
        ge=2,
        le=256,
        title="Sequence",
        description="Steps that gradients go back through time; a rollout is a whole number of sequences.",
        json_schema_extra=ADVANCED,
    )


class GruNetwork(RecurrentNetworkConfig):
    """A hidden layer, then gated recurrent units (Cho et al. 2014): for PPO, it remembers what it saw in an episode."""

    name: Literal["gru"] = Field("gru", title="GRU")
    units: int = Field(
        32, ge=4, le=512, title="Units", description="Of the hidden layer, and of the memory.", json_schema_extra=ADVANCED
    )


class AddedNetworkConfig(NetworkConfig, AddedNetwork):
    """A network of an extension."""


class AddedFormulaNetworkConfig(AddedNetworkConfig, FormulaNetwork):
    """A network of an extension that is said as a formula."""


class AddedRecurrentNetworkConfig(RecurrentNetworkConfig, AddedFormulaNetworkConfig):
    """One that remembers."""


def complete_network(network: type[AddedNetwork]) -> type[AddedNetworkConfig]:
    """A network of an extension with the fields that all of its kind have."""
    if issubclass(network, RecurrentNetwork):
        return complete(network, AddedRecurrentNetworkConfig)
    return complete(network, AddedFormulaNetworkConfig if issubclass(network, FormulaNetwork) else AddedNetworkConfig)


NETWORKS: OpenUnion[NetworkConfig] = OpenUnion(
    ResBlockNetwork,
    MlpNetwork,
    ConvNetwork,
    GruNetwork,
    *map(complete_network, added(AddedNetwork)),
)
"""Every network that a training may have."""

Network = Annotated[NetworkConfig, NETWORKS]
"""The type of a field that holds any of them."""

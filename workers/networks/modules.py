"""The networks as modules, and the actors that turn any of them into bounded actions."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from sim.actions import DEFAULT_ACTIONS, ActionLayout
from workers.errors import NetworkError
from workers.export.ros2.mapless_navigator.policy import Forward
from workers.networks.config import AddedFormulaNetworkConfig, GruNetwork, NetworkConfig
from workers.networks.description import Description, describe
from workers.networks.expressions import Expression, resolved, value_of
from workers.networks.inputs import Inputs, as_inputs
from workers.networks.recurrence import GruSequence
from workers.networks.registry import build_of
from workers.networks.squashing import bound_actions

# A policy head this small starts every training at the middle of the actions, whatever the observation.
_POLICY_HEAD_SCALE = 0.01

# Larger, since a deterministic policy gradient has to find its way through this head.
_DETERMINISTIC_HEAD_SCALE = 0.1


class Described(nn.Module):
    """A network that ships: runs the lines of its description on tensors.

    Attributes:
        config: its configuration.
        memory_size: numbers that it remembers of a robot, 0 where it remembers nothing.
    """

    def __init__(self, config: NetworkConfig, description: Description) -> None:
        super().__init__()
        self.config, self.memory_size = config, description.memory
        for name, shape in description.layers.items():
            self._place(name, nn.Linear(shape[1], shape[0]) if len(shape) == 2 else nn.Conv1d(shape[1], shape[0], shape[2]))
        parsed = Forward(description.lines).lines
        # Only what lies between goes step by step: not what comes before memory is looked at or after it is known.
        uses = [index for index, (_, expression) in enumerate(parsed) if _mentions(expression, "h")]
        made = [index for index, (name, _) in enumerate(parsed) if name == "h"]
        first, last = (uses[0], made[-1] + 1) if made else (len(parsed), len(parsed))
        lines = [(name, resolved(expression, self)) for name, expression in parsed]
        self._before, self._steps, self._after = lines[:first], lines[first:last], lines[last:]

    def forward(self, inputs: Tensor, memory: Tensor | None = None) -> Tensor | tuple[Tensor, Tensor]:
        """(n, inputs) to (n, outputs); with a memory (n, memory_size) to these and the next memory.

        Without one, every row begins an episode.
        """
        start = inputs.new_zeros(len(inputs), self.memory_size) if memory is None else memory
        values: dict[str, Any] = {"x": inputs, "h": start}
        for part in (self._before, self._steps, self._after):
            self._run(part, values)
        return values["y"] if memory is None else (values["y"], values["h"])

    def unroll(self, inputs: Tensor, memory: Tensor, keep: Tensor) -> Tensor:
        """Outputs (steps, n, outputs) of sequences.

        Args:
            inputs: (steps, n, inputs).
            memory: (n, memory_size), what is remembered from before the first step.
            keep: (steps, n, 1), 0 where an episode begins, so that memory is forgotten, else 1.
        """
        steps, rows = inputs.shape[:2]
        given: dict[str, Any] = {"x": inputs.flatten(0, 1)}
        self._run(self._before, given)
        if isinstance(self.config, GruNetwork) and inputs.device.type == "cpu":
            layer = self.get_submodule("memory")
            gates = given["i"].view(steps, rows, -1)
            given["h"] = GruSequence.apply(gates, layer.weight, layer.bias, memory, keep[..., 0]).flatten(0, 1)
        else:
            given["h"] = self._remember(given, memory, keep)
        self._run(self._after, given)
        outputs: Tensor = given["y"]
        return outputs.view(steps, rows, -1)

    def _remember(self, given: dict[str, Any], memory: Tensor, keep: Tensor) -> Tensor:
        """Memory (steps * n, memory_size) after each step."""
        at_steps = {name: value.view(*keep.shape[:2], -1).unbind(0) for name, value in given.items()}
        memories = []
        for step in range(len(keep)):
            values = {name: value[step] for name, value in at_steps.items()} | {"h": memory * keep[step]}
            self._run(self._steps, values)
            memory = values["h"]
            memories.append(memory)
        return torch.cat(memories)

    @staticmethod
    def _run(lines: Sequence[tuple[str, Expression]], values: dict[str, Any]) -> None:
        for name, expression in lines:
            values[name] = value_of(expression, values)

    def _place(self, name: str, layer: nn.Module) -> None:
        """Under 'name', or in the list 'name' of 'name.0', 'name.1'."""
        group, _, index = name.partition(".")
        if not index:
            self.add_module(name, layer)
            return
        if not hasattr(self, group):
            self.add_module(group, nn.ModuleList())
        layers = getattr(self, group)
        layers.append(layer)


def _mentions(expression: Any, name: str) -> bool:
    if isinstance(expression, tuple):
        return any(_mentions(argument, name) for argument in expression[1])
    return bool(expression == name)


def build_network(config: NetworkConfig, inputs: Inputs | int, outputs: int) -> nn.Module:
    """The network of a configuration, freshly initialised from torch's global generator.

    Args:
        config: of a registered network.
        inputs: what it is given, or how many numbers.
        outputs: how many numbers come out.

    Raises:
        NetworkError: the module is not one that can be trained, saved and resumed.
    """
    description = describe(config, as_inputs(inputs), outputs)
    if description is not None:
        described = Described(config, description)
        if isinstance(config, AddedFormulaNetworkConfig):
            _refuse_unfit_formula(config, described, as_inputs(inputs).size, outputs)
        return described
    if config.recurrent:
        raise NetworkError(
            f"the network {config.name!r} is recurrent, and a module: one that remembers has to be said as a formula "
            "(workers.extending.RecurrentNetwork)"
        )
    network: nn.Module = build_of(config)(config, as_inputs(inputs), outputs)
    _refuse_unfit(config, network, as_inputs(inputs).size, outputs)
    return network


def fresh_network(config: NetworkConfig, inputs: Inputs | int, outputs: int) -> nn.Module:
    """The same, leaving torch's global generator as it was: for whoever brings the weights along."""
    with torch.random.fork_rng(devices=[]):
        return build_network(config, inputs, outputs)


@torch.no_grad()
def _refuse_unfit(config: NetworkConfig, network: nn.Module, inputs: int, outputs: int) -> None:
    parameters = dict(network.named_parameters())
    if not parameters or any(parameter.dtype != torch.float32 for parameter in parameters.values()):
        raise NetworkError(f"the network {config.name!r} must have parameters, all of them float32")
    if others := network.state_dict().keys() - parameters.keys():
        raise NetworkError(
            f"the network {config.name!r} keeps {', '.join(sorted(others))} beside its parameters, which a "
            "checkpoint does not hold: use layers without running averages (LayerNorm in place of BatchNorm)"
        )
    found = tuple(network(torch.zeros(3, inputs)).shape)
    if found != (3, outputs):
        raise NetworkError(f"the network {config.name!r} makes {found} of (3, {inputs}), not (3, {outputs})")


@torch.no_grad()
def take_weights(network: nn.Module, weights: Mapping[str, NDArray[np.generic]]) -> None:
    """Overwrites a network's parameters with a policy's arrays, in place.

    A network with more outputs than the policy (SAC's deviations) keeps what its other outputs are made with.

    Args:
        network: of the same kind and sizes as the policy's.
        weights: its arrays, by the parameters' names.
    """
    for name, parameter in network.named_parameters():
        array = torch.from_numpy(np.array(weights[name], np.float32))
        (parameter if parameter.shape == array.shape else parameter[: len(array)]).copy_(array)


@torch.no_grad()
def _refuse_unfit_formula(config: NetworkConfig, network: Described, inputs: int, outputs: int) -> None:
    observations, memory = torch.zeros(3, inputs), torch.zeros(3, network.memory_size)
    try:
        made, following = network(observations, memory)
        found = [tuple(made.shape), tuple(following.shape)]
        if network.memory_size:
            found.append(tuple(network.unroll(observations.expand(2, 3, inputs), memory, torch.ones(2, 3, 1)).shape))
    except Exception as error:  # whatever a stranger's lines lead to
        raise NetworkError(f"the formula of the network {config.name!r} can't be computed: {error!r}") from error
    if found != [(3, outputs), (3, network.memory_size), (2, 3, outputs)][: len(found)]:
        raise NetworkError(
            f"the formula of the network {config.name!r} makes {', '.join(map(str, found))} of (3, {inputs}), "
            f"not (3, {outputs})"
        )


def head_of(network: nn.Module) -> nn.Linear | None:
    """The layer that makes a network's outputs: its last linear one, if there is any."""
    linear = [module for module in network.modules() if isinstance(module, nn.Linear)]
    return linear[-1] if linear else None


def _scale_head(network: nn.Module, scale: float) -> None:
    head = head_of(network)
    if head is None:
        return
    with torch.no_grad():
        head.weight.mul_(scale)
        if head.bias is not None:
            head.bias.zero_()


class GaussianActor(nn.Module):
    """A normal distribution over actions: a bounded mean from the observation, a deviation of its own per action.

    Samples are not bounded; the environment clips them.
    """

    def __init__(self, network: nn.Module, initial_std: Sequence[float], actions: ActionLayout = DEFAULT_ACTIONS) -> None:
        super().__init__()
        self.network = network
        self.actions = actions
        self.log_std = nn.Parameter(torch.log(torch.tensor(initial_std)))
        _scale_head(network, _POLICY_HEAD_SCALE)

    def forward(self, observations: Tensor) -> Tensor:
        """The mean action (n, A) for observations (n, size): also the deterministic policy."""
        return bound_actions(self.network(observations), self.actions)


class DeterministicActor(nn.Module):
    """Observations to bounded actions."""

    def __init__(self, network: nn.Module, observation_size: int, actions: ActionLayout = DEFAULT_ACTIONS) -> None:
        super().__init__()
        self.network = network
        self.actions = actions
        self.observation_size = observation_size
        _scale_head(network, _DETERMINISTIC_HEAD_SCALE)

    def forward(self, observations: Tensor) -> Tensor:
        """Actions (n, A) for observations (n, size)."""
        return bound_actions(self.network(observations), self.actions)

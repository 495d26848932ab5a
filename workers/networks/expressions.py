"""A formula's expressions on tensors: operators and layers are looked up once, not at every pass."""

from collections.abc import Callable, Mapping
from typing import Any

import torch
from torch import Tensor, nn
from torch.nn import functional

from workers.errors import NetworkError
from workers.kernels.constants import LEAKY_SLOPE
from workers.networks.convolution import convolve


class Call:
    """An operator or a layer, applied to arguments; a copy of its network has a copy of it."""

    __slots__ = ("_arguments", "_operation")

    def __init__(self, operation: Callable[..., Tensor], arguments: tuple["Expression", ...]) -> None:
        self._operation, self._arguments = operation, arguments

    def value(self, values: Mapping[str, Any]) -> Tensor:
        """What it makes of the values by their names."""
        return self._operation(*[value_of(argument, values) for argument in self._arguments])


Expression = Call | str | int
"""A call, the name of a value, or a whole number."""


def value_of(expression: Expression, values: Mapping[str, Any]) -> Any:
    """What an expression stands for, given the values by their names."""
    if isinstance(expression, Call):
        return expression.value(values)
    return values[expression] if isinstance(expression, str) else expression


def resolved(expression: Any, network: nn.Module) -> Expression:
    """An expression as `Forward` reads it, with operators and a network's layers in place of their names.

    Raises:
        NetworkError: there is no operator or layer of a name.
    """
    if isinstance(expression, str | int):
        return expression
    name, arguments = expression
    operation = _OPERATORS.get(name) or _layer(name, network)
    return Call(operation, tuple(resolved(argument, network) for argument in arguments))


def _layer(name: str, network: nn.Module) -> Callable[..., Tensor]:
    try:
        layer = network.get_submodule(name)
    except AttributeError as error:
        raise NetworkError(f"the formula can't be computed: no operator or layer is called {name!r}") from error
    # Not the module itself, which looks for hooks at every call.
    return _Convolution(layer).forward if isinstance(layer, nn.Conv1d) else layer.forward


class _Convolution:
    def __init__(self, layer: nn.Conv1d) -> None:
        self._layer = layer

    def forward(self, values: Tensor, stride: int, padding: int) -> Tensor:
        """Values (n, in, length) to (n, out, length of the result)."""
        bias = self._layer.bias
        assert bias is not None
        return convolve(values, self._layer.weight, bias, stride, padding)


_OPERATORS: dict[str, Callable[..., Tensor]] = {
    "relu": torch.relu,
    "leaky_relu": lambda values: functional.leaky_relu(values, LEAKY_SLOPE),
    "tanh": torch.tanh,
    "sigmoid": torch.sigmoid,
    "add": torch.add,
    "subtract": torch.sub,
    "multiply": torch.mul,
    "concatenate": lambda *parts: torch.cat(parts, dim=1),
    "columns": lambda values, start, end: values[:, start:end],
    "channels": lambda values, count: values.reshape(len(values), count, -1),
    "flatten": lambda values: values.flatten(1),
}

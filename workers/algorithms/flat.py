"""The parameters of several modules as one vector: one kernel instead of one per layer, for Adam, clipping and averages."""

from collections.abc import Mapping, Sequence

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn


class FlatParameters:
    """One contiguous vector of parameters and one of gradients.

    The modules keep working as before: their parameters become views of `values`, and their `.grad`, which are always
    there, views of `gradients`. So autograd and hand-written passes fill the same vector.
    """

    def __init__(self, *modules: nn.Module) -> None:
        parameters = [parameter for module in modules for parameter in module.parameters()]
        self._parameters = parameters
        self.values = torch.cat([parameter.detach().reshape(-1) for parameter in parameters])
        self.gradients = torch.zeros_like(self.values)
        offset = 0
        for parameter in parameters:
            span = slice(offset, offset + parameter.numel())
            parameter.data = self.values[span].view_as(parameter)
            parameter.grad = self.gradients[span].view_as(parameter)
            offset = span.stop
        sizes = [sum(parameter.numel() for parameter in module.parameters()) for module in modules]
        self._module_gradients: Sequence[Tensor] = torch.split(self.gradients, sizes)

    def differentiate(self, loss: Tensor) -> None:
        """Overwrites `gradients` with those of a scalar, by autograd; other parameters get none."""
        self.gradients.zero_()
        torch.autograd.backward(loss, inputs=self._parameters)

    @property
    def finite(self) -> bool:
        """Whether every parameter is a finite number."""
        return bool(torch.isfinite(self.values).all())

    def clip_gradients(self, max_norm: float) -> None:
        """Scales each module's gradient to at most this 2-norm (Pascanu et al. 2013)."""
        for gradient in self._module_gradients:
            gradient.mul_(torch.clamp(max_norm / (torch.linalg.vector_norm(gradient) + 1e-6), max=1.0))


class FlatAdam(FlatParameters):
    """Adam (Kingma & Ba 2015) over all parameters of some modules."""

    def __init__(self, *modules: nn.Module, learning_rate: float) -> None:
        super().__init__(*modules)
        self._flat = nn.Parameter(self.values)
        self._flat.grad = self.gradients
        self._adam = torch.optim.Adam([self._flat], learning_rate, fused=True)

    @property
    def learning_rate(self) -> float:
        """Of the next step."""
        return float(self._adam.param_groups[0]["lr"])

    @learning_rate.setter
    def learning_rate(self, value: float) -> None:
        self._adam.param_groups[0]["lr"] = value

    def step(self) -> None:
        """One step against `gradients`."""
        self._adam.step()

    def descend(self, loss: Tensor) -> None:
        """One step against the gradient of a scalar, by autograd."""
        self.differentiate(loss)
        self.step()

    def state(self) -> dict[str, NDArray[np.generic]]:
        """Parameters and moments, for `load_state`."""
        state: dict[str, Tensor] = {"values": self.values, **self._adam.state.get(self._flat, {})}
        return {name: tensor.cpu().numpy().copy() for name, tensor in state.items()}

    def load_state(self, state: Mapping[str, NDArray[np.generic]]) -> None:
        """Continues where `state` was taken."""
        tensors = {name: torch.from_numpy(np.array(array)).to(self.values.device) for name, array in state.items()}
        self.values.copy_(tensors.pop("values"))
        self._adam.state[self._flat] = tensors

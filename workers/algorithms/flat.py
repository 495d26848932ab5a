"""The parameters of several modules as one vector: one kernel instead of one per layer, for Adam, clipping and averages."""

import math
from collections.abc import Mapping
from itertools import accumulate

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from workers.kernels.adam import BETA1, BETA2, EPSILON, adam_step, clip_norm


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
        self._modules = [slice(end - size, end) for size, end in zip(sizes, accumulate(sizes), strict=True)]

    def differentiate(self, loss: Tensor) -> None:
        """Overwrites `gradients` with those of a scalar, by autograd; other parameters get none."""
        self.gradients.zero_()
        torch.autograd.backward(loss, inputs=self._parameters)

    @property
    def finite(self) -> bool:
        """Whether every parameter is a finite number."""
        return bool(torch.isfinite(self.values).all())

    @torch.no_grad()
    def take_over(self, values: NDArray[np.generic]) -> None:
        """Overwrites the parameters with `values` (their number,); moments of an optimiser stay as they are."""
        self.values.copy_(torch.from_numpy(np.array(values, np.float32)))

    def clip_gradients(self, max_norm: float) -> None:
        """Scales each module's gradient to at most this 2-norm (Pascanu et al. 2013)."""
        for module in range(len(self._modules)):
            self.clip_gradient(module, max_norm)

    def clip_gradient(self, module: int, max_norm: float) -> None:
        """The same for one module, by its place."""
        gradient = self.gradients[self._modules[module]]
        if gradient.device.type == "cpu":
            clip_norm(gradient.numpy(), max_norm)
        else:
            gradient.mul_(torch.clamp(max_norm / (torch.linalg.vector_norm(gradient) + 1e-6), max=1.0))


class FlatAdam(FlatParameters):
    """Adam (Kingma & Ba 2015, Algorithm 1) over all parameters of some modules.

    Written out, since torch's own spends more time on groups and hooks than on a small network's arithmetic.
    """

    def __init__(self, *modules: nn.Module, learning_rate: float) -> None:
        super().__init__(*modules)
        self.learning_rate = learning_rate
        self._steps = [0] * len(modules)
        self._mean = torch.zeros_like(self.values)
        self._square = torch.zeros_like(self.values)

    @torch.no_grad()
    def step(self) -> None:
        """One step against `gradients`."""
        self._steps = [steps + 1 for steps in self._steps]
        self._move(slice(None), self._steps[0])

    @torch.no_grad()
    def step_of(self, module: int) -> None:
        """The same for one module, by its place; all must have come as far before `step` or `state`."""
        self._steps[module] += 1
        self._move(self._modules[module], self._steps[module])

    def _move(self, part: slice, steps: int) -> None:
        # Both bias corrections in one factor: m^ / (sqrt(v^) + eps) with v^ = v / c^2 is c m^ / (sqrt(v) + c eps).
        correction = math.sqrt(1.0 - BETA2**steps)
        rate, epsilon = self.learning_rate * correction / (1.0 - BETA1**steps), correction * EPSILON
        if self.values.device.type == "cpu":
            vectors = (self.values, self.gradients, self._mean, self._square)
            adam_step(*(vector.numpy()[part] for vector in vectors), rate, epsilon)
        else:
            self._step_in_tensors(part, rate, epsilon)

    def _step_in_tensors(self, part: slice, rate: float, epsilon: float) -> None:
        values, gradients, mean, square = self.values[part], self.gradients[part], self._mean[part], self._square[part]
        mean.lerp_(gradients, 1.0 - BETA1)
        square.mul_(BETA2).addcmul_(gradients, gradients, value=1.0 - BETA2)
        values.addcdiv_(mean, torch.sqrt(square).add_(epsilon), value=-rate)

    def descend(self, loss: Tensor) -> None:
        """One step against the gradient of a scalar, by autograd."""
        self.differentiate(loss)
        self.step()

    def state(self) -> dict[str, NDArray[np.generic]]:
        """Parameters and moments, for `load_state`."""
        tensors = {"values": self.values, "mean": self._mean, "square": self._square}
        return {name: tensor.cpu().numpy().copy() for name, tensor in tensors.items()} | {"steps": np.array(self._steps[0])}

    @torch.no_grad()
    def load_state(self, state: Mapping[str, NDArray[np.generic]]) -> None:
        """Continues where `state` was taken."""
        for name, tensor in (("values", self.values), ("mean", self._mean), ("square", self._square)):
            tensor.copy_(torch.from_numpy(np.array(state[name], np.float32)))
        self._steps = [int(state["steps"])] * len(self._steps)

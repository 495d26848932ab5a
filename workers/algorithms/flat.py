"""The parameters of several modules as one vector: one kernel instead of one per layer, for Adam, clipping and averages."""

import math
from collections.abc import Callable, Mapping
from functools import partial
from itertools import accumulate

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn

from sim.kernels.options import bound
from workers.kernels.adam import BETA1, BETA2, EPSILON, AdamSteps, adam_step, clip_norm


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
        # Their sum tells at once, unless it is too large while they are not.
        return math.isfinite(float(self.values.sum())) or bool(torch.isfinite(self.values).all())

    @torch.no_grad()
    def take_over(self, values: NDArray[np.generic]) -> None:
        """Overwrites the parameters with `values` (their number,); moments of an optimiser stay as they are."""
        self.values.copy_(torch.from_numpy(np.array(values, np.float32)))

    def clip_gradients(self, max_norm: float) -> None:
        """Scales each module's gradient to at most this 2-norm (Pascanu et al. 2013)."""
        for part in self._modules:
            gradient = self.gradients[part]
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
        self._steps = 0
        self._mean = torch.zeros_like(self.values)
        self._square = torch.zeros_like(self.values)
        self._compiled: Callable[[float, float], None] | None = None
        if self.values.device.type == "cpu":
            arrays = [vector.numpy() for vector in self.vectors]
            self._compiled = partial(bound(adam_step, *arrays, 0.0, 0.0), *arrays)

    @torch.no_grad()
    def step(self) -> None:
        """One step against `gradients`."""
        rate, epsilon = self.next_rates()
        if self._compiled is not None:
            self._compiled(rate, epsilon)
        else:
            self.step_by(rate, epsilon)

    @torch.no_grad()
    def step_by(self, rate: float | Tensor, epsilon: float | Tensor) -> None:
        """One step against `gradients` by what `next_rates` gave; tensors () are read where the device is, and when."""
        self._mean.lerp_(self.gradients, 1.0 - BETA1)
        self._square.mul_(BETA2).addcmul_(self.gradients, self.gradients, value=1.0 - BETA2)
        self.values.sub_(self._mean.div(torch.sqrt(self._square).add_(epsilon)).mul_(rate))

    def next_steps(self, count: int, max_norm: float) -> AdamSteps:
        """What compiled code needs to take the next `count` steps, which count as taken; on a CPU."""
        rates, epsilons = np.array([self.next_rates() for _ in range(count)], np.float64).reshape(count, 2).T.copy()
        starts = np.array([0, *(module.stop for module in self._modules)], np.int64)
        return AdamSteps(self._mean.numpy(), self._square.numpy(), starts, rates, epsilons, max_norm)

    @property
    def vectors(self) -> tuple[Tensor, Tensor, Tensor, Tensor]:
        """Parameters, gradients and both moments, all that a step changes."""
        return self.values, self.gradients, self._mean, self._square

    def next_rates(self) -> tuple[float, float]:
        """Rate and epsilon of the next step, which counts as taken."""
        # Both bias corrections in one factor: m^ / (sqrt(v^) + eps) with v^ = v / c^2 is c m^ / (sqrt(v) + c eps).
        self._steps += 1
        correction = math.sqrt(1.0 - BETA2**self._steps)
        return self.learning_rate * correction / (1.0 - BETA1**self._steps), correction * EPSILON

    def descend(self, loss: Tensor) -> None:
        """One step against the gradient of a scalar, by autograd."""
        self.differentiate(loss)
        self.step()

    def state(self) -> dict[str, NDArray[np.generic]]:
        """Parameters and moments, for `load_state`."""
        tensors = {"values": self.values, "mean": self._mean, "square": self._square}
        return {name: tensor.cpu().numpy().copy() for name, tensor in tensors.items()} | {"steps": np.array(self._steps)}

    @torch.no_grad()
    def load_state(self, state: Mapping[str, NDArray[np.generic]]) -> None:
        """Continues where `state` was taken."""
        for name, tensor in (("values", self.values), ("mean", self._mean), ("square", self._square)):
            tensor.copy_(torch.from_numpy(np.array(state[name], np.float32)))
        self._steps = int(state["steps"])

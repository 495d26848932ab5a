"""What an algorithm of an extension learns with: its setting, a base class that keeps its state, and tools of the others.

An algorithm is called as follows, again and again: `act` and `record` for each of `steps_per_update` steps, then `update`.
`Learner` does the rest: a checkpoint holds its modules, optimisers and generator, and a training that is resumed goes on bit
for bit.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor, nn
from torch.optim import Optimizer

from workers.algorithms.added import Setting
from workers.algorithms.base import Arrays, with_prefix, without_prefix
from workers.algorithms.storage.return_scaler import ReturnScaler
from workers.algorithms.storage.rollout import RolloutStorage, generalized_advantages
from workers.networks.inputs import Inputs
from workers.networks.modules import GaussianActor, take_weights

__all__ = [
    "GaussianActor",
    "Inputs",
    "Learner",
    "ReturnScaler",
    "RolloutStorage",
    "Setting",
    "generalized_advantages",
]

Floats = NDArray[np.float32]
Bools = NDArray[np.bool_]


class Learner(ABC):
    """Base of an algorithm.

    Args:
        setting: what it learns with.
        policy: the network of the deterministic policy, observations (n, size) to (n, A) before they are bounded.
        modules: everything that has parameters, `policy` in it, by names that stay the same.
        optimizers: of those parameters, by names that stay the same; only tensors of their state are kept, so that a
            learning rate that changes is to be set in each `update`.
        generator: where everything that is random comes from.
        steps_per_update: steps of each robot between two updates.
    """

    def __init__(
        self,
        setting: Setting,
        *,
        policy: nn.Module,
        modules: Mapping[str, nn.Module],
        optimizers: Mapping[str, Optimizer],
        generator: torch.Generator,
        steps_per_update: int,
    ) -> None:
        self.setting, self.policy = setting, policy
        self.modules, self.optimizers, self.generator = dict(modules), dict(optimizers), generator
        self.robots, self.steps_per_update = setting.robots, steps_per_update

    @abstractmethod
    def act(self, observations: Floats) -> Floats:
        """Exploring actions (robots, A) for observations (robots, size)."""

    @abstractmethod
    def record(
        self,
        observations: Floats,
        rewards: Floats,
        terminations: Bools,
        truncations: Bools,
        final_observations: Floats,
    ) -> None:
        """What followed the actions of the last `act`, see `workers.algorithms.base.Algorithm.record`."""

    @abstractmethod
    def update(self, progress: float) -> dict[str, float]:
        """Learn from what was recorded; `progress` is the part of the training that is done. Returns diagnostics."""

    def own_state(self) -> dict[str, NDArray[np.generic]]:
        """Arrays to keep besides modules, optimisers and generator; none unless overridden."""
        return {}

    def load_own_state(self, state: Arrays) -> None:  # noqa: B027 (nothing to do where there is no state of its own)
        """Continue where `own_state` was taken."""

    @property
    def finite(self) -> bool:
        """Whether every weight is a finite number."""
        return all(bool(torch.isfinite(tensor).all()) for _, tensor in self._tensors())

    def policy_weights(self) -> dict[str, NDArray[np.float32]]:
        """A copy of the policy's weights."""
        return {name: tensor.cpu().numpy().copy() for name, tensor in self.policy.state_dict().items()}

    def begin_with(self, weights: Arrays, state: Arrays | None) -> tuple[str, ...]:
        """Takes over another training's policy and, where `state` has them in the same shapes, modules beside it."""
        take_weights(self.policy, weights)
        if state is None:
            return ()
        taken = []
        for prefix, module in self.modules.items():
            theirs = without_prefix(f"module/{prefix}", state)
            own = module.state_dict()
            fits = {name: array.shape for name, array in theirs.items()} == {n: tuple(own[n].shape) for n in own}
            if fits and all(part is not self.policy for part in module.modules()):
                module.load_state_dict({name: torch.from_numpy(np.array(array)) for name, array in theirs.items()})
                taken.append(prefix)
        return tuple(taken)

    def state(self) -> dict[str, NDArray[np.generic]]:
        """Everything that `load_state` needs to continue bit for bit."""
        arrays: dict[str, NDArray[np.generic]] = {name: _array(tensor) for name, tensor in self._tensors()}
        for name, optimizer in self.optimizers.items():
            for index, state in optimizer.state_dict()["state"].items():
                kept = {key: _array(tensor) for key, tensor in state.items() if isinstance(tensor, Tensor)}
                arrays.update(with_prefix(f"optimizer/{name}/{index}", kept))
        arrays["generator"] = self.generator.get_state().numpy().copy()
        return {**arrays, **with_prefix("own", self.own_state())}

    def snapshot(self) -> Callable[[], dict[str, NDArray[np.generic]]]:
        """`state` as it is now, for whoever asks later."""
        state = self.state()
        return lambda: state

    def load_state(self, state: Arrays) -> None:
        """Continue where `state` was taken."""
        with torch.no_grad():
            for name, tensor in self._tensors():
                tensor.copy_(torch.from_numpy(np.array(state[name])))
        for name, optimizer in self.optimizers.items():
            document = optimizer.state_dict()
            document["state"] = _by_index(without_prefix(f"optimizer/{name}", state))
            optimizer.load_state_dict(document)
        self.generator.set_state(torch.from_numpy(np.array(state["generator"], np.uint8)))
        self.load_own_state(without_prefix("own", state))

    def _tensors(self) -> Iterator[tuple[str, Tensor]]:
        for prefix, module in self.modules.items():
            for name, tensor in module.state_dict().items():
                yield f"module/{prefix}/{name}", tensor


def _array(tensor: Tensor) -> NDArray[np.generic]:
    array: NDArray[np.generic] = tensor.detach().cpu().numpy().copy()
    return array


def _by_index(state: Arrays) -> dict[int, dict[str, Tensor]]:
    by_index: dict[int, dict[str, Tensor]] = {}
    for path, array in state.items():
        index, _, key = path.partition("/")
        by_index.setdefault(int(index), {})[key] = torch.from_numpy(np.array(array))
    return by_index

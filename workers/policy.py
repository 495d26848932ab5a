"""A trained policy: observations to actions with NumPy alone where that can be, or through torch."""

from collections.abc import Mapping
from functools import cached_property

import numpy as np

from sim.actions import DEFAULT_ACTIONS, ActionComponent, ActionLayout
from sim.arrays import Floats
from workers.export.ros2.mapless_navigator.policy import NumpyNetwork
from workers.networks.config import NetworkConfig
from workers.networks.description import Description, describe
from workers.networks.inputs import Inputs, as_inputs


class Policy:
    """A deterministic policy; it keeps nothing between calls, so any thread may call it.

    It needs NumPy only where its network is one of those that ship, else torch. A recurrent one is a
    `sim.drivers.RecurrentPolicy`: called without a memory, every robot begins an episode.

    Args:
        network: the network that the weights belong to.
        weights: its arrays by name, as `policy_shapes` has them.
        inputs: what an observation is, or how many numbers it has.
        actions: what an action is.
    """

    def __init__(
        self,
        network: NetworkConfig,
        weights: Mapping[str, Floats],
        inputs: Inputs | int,
        actions: ActionLayout = DEFAULT_ACTIONS,
    ) -> None:
        self.network = network
        self.inputs = as_inputs(inputs)
        self.actions = actions
        self.weights = dict(weights)

    @cached_property
    def description(self) -> Description | None:
        """What its network computes, where that is known."""
        return describe(self.network, self.inputs, self.actions.size)

    @property
    def memory_size(self) -> int:
        """Numbers that it remembers of a robot."""
        return self.description.memory if self.description else 0

    def __call__(self, observations: Floats) -> Floats:
        """Observations (n, size) to actions (n, A), see `sim.actions`."""
        return self.step(observations, np.zeros((len(observations), self.memory_size), np.float32))[0]

    def step(self, observations: Floats, memory: Floats) -> tuple[Floats, Floats]:
        """Observations (n, size) and memory (n, memory_size) to actions (n, A) and the next memory."""
        if self._by_numpy is None:
            return self._by_torch(observations), memory
        logits, following = self._by_numpy(observations, memory)
        columns = [_bounded(logits[:, k : k + 1], component) for k, component in enumerate(self.actions.components)]
        return np.concatenate(columns, axis=1, dtype=np.float32), following

    @cached_property
    def _by_numpy(self) -> NumpyNetwork | None:
        return NumpyNetwork(self.description.lines, self.weights) if self.description else None

    @cached_property
    def _by_torch(self) -> "TorchPolicy":
        return torch_policy(self)


class TorchPolicy:
    """The same policy run by torch on the CPU: faster for many robots, and on as many threads as torch is told."""

    def __init__(self, policy: Policy) -> None:
        import torch

        from workers.networks.modules import fresh_network

        self._module, self._actions = fresh_network(policy.network, policy.inputs, policy.actions.size), policy.actions
        self._module.load_state_dict({name: torch.from_numpy(array.copy()) for name, array in policy.weights.items()})
        self._module.requires_grad_(False)
        self.memory_size = policy.memory_size

    def __call__(self, observations: Floats) -> Floats:
        """See `Policy`."""
        return self.step(observations, np.zeros((len(observations), self.memory_size), np.float32))[0]

    def step(self, observations: Floats, memory: Floats) -> tuple[Floats, Floats]:
        """See `Policy.step`."""
        import torch

        from workers.networks.squashing import bound_actions

        with torch.no_grad():
            if not self.memory_size:
                chosen: Floats = bound_actions(self._module(torch.from_numpy(observations)), self._actions).numpy()
                return chosen, memory
            logits, following = self._module(torch.from_numpy(observations), torch.from_numpy(memory))
            return bound_actions(logits, self._actions).numpy(), following.numpy()


def torch_policy(policy: Policy) -> TorchPolicy:
    """A policy run by torch."""
    return TorchPolicy(policy)


def _bounded(logits: Floats, component: ActionComponent) -> Floats:
    """One component of an action from its logits."""
    if component.symmetric:
        bounded: Floats = np.tanh(logits)
        return bounded
    # 1 / (1 + exp(-x)) overflows for very negative x; its tanh form does not.
    sigmoid: Floats = 0.5 * (1.0 + np.tanh(0.5 * logits))
    return sigmoid if component.low == 0.0 else component.low + component.span * sigmoid

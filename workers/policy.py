"""A trained policy: observations to actions with NumPy alone, or through torch."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from sim.arrays import PolicyFunction
from workers.config import Network, ResBlockNetwork
from workers.networks.layout import ACTION_SIZE, LEAKY_SLOPE, layout


class Policy:
    """A deterministic policy that needs NumPy only; it keeps nothing between calls, so any thread may call it.

    Args:
        network: the network that the weights belong to.
        weights: arrays under the names of `layout`.
    """

    def __init__(self, network: Network, weights: Mapping[str, NDArray[np.float32]]) -> None:
        self.network = network
        self.weights = dict(weights)

    def __call__(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Observations (n, size) to actions (n, 2): linear velocity in [0, 1] and angular velocity in [-1, 1]."""
        forward = self._resblock if isinstance(self.network, ResBlockNetwork) else self._mlp
        logits = forward(observations)
        # 1 / (1 + exp(-x)) overflows for very negative x; its tanh form does not.
        linear = 0.5 * (1.0 + np.tanh(0.5 * logits[:, :1]))
        return np.concatenate((linear, np.tanh(logits[:, 1:])), axis=1, dtype=np.float32)

    def _linear(self, layer: str, inputs: NDArray[np.float32]) -> NDArray[np.float32]:
        product: NDArray[np.float32] = inputs @ self.weights[f"{layer}.weight"].T
        product += self.weights[f"{layer}.bias"]
        return product

    def _mlp(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        *hidden, head = layout(self.network).layers
        relu = layout(self.network).activation == "relu"
        values = observations
        for layer in hidden:
            values = self._linear(layer, values)
            values = np.maximum(values, 0.0) if relu else np.tanh(values)
        return self._linear(head, values)

    def _resblock(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        hidden = self._linear("layer2", _leaky(self._linear("layer1", observations)))
        first = _leaky(np.concatenate((hidden, observations), axis=1))
        hidden = _leaky(self._linear("layer4", _leaky(self._linear("layer3", first))))
        second = _leaky(np.concatenate((hidden, first), axis=1))
        return self._linear("head", second)


def torch_policy(network: Network, weights: Mapping[str, NDArray[np.float32]]) -> PolicyFunction:
    """The same policy run by torch on the CPU: faster for many robots, and on as many threads as torch is told."""
    import torch

    from workers.networks.modules import bound_actions, build_network

    first = "layer1" if isinstance(network, ResBlockNetwork) else layout(network).layers[0]
    with torch.random.fork_rng(devices=[]):
        module = build_network(network, weights[f"{first}.weight"].shape[1], ACTION_SIZE)
    module.load_state_dict({name: torch.from_numpy(array.copy()) for name, array in weights.items()})

    @torch.no_grad()
    def act(observations: NDArray[np.float32]) -> NDArray[np.float32]:
        actions: NDArray[np.float32] = bound_actions(module(torch.from_numpy(observations))).numpy()
        return actions

    return act


def _leaky(values: NDArray[np.float32]) -> NDArray[np.float32]:
    leaky: NDArray[np.float32] = np.maximum(values, np.float32(LEAKY_SLOPE) * values)
    return leaky

"""A running measure of how large returns are, so that the critic's targets are near one whatever the reward's unit."""

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

_EPSILON = 1e-8


class ReturnScaler:
    """Divides rewards by the running standard deviation of the discounted return so far (Engstrom et al. 2020, sec. 3).

    The mean is not subtracted: that would change which behaviour is best.
    """

    def __init__(self, robots: int, gamma: float) -> None:
        self._gamma = gamma
        self._returns = np.zeros(robots)
        self._count = 0.0
        self._mean = 0.0
        self._variance = 1.0

    @property
    def scale(self) -> float:
        """What a reward is multiplied by."""
        return 1.0 / math.sqrt(self._variance + _EPSILON)

    def update(self, rewards: NDArray[np.float32], dones: NDArray[np.bool_]) -> None:
        """Takes in a rollout: rewards and dones, (steps, robots)."""
        returns = np.empty(rewards.shape)
        current = self._returns
        for step, reward in enumerate(rewards):
            current = current * self._gamma + reward
            returns[step] = current
            current = np.where(dones[step], 0.0, current)
        self._returns = current
        # Moments of two samples together (Chan et al. 1979).
        total = self._count + returns.size
        delta = float(returns.mean()) - self._mean
        within = float(returns.var()) * returns.size + (self._variance * self._count if self._count else 0.0)
        self._variance = (within + delta * delta * self._count * returns.size / total) / total
        self._mean += delta * returns.size / total
        self._count = total

    def take_over(self, state: Mapping[str, NDArray[np.generic]], count: int) -> None:
        """Begins with the measure of another training, which counts as so many returns: rewards may differ from now on."""
        moments = np.asarray(state["moments"], np.float64)
        self._count, self._mean, self._variance = min(float(moments[0]), float(count)), float(moments[1]), float(moments[2])

    def state(self) -> dict[str, NDArray[np.generic]]:
        """For `load_state`."""
        return {"returns": self._returns.copy(), "moments": np.array([self._count, self._mean, self._variance])}

    def load_state(self, state: Mapping[str, NDArray[np.generic]]) -> None:
        """Continues where `state` was taken."""
        self._returns = np.array(state["returns"], np.float64)
        self._count, self._mean, self._variance = np.asarray(state["moments"], np.float64).tolist()

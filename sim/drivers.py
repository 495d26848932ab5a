"""A policy at the wheel: what a recurrent one remembers of each robot is kept here, apart from the policy."""

from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

from sim.arrays import Floats, PolicyFunction


class RecurrentPolicy(Protocol):
    """A policy that may remember; `Driver` keeps its memory, which is zeros where an episode begins.

    Attributes:
        memory_size: numbers that it remembers of a robot, 0 where it remembers nothing.
    """

    memory_size: int

    def step(self, observations: Floats, memory: Floats) -> tuple[Floats, Floats]:
        """Observations (n, numbers) and memory (n, memory_size) to actions (n, A) and the next memory."""


class Driver:
    """Drives some robots by a policy, which may be replaced by a newer one of the same network at any time.

    Args:
        policy: any; one that does not remember is simply called.
        robots: how many there are.
    """

    def __init__(self, policy: PolicyFunction, robots: int) -> None:
        self.policy = policy
        self._memory = np.zeros((robots, getattr(policy, "memory_size", 0)), np.float32)

    def __call__(self, observations: Floats, robots: NDArray[np.int64] | None = None) -> Floats:
        """Actions (n, A) of all robots, or of those with these indices, for their observations (n, numbers)."""
        if not self._memory.shape[1]:
            return self.policy(observations)
        rows = slice(None) if robots is None else robots
        actions, self._memory[rows] = cast("RecurrentPolicy", self.policy).step(observations, self._memory[rows])
        return actions

    def copy(self) -> "Driver":
        """One that goes on from what this one remembers."""
        other = Driver(self.policy, len(self._memory))
        other._memory[:] = self._memory
        return other

    def forget(self, ended: NDArray[np.bool_]) -> None:
        """Forgets the robots (n,) whose episode has ended."""
        self._memory[ended] = 0.0

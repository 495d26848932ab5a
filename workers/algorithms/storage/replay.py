"""What off-policy algorithms remember: the last so many steps of every robot, in preallocated arrays."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from sim.actions import DEFAULT_ACTIONS
from workers.algorithms.base import Arrays


@dataclass(frozen=True, slots=True)
class Transitions:
    """Samples from the memory: n rows each, in the same order.

    Attributes:
        observations: (n, size).
        actions: (n, A) as the environment executed them.
        rewards: (n, 1).
        continues: (n, 1), 0 where the episode ended for good and nothing followed, else 1 (also at time-outs).
        next_observations: (n, size), what followed; where the step limit cut the episode, its last observation.
    """

    observations: Tensor
    actions: Tensor
    rewards: Tensor
    continues: Tensor
    next_observations: Tensor


class ReplayBuffer:
    """A ring of vector steps: all robots' transitions of one step are one slot.

    One row holds a whole transition, so that a minibatch is one gather.

    Args:
        capacity: transitions, rounded up to whole vector steps.
        robots: transitions a step.
        observation_size: numbers in an observation.
        device: where the memory lives.
        action_size: numbers in an action.
    """

    def __init__(
        self,
        capacity: int,
        robots: int,
        observation_size: int,
        device: torch.device,
        action_size: int = DEFAULT_ACTIONS.size,
    ) -> None:
        self._slots = -(-capacity // robots)
        self._robots = robots
        sizes = (observation_size, action_size, 1, 1, observation_size)
        bounds = np.cumsum((0, *sizes))
        self._columns = tuple(slice(int(a), int(b)) for a, b in pairwise(bounds))
        self._memory = torch.zeros(self._slots, robots, int(bounds[-1]), device=device)
        self._next = 0
        self._filled = 0
        # As of the mark: next and filled, then the slots that were overwritten since, each as it was.
        self._marked: tuple[int, int] | None = None
        self._overwritten: list[tuple[int, Tensor]] = []

    def __len__(self) -> int:
        return self._filled * self._robots

    def add(
        self, observations: Tensor, actions: Tensor, rewards: Tensor, continues: Tensor, next_observations: Tensor
    ) -> None:
        """Remembers one step of all robots, over the oldest one when full; see `Transitions` for the meaning."""
        slot = self._memory[self._next]
        if self._marked is not None and self._next < self._marked[1] and len(self._overwritten) < self._marked[1]:
            self._overwritten.append((self._next, slot.clone()))
        for column, values in zip(
            self._columns, (observations, actions, rewards, continues, next_observations), strict=True
        ):
            slot[:, column] = values.view(self._robots, -1)
        self._next = (self._next + 1) % self._slots
        self._filled = min(self._filled + 1, self._slots)

    def sample(self, batches: int, size: int, generator: torch.Generator) -> Iterator[Transitions]:
        """`batches` minibatches of `size` transitions, drawn evenly and with replacement."""
        rows = torch.randint(len(self), (batches * size,), generator=generator, device=self._memory.device)
        drawn = self._memory.flatten(0, 1)[rows]
        for start in range(0, batches * size, size):
            yield Transitions(*(drawn[start : start + size, column] for column in self._columns))

    def mark(self) -> None:
        """Remember this moment for `marked_state`, in place of an earlier one; costs what is overwritten from now on."""
        self._marked = self._next, self._filled
        self._overwritten.clear()

    def marked_state(self) -> dict[str, NDArray[np.generic]]:
        """`state` as it was at the last `mark`."""
        assert self._marked is not None
        next_slot, filled = self._marked
        memory = self._memory[:filled].clone()
        for index, slot in self._overwritten:
            memory[index] = slot
        return self._state(memory, next_slot)

    def state(self) -> dict[str, NDArray[np.generic]]:
        """For `load_state`; what followed a step is left out where it is the next step's observation anyway."""
        return self._state(self._memory[: self._filled], self._next)

    def _state(self, memory: Tensor, next_slot: int) -> dict[str, NDArray[np.generic]]:
        filled = memory.cpu().numpy()
        before, following = filled[:, :, self._columns[0]], filled[:, :, self._columns[-1]]
        differs = np.any(following != np.roll(before, -1, axis=0), axis=2)
        return {
            "rows": filled[:, :, : self._columns[-1].start].copy(),
            "differs": differs,
            "following": following[differs],
            "next": np.array(next_slot),
        }

    def load_state(self, state: Arrays) -> None:
        """Continues where `state` was taken."""
        rows = np.asarray(state["rows"], np.float32)
        after = np.roll(rows[:, :, self._columns[0]], -1, axis=0)
        after[np.asarray(state["differs"], np.bool_)] = state["following"]
        self._filled, self._next = len(rows), int(state["next"])
        self._memory[: self._filled] = torch.from_numpy(np.concatenate((rows, after), axis=2))

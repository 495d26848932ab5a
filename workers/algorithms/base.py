"""What every algorithm offers the training loop."""

from collections.abc import Callable, Mapping
from typing import Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from sim.engine.guidance import Guidance

Arrays = Mapping[str, NDArray[np.generic]]


class Algorithm(Protocol):
    """Acts, remembers, updates; `workers.training.trainer` is the loop around it.

    Attributes:
        robots: how many it drives side by side.
        steps_per_update: steps of each robot between two updates.
    """

    robots: int
    steps_per_update: int

    def act(self, observations: NDArray[np.float32]) -> NDArray[np.float32]:
        """Exploring actions (robots, A) for observations (robots, size)."""

    def record(
        self,
        observations: NDArray[np.float32],
        rewards: NDArray[np.float32],
        terminations: NDArray[np.bool_],
        truncations: NDArray[np.bool_],
        final_observations: NDArray[np.float32],
    ) -> None:
        """What followed the actions of the last `act`.

        Args:
            observations: (robots, size), of the next episode where one ended in this step.
            rewards: (robots,).
            terminations: (robots,), ended for good: nothing followed.
            truncations: (robots,), cut by the step limit: the value of what would have followed counts.
            final_observations: (robots, size), valid where an episode ended: the last observation of that episode.
        """

    def update(self, progress: float) -> dict[str, float]:
        """Learns from what was recorded.

        Args:
            progress: part of the training that is done, 0 to 1, for schedules.

        Returns:
            Diagnostics under the project's metric names.
        """

    @property
    def finite(self) -> bool:
        """Whether every weight is a finite number."""

    def policy_weights(self) -> dict[str, NDArray[np.float32]]:
        """A copy of the deterministic policy's weights, under the names that the archive documents."""

    def begin_with(self, weights: Arrays, state: Arrays | None) -> tuple[str, ...]:
        """Takes over the networks of another training before the first `act`; all else begins as configured.

        Args:
            weights: of a deterministic policy that fits (`workers.misfit`), as `policy_weights` has them.
            state: the `state` that belongs to it, where an algorithm of the same name made it and its networks fit too.

        Returns:
            What was taken over besides the policy, in words.
        """

    def state(self) -> dict[str, NDArray[np.generic]]:
        """Everything that `load_state` needs to continue bit for bit."""

    def snapshot(self) -> Callable[[], dict[str, NDArray[np.generic]]]:
        """`state` as it is now, for whoever asks later; cheap now, and only the newest one can be asked."""

    def load_state(self, state: Arrays) -> None:
        """Continues where `state` was taken."""


@runtime_checkable
class Guided(Protocol):
    """An algorithm whose critic may be told what only a simulator knows of the way ahead.

    Attributes:
        is_guided: whether it is.
        guidance: of its robots, as the environment keeps it: given before the first `act`.
    """

    is_guided: bool
    guidance: Guidance | None


@runtime_checkable
class Threaded(Protocol):
    """An algorithm that can use several threads, with the same result bit for bit.

    Attributes:
        threads: of the next update.
    """

    threads: int


def with_prefix(prefix: str, arrays: Arrays) -> dict[str, NDArray[np.generic]]:
    """The arrays under 'prefix/name'."""
    return {f"{prefix}/{name}": array for name, array in arrays.items()}


def without_prefix(prefix: str, arrays: Arrays) -> dict[str, NDArray[np.generic]]:
    """Those arrays that stand under 'prefix/', without it: undoes `with_prefix`."""
    return {name.removeprefix(f"{prefix}/"): array for name, array in arrays.items() if name.startswith(f"{prefix}/")}

"""Between the trainer and the live view: what the trainer tells whoever turns a training into frames."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from sim.arrays import PolicyFunction

if TYPE_CHECKING:
    from sim.envs.vector import NavigationVectorEnv


class TrainingViewer(Protocol):
    """Called from the training loop; each call must cost next to nothing while nobody watches.

    `workers.live.viewer.LiveViewer(task, reporter)` is the one that makes frames; `Unwatched` is for trainings that nobody
    can watch.
    """

    def on_step(self, env: "NavigationVectorEnv", step: int) -> None:
        """After each step of the training robots; `env`'s arrays are overwritten by the next one.

        Args:
            env: the training environment, just stepped.
            step: environment steps of all robots together, this one included.
        """

    def on_weights(self, snapshot: Callable[[], PolicyFunction], step: int) -> None:
        """After each update.

        Args:
            snapshot: makes a copy of the newest policy; call it only in this call, on this thread, and only when needed.
            step: environment steps that these weights have learned from.
        """

    def close(self) -> None:
        """The training is over: stop every thread of the view."""


class Unwatched:
    """A viewer that never looks."""

    def on_step(self, env: "NavigationVectorEnv", step: int) -> None:
        """Does nothing."""

    def on_weights(self, snapshot: Callable[[], PolicyFunction], step: int) -> None:
        """Does nothing."""

    def close(self) -> None:
        """Does nothing."""

"""How the nodes that move are set: at once by viser, or through whoever passes on what has changed."""

from typing import Any, Protocol

import viser
from numpy.typing import NDArray


class Moving(Protocol):
    """Where the nodes of a scene are set."""

    def put(self, node: viser.SceneNodeHandle, prop: str, value: NDArray[Any]) -> None:
        """Sets a property of a node; the caller may go on to change `value`."""

    def forget(self, node: viser.SceneNodeHandle) -> None:
        """The node is about to go."""


class ByViser:
    """Every property is set by viser itself, which sends or records it."""

    def put(self, node: viser.SceneNodeHandle, prop: str, value: NDArray[Any]) -> None:
        """Sets it at once."""
        setattr(node, prop, value)

    def forget(self, node: viser.SceneNodeHandle) -> None:
        """Nothing is kept of it."""

"""What a kind of fault is, and what it may get hold of."""

import random
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Literal

from benchmarks.chaos.stack import Mode, Node, Stack

Heal = Callable[[], None]


@dataclass
class Scene:
    """Where a fault is injected.

    Attributes:
        stack: the service.
        run_id: a run that trains now: the victim, or for a fault of the whole service one of those that notice.
        node: the worker that trains it.
        dice: the only source of chance.
        damaged: ids of the checkpoints whose archives were damaged on purpose.
    """

    stack: Stack
    run_id: str
    node: Node
    dice: random.Random
    damaged: set[str] = field(default_factory=set)


class MissedError(Exception):
    """The moment for this fault did not come: the run ended meanwhile, say. It is not counted."""


@dataclass(frozen=True)
class Kind:
    """A kind of fault.

    Attributes:
        name: as the table has it.
        what: is done, in one line for the table.
        inject: does it, and returns when its cause is gone; or at once, with what takes the cause away, where the service
            must go on in spite of it.
        scope: 'run' hits one run and its worker, 'service' all of them.
        heard: 'closed' where somebody hears at once that something is gone, 'silent' where only the end of a lease tells.
        new_attempt: whether another attempt must take the run up.
        modes: in which there is such a part.
    """

    name: str
    what: str
    inject: Callable[[Scene], Heal | None]
    scope: Literal["run", "service"]
    heard: Literal["closed", "silent"]
    new_attempt: bool = False
    modes: tuple[Mode, ...] = ("embedded", "production")

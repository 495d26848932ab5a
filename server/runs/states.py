"""A run's life: which state may follow which, and on what occasion.

    queued ──claim──> running ──complete──> completed
      │ ^ ^             │ │ │
      │ │ └──release────┘ │ └──fail──> failed ──resume──> queued
      │ └─────lose────────┤
      │                 stop
     stop                 v
      │               stopping ──halt, release, lose──> stopped ──resume──> queued
      └──> stopped

Once too many attempts in a row were lost, the caller, who counts them, says `fail` in place of `lose`.
"""

from typing import Literal

from server.database.tables import RunState
from server.errors import ConflictError

Occasion = Literal[
    "claim",  # a worker takes it up
    "stop",  # a person wants it to end
    "resume",  # a person wants it to go on
    "complete",  # the worker has done all steps
    "halt",  # the worker has ended early because it was asked to
    "release",  # the worker shuts down and hands it back, with a checkpoint
    "lose",  # the worker was not heard of for longer than its lease
    "fail",  # the worker reports an error, or too many attempts were lost
]

ACTIVE: frozenset[RunState] = frozenset({"running", "stopping"})
FINISHED: frozenset[RunState] = frozenset({"stopped", "completed", "failed"})

TRANSITIONS: dict[tuple[RunState, Occasion], RunState] = {
    ("queued", "claim"): "running",
    ("queued", "stop"): "stopped",
    ("running", "stop"): "stopping",
    ("running", "complete"): "completed",
    ("running", "halt"): "stopped",
    ("running", "release"): "queued",
    ("running", "lose"): "queued",
    ("running", "fail"): "failed",
    ("stopping", "stop"): "stopping",
    ("stopping", "complete"): "completed",
    ("stopping", "halt"): "stopped",
    ("stopping", "release"): "stopped",
    ("stopping", "lose"): "stopped",
    ("stopping", "fail"): "failed",
    ("stopped", "resume"): "queued",
    ("failed", "resume"): "queued",
}


class TransitionError(ConflictError):
    """The run is in a state in which that can't happen."""

    def __init__(self, state: RunState, occasion: Occasion) -> None:
        possible = sorted(known for known, on in TRANSITIONS if on == occasion)
        super().__init__(f"A run that is {state} can't {occasion}; only one that is {' or '.join(possible)} can.")
        self.state = state
        self.occasion = occasion


def next_state(state: RunState, occasion: Occasion) -> RunState:
    """The state that follows.

    Raises:
        TransitionError: nothing follows on this occasion.
    """
    try:
        return TRANSITIONS[state, occasion]
    except KeyError:
        raise TransitionError(state, occasion) from None


def allows(state: RunState, occasion: Occasion) -> bool:
    """Whether `next_state` has an answer."""
    return (state, occasion) in TRANSITIONS

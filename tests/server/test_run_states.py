"""A run's life, state by state."""

from typing import get_args

import pytest

from server.database.tables import RunState
from server.runs.states import ACTIVE, FINISHED, TRANSITIONS, Occasion, TransitionError, next_state

STATES: tuple[RunState, ...] = get_args(RunState)
OCCASIONS: tuple[Occasion, ...] = get_args(Occasion)


@pytest.mark.parametrize(
    ("life", "end"),
    [
        (["claim", "complete"], "completed"),
        (["claim", "stop", "halt"], "stopped"),
        (["claim", "stop", "halt", "resume", "claim", "complete"], "completed"),
        (["stop"], "stopped"),
        (["claim", "lose", "claim", "fail", "resume"], "queued"),
        (["claim", "release", "claim"], "running"),
        # Who asked for a stop gets one, whatever becomes of the worker; and a run that was quicker is done.
        (["claim", "stop", "lose"], "stopped"),
        (["claim", "stop", "release"], "stopped"),
        (["claim", "stop", "complete"], "completed"),
        # Pressing stop twice is once.
        (["claim", "stop", "stop"], "stopping"),
    ],
)
def test_lives(life: list[Occasion], end: RunState) -> None:
    state: RunState = "queued"
    for occasion in life:
        state = next_state(state, occasion)

    assert state == end


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("occasion", OCCASIONS)
def test_everything_that_is_not_in_the_table_is_refused(state: RunState, occasion: Occasion) -> None:
    if (state, occasion) in TRANSITIONS:
        assert next_state(state, occasion) in STATES
        return
    with pytest.raises(TransitionError, match=f"is {state} can't {occasion}"):
        next_state(state, occasion)


def test_only_a_worker_and_a_person_move_a_run() -> None:
    by_people = {occasion for state, occasion in TRANSITIONS if state in FINISHED}
    assert by_people == {"resume"}
    assert ("completed", "resume") not in TRANSITIONS
    assert {state for state, occasion in TRANSITIONS if occasion == "lose"} == ACTIVE
    assert {state for state, occasion in TRANSITIONS if occasion == "claim"} == {"queued"}

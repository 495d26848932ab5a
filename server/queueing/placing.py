"""Which priorities bring a run to a place in the queue: as few others' as can be are changed with it."""

from collections.abc import Callable, Sequence
from itertools import groupby
from typing import NamedTuple


class Standing(NamedTuple):
    """A run in the queue, in the order of its turns."""

    run_id: str
    priority: int


def placed(order: Sequence[Standing], moved: str, at: int, allowed: Callable[[str, int], bool]) -> dict[str, int] | None:
    """The priorities to be given so that a run stands at a place; none where it does.

    Among equal priorities turns go by what people have of the workers. So a run stands between two of one priority only
    where those on one side of it are moved on, each by as little as keeps the order between different priorities.

    Args:
        order: all that wait.
        moved: id of the run.
        at: its place among the others, from 0.
        allowed: whether a run may be given a priority.

    Returns:
        None where neither side may be moved on.
    """
    others = [each for each in order if each.run_id != moved]
    if order[at : at + 1] == [each for each in order if each.run_id == moved]:
        return {}
    ways = (_above_risen(others[:at], others[at:], moved), _below_fallen(others[:at], others[at:], moved))
    possible = [way for way in ways if way is not None and all(allowed(*each) for each in way.items())]
    return min(possible, key=len, default=None)


def _above_risen(above: Sequence[Standing], below: Sequence[Standing], moved: str) -> dict[str, int] | None:
    if not below:
        return None
    given = {moved: below[0].priority + 1}
    least = given[moved]
    for priority, group in groupby(reversed(above), key=lambda each: each.priority):
        if priority > least:
            break
        least += 1
        given |= {each.run_id: least for each in group}
    return given


def _below_fallen(above: Sequence[Standing], below: Sequence[Standing], moved: str) -> dict[str, int] | None:
    if not above:
        return None
    given = {moved: above[-1].priority - 1}
    most = given[moved]
    for priority, group in groupby(below, key=lambda each: each.priority):
        if priority < most:
            break
        most -= 1
        given |= {each.run_id: most for each in group}
    return given

"""When those who wait will have their turn, from how quick the workers are; where that is not known, nothing is said."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from workers.protocol import Queue


@dataclass(frozen=True)
class Place:
    """A worker that takes up one run at a time.

    Attributes:
        name: of the worker.
        queue: that it works for.
        free_in: seconds until its run has ended, 0 if it has none; None where the run has not said yet how quick it is.
    """

    name: str
    queue: Queue
    free_in: float | None


@dataclass(frozen=True)
class Turn:
    """A run that waits.

    Attributes:
        steps: that it still has to do.
        places: names of the workers that could train it.
    """

    steps: int
    places: frozenset[str]


def forecast(places: Sequence[Place], turns: Sequence[Turn], speed: Mapping[Queue, float]) -> list[float | None]:
    """Seconds until each of the runs begins, in the order of their turn; None where that is not known.

    Each goes to the first place that becomes free and could train it, as the claims do.

    Args:
        places: the workers that take up runs.
        turns: the runs, the next one first.
        speed: steps a second of a run on a worker of a queue; absent where nothing has run there yet.
    """
    free: dict[str, float | None] = {place.name: place.free_in for place in places}
    queue = {place.name: place.queue for place in places}
    begins: list[float | None] = []
    for turn in turns:
        known = [(at, name) for name, at in free.items() if at is not None and name in turn.places]
        begin, name = min(known, default=(None, None))
        # One of whom nothing is known may be free before.
        if begin != 0.0 and any(free[each] is None for each in turn.places if each in free):
            begin = None
        begins.append(begin)
        if name is None:
            continue
        rate = speed.get(queue[name])
        free[name] = begin + turn.steps / rate if begin is not None and rate else None
    return begins

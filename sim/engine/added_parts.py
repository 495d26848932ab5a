"""The parts of an observation that extensions compute, for many robots at a time."""

from dataclasses import dataclass

import numpy as np

from sim.arrays import Floats
from sim.config import AddedObservationPart, TaskConfig
from sim.errors import ObservationError
from sim.extending.discovery import implementation
from sim.extending.observing import See, Sight
from sim.observations import observation_layout


@dataclass(frozen=True, eq=False)
class _Part:
    """One part: its name, its function, and the ranges of its numbers."""

    name: str
    see: See
    lows: Floats
    highs: Floats


class AddedParts:
    """The parts of a task's observation that the compiled code knows nothing of; there may be none.

    Args:
        task: whose observation it is.

    Attributes:
        places: of each part in an observation, the newest first, by its name.
    """

    def __init__(self, task: TaskConfig) -> None:
        layout = observation_layout(task)
        self._parts: list[_Part] = []
        for part in task.observation.parts:
            if isinstance(part, AddedObservationPart):
                numbers = part.numbers()
                lows, highs = np.array([[number.low, number.high] for number in numbers], np.float32).T
                see: See = implementation(part)(part, task)
                self._parts.append(_Part(part.name, see, lows, highs))
        self.places = {part.name: layout.places(part.name) for part in self._parts}

    def __len__(self) -> int:
        return len(self._parts)

    def seen(self, sight: Sight) -> dict[str, Floats]:
        """The numbers (n, numbers) of each part now, by its name.

        Raises:
            ObservationError: a function gives something else than a finite number for each.
        """
        seen = {}
        for part in self._parts:
            values = np.asarray(part.see(sight), np.float32)
            expected = len(sight), len(part.lows)
            if values.shape != expected or not np.isfinite(values).all():
                raise ObservationError(
                    f"the observation's part {part.name!r} should be {expected} finite numbers, a row a robot, and its "
                    f"function returns {values.shape} of which {np.count_nonzero(~np.isfinite(values))} are not finite"
                )
            seen[part.name] = np.clip(values, part.lows, part.highs)
        return seen

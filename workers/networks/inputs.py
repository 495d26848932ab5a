"""What a network is given: how many numbers, and where among them the LiDAR's ranges lie."""

from dataclasses import dataclass

from sim.config import TaskConfig
from sim.observations import observation_layout


@dataclass(frozen=True)
class Inputs:
    """The numbers that go into a network.

    Attributes:
        size: how many.
        ranges: where the LiDAR's ranges lie, first and one past the last, the newest frame first, all equally long; empty
            where nothing is known of them.
    """

    size: int
    ranges: tuple[tuple[int, int], ...] = ()

    def and_also(self, numbers: int) -> "Inputs":
        """The same with so many others after them: a critic's, to which the actions are given too."""
        return Inputs(self.size + numbers, self.ranges)


def inputs_of(task: TaskConfig) -> Inputs:
    """What a policy of this task is given."""
    layout = observation_layout(task)
    return Inputs(layout.size, tuple((place.start, place.stop) for place in layout.places("ranges")))


def as_inputs(inputs: Inputs | int) -> Inputs:
    """A number alone is a size."""
    return Inputs(inputs) if isinstance(inputs, int) else inputs

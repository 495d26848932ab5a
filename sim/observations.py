"""The observations that a policy may see: named, versioned and explained number by number.

Both have `batches + 6` numbers, 16 with the default scanner. A name's meaning never changes: a different layout gets another
version, and a checkpoint says which one it was trained on. Where frames are stacked, the same numbers follow as they were a
step before, two steps before and so on; an episode begins with its first frame repeated.
"""

from dataclasses import dataclass, replace
from typing import Literal

from sim.config import ObservationName, TaskConfig
from sim.kernels.records import EXTRA


@dataclass(frozen=True)
class ObservationNumber:
    """One number of an observation.

    Attributes:
        name: what it is.
        formula: how it is computed; lengths in metres, angles in radians.
        low, high: the range that it stays in.
    """

    name: str
    formula: str
    low: float
    high: float


@dataclass(frozen=True)
class ObservationLayout:
    """What every number of an observation means."""

    name: ObservationName
    version: Literal[1]
    numbers: tuple[ObservationNumber, ...]

    @property
    def size(self) -> int:
        """Numbers in one observation."""
        return len(self.numbers)


def observation_size(task: TaskConfig) -> int:
    """Numbers in one observation of this task."""
    return task.frames * frame_size(task)


def frame_size(task: TaskConfig) -> int:
    """Numbers of one observation that belong to one moment."""
    return task.lidar.batches + EXTRA


def near_distance(task: TaskConfig) -> float:
    """Distance at which the improved observation's inverse range reaches 1, metres: the collision distance or the body."""
    return max(task.collision_distance, task.robot.inscribed_radius)


def observation_layout(task: TaskConfig) -> ObservationLayout:
    """Every number of a task's observation, in order: the newest frame first."""
    newest = _frame_layout(task)
    earlier = (
        replace(number, name=f"{number.name}, {age} before", formula=f"{number.name} {age} step{'s'[: age > 1]} before")
        for age in range(1, task.frames)
        for number in newest.numbers
    )
    return replace(newest, numbers=(*newest.numbers, *earlier))


def _frame_layout(task: TaskConfig) -> ObservationLayout:
    rays = task.lidar.rays // task.lidar.batches
    batches = range(task.lidar.batches)
    velocities = (
        ObservationNumber("linear velocity", "linear velocity of the last step / its limit", 0.0, 1.0),
        ObservationNumber("angular velocity", "angular velocity of the last step / its limit", -1.0, 1.0),
    )
    if task.observation == "paper":
        return ObservationLayout(
            name="paper",
            version=1,
            numbers=(
                *(
                    ObservationNumber(
                        f"range {k}", f"min(ranges[{k * rays}:{(k + 1) * rays}]) / {task.lidar.range:g}", 0.0, 1.0
                    )
                    for k in batches
                ),
                *velocities,
                ObservationNumber("target distance", "distance to the target / the arena's diagonal", 0.0, 1.0),
                ObservationNumber("target direction", "(atan2(dy, dx) mod 2 pi) / 2 pi, in the arena's frame", 0.0, 1.0),
                ObservationNumber("yaw", "(heading mod 2 pi) / 2 pi", 0.0, 1.0),
                ObservationNumber("heading deviation", "|bearing| / pi, where bearing = atan2(dy, dx) - heading", 0.0, 1.0),
            ),
        )
    near = near_distance(task)
    return ObservationLayout(
        name="improved",
        version=1,
        numbers=(
            *(
                ObservationNumber(
                    f"nearness {k}", f"{near:g} / max(min(ranges[{k * rays}:{(k + 1) * rays}]), {near:g})", 0.0, 1.0
                )
                for k in batches
            ),
            *velocities,
            ObservationNumber("target distance", "d / (d + 1 m), where d = distance to the target", 0.0, 1.0),
            ObservationNumber("bearing", "bearing / pi, where bearing = atan2(dy, dx) - heading, left positive", -1.0, 1.0),
            ObservationNumber("yaw", "heading / pi", -1.0, 1.0),
            ObservationNumber("heading deviation", "|bearing| / pi", 0.0, 1.0),
        ),
    )

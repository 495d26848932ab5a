"""What an action is: its numbers for a robot, their names, units and ranges, and how an unbounded number becomes one.

Every space, network head, exploration noise, export and page takes it from here. An action is a row of fractions of the
robot's limits, one for each component: 1 is all of it, `low` the lowest that the robot takes.

| drive           | components                | they move the middle of the body by                                  |
|-----------------|---------------------------|----------------------------------------------------------------------|
| differential    | linear, angular           | v forwards, turning at w                                             |
| omnidirectional | linear, lateral, angular  | v forwards and u to the left, turning at w                           |
| ackermann       | linear, steering          | v forwards and w L / 2 to the left, turning at w = v tan(d) / L       |

with the wheel base L and the steering angle d, which is less where w would go beyond the top turning rate.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sim.config import AckermannDrive, AnyRobotConfig, BurgerConfig, OmnidirectionalDrive

ComponentName = Literal["linear", "lateral", "angular", "steering"]


@dataclass(frozen=True)
class ActionComponent:
    """One number of an action.

    A network's unbounded number x becomes tanh(x) where the range is symmetric, elsewhere low + (1 - low) / (1 + exp(-x)).

    Attributes:
        name: short and unique in the action.
        low: lowest fraction, -1 to 0; the highest is 1.
        limit: what a fraction of 1 stands for.
        unit: of `limit`.
        direction: where a positive one goes.
    """

    name: ComponentName
    low: float
    limit: float
    unit: str
    direction: str

    @property
    def symmetric(self) -> bool:
        """Whether it goes both ways alike."""
        return self.low == -1.0

    @property
    def turns(self) -> bool:
        """Whether it is what turns the robot: the last component."""
        return self.name in ("angular", "steering")

    @property
    def span(self) -> float:
        """Width of its range: 1 where it goes one way only, 2 where it goes both ways."""
        return 1.0 - self.low

    @property
    def meaning(self) -> str:
        """What a fraction of 1 commands."""
        return f"x {self.limit} {self.unit} {self.direction}"

    @property
    def measure(self) -> str:
        """What is measured of it: a velocity, or the steering angle."""
        return "steering angle" if self.name == "steering" else f"{self.name} velocity"

    def squashing(self, logit: str) -> str:
        """The formula by which an unbounded number becomes this one."""
        if self.symmetric:
            return f"tanh({logit})"
        sigmoid = f"/ (1 + exp(-{logit}))"
        return f"1 {sigmoid}" if self.low == 0.0 else f"{self.low:g} + {self.span:g} {sigmoid}"


@dataclass(frozen=True)
class ActionLayout:
    """All numbers of an action, in order."""

    components: tuple[ActionComponent, ...]

    @property
    def size(self) -> int:
        """Numbers in an action."""
        return len(self.components)

    @property
    def names(self) -> tuple[str, ...]:
        """Of the components."""
        return tuple(component.name for component in self.components)

    @cached_property
    def lows(self) -> tuple[float, ...]:
        """Lowest fraction of each; the highest is 1."""
        return tuple(component.low for component in self.components)

    @property
    def limits(self) -> tuple[float, ...]:
        """What a fraction of 1 stands for, of each in its unit."""
        return tuple(component.limit for component in self.components)

    @property
    def half_spans(self) -> tuple[float, ...]:
        """Half the width of each range, by which noise is scaled: the same deviation then means as much for all."""
        return tuple(0.5 * component.span for component in self.components)

    @property
    def formula(self) -> str:
        """How the numbers y of a network become an action."""
        return ", ".join(component.squashing(f"y[{index}]") for index, component in enumerate(self.components))


def action_layout(robot: AnyRobotConfig) -> ActionLayout:
    """What an action is for a robot."""
    drive = robot.drive
    linear = ActionComponent("linear", 0.0 - drive.reverse, robot.max_linear_speed, "m/s", "forwards")
    if isinstance(drive, AckermannDrive):
        limit = math.radians(drive.steering_limit)
        return ActionLayout((linear, ActionComponent("steering", -1.0, limit, "rad", "of steering, positive to the left")))
    angular = ActionComponent("angular", -1.0, robot.max_angular_speed, "rad/s,", "positive to the left")
    if isinstance(drive, OmnidirectionalDrive):
        sideways = drive.sideways * robot.max_linear_speed
        return ActionLayout((linear, ActionComponent("lateral", -1.0, sideways, "m/s", "to the left"), angular))
    return ActionLayout((linear, angular))


def twists(
    robot: AnyRobotConfig,
    fractions: ArrayLike,
    max_linear_speed: ArrayLike | None = None,
    max_angular_speed: ArrayLike | None = None,
) -> NDArray[np.float64]:
    """How the middle of a body moves by commands that it follows, written plainly: kept through a period it is an exact arc.

    Args:
        robot: whose drive it is.
        fractions: (N, A) commands within their ranges.
        max_linear_speed: (N,) or one for all, m/s, where it is not the robot's.
        max_angular_speed: likewise, rad/s.

    Returns:
        (N, 3) speeds forwards and to the left, m/s, and turning rate, rad/s, positive to the left.
    """
    drive, share = robot.drive, np.asarray(fractions, dtype=np.float64).T
    fastest = np.asarray(robot.max_linear_speed if max_linear_speed is None else max_linear_speed, dtype=np.float64)
    turning = np.asarray(robot.max_angular_speed if max_angular_speed is None else max_angular_speed, dtype=np.float64)
    forwards = share[0] * fastest
    if isinstance(drive, AckermannDrive):
        turn = forwards * np.tan(math.radians(drive.steering_limit) * share[1]) / drive.wheel_base
        turn = np.clip(turn, -turning, turning)
        return np.stack([forwards, 0.5 * drive.wheel_base * turn, turn], axis=1)
    if isinstance(drive, OmnidirectionalDrive):
        return np.stack([forwards, drive.sideways * fastest * share[1], share[2] * turning], axis=1)
    return np.stack([forwards, np.zeros_like(forwards), share[1] * turning], axis=1)


def fastest_way(robot: AnyRobotConfig, max_linear_speed: float, max_angular_speed: float) -> float:
    """Speed of the middle of a body that nothing exceeds, m/s, with these limits in place of the robot's."""
    drive = robot.drive
    if isinstance(drive, AckermannDrive):
        return math.hypot(max_linear_speed, 0.5 * drive.wheel_base * max_angular_speed)
    if isinstance(drive, OmnidirectionalDrive):
        return math.hypot(max_linear_speed, drive.sideways * max_linear_speed)
    return max_linear_speed


DEFAULT_ACTIONS = action_layout(BurgerConfig())
"""The actions of the default robot."""

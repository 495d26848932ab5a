"""Controllers that need no training: what a policy has to beat."""

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sim.actions import DEFAULT_ACTIONS, ActionLayout
from sim.config import AckermannDrive, OmnidirectionalDrive, TaskConfig
from sim.errors import ObservationError
from sim.observations import observation_layout

Floats = NDArray[np.float32]
PolicyFunction = Callable[[Floats], Floats]

_CREEP = 0.2  # share of the top speed at which a car that cannot reverse turns round
_TURN_GAIN = 2.0  # 1/s; quick turns that do not overshoot at a control period of 0.2 s


def random_policy(seed: int = 0, actions: ActionLayout = DEFAULT_ACTIONS) -> PolicyFunction:
    """Actions drawn uniformly from the action space, whatever it sees."""
    rng = np.random.default_rng(seed)
    return lambda observations: rng.uniform(actions.lows, 1.0, (len(observations), actions.size)).astype(np.float32)


def go_to_goal(task: TaskConfig) -> PolicyFunction:
    """Turn towards the target and drive, slower the more it has to turn; blind to obstacles.

    An omnidirectional robot drives straight at the target while it turns towards it. An Ackermann drive steers towards it,
    and turns round for one behind it: backwards with the wheels turned the other way where it reverses, else in a curve.

    Raises:
        ObservationError: the observation does not tell where the target is, see `bearing_reader`.
    """
    robot, drive = task.robot, task.robot.drive
    bearings = bearing_reader(task)

    def act(observations: Floats) -> Floats:
        angle = bearings(observations)
        ahead = np.cos(angle)
        if isinstance(drive, AckermannDrive):
            steering = np.clip(angle / math.radians(drive.steering_limit), -1.0, 1.0)
            backs = (ahead < 0.0) & (drive.reverse > 0.0)
            linear = np.where(backs, -drive.reverse, np.clip(ahead, _CREEP, 1.0))
            return np.stack([linear, np.where(backs, -steering, steering)], axis=1).astype(np.float32)
        angular = np.clip(_TURN_GAIN * angle / robot.max_angular_speed, -1.0, 1.0)
        if isinstance(drive, OmnidirectionalDrive):
            linear, lateral = np.clip(ahead, -drive.reverse, 1.0), np.clip(np.sin(angle) / drive.sideways, -1.0, 1.0)
            return np.stack([linear, lateral, angular], axis=1).astype(np.float32)
        return np.stack([np.clip(ahead, 0.0, 1.0), angular], axis=1).astype(np.float32)

    return act


def bearing_reader(task: TaskConfig) -> Callable[[Floats], Floats]:
    """Reads the direction of the target against the heading, (n,) radians in [-pi, pi], from observations (n, numbers).

    Raises:
        ObservationError: the observation has neither the target's bearing, nor its direction and the heading.
    """
    newest = {block.key: block for block in observation_layout(task).blocks if block.age == 0}
    if bearing := newest.get("bearing"):
        at = bearing.start
        if len(bearing.numbers) == 2:
            return lambda seen: np.asarray(np.arctan2(seen[:, at], seen[:, at + 1]), dtype=np.float32)
        return lambda seen: np.asarray(seen[:, at] * np.pi, dtype=np.float32)
    direction, heading = newest.get("direction"), newest.get("heading")
    if direction is None or heading is None:
        raise ObservationError(
            "driving straight to the target takes the observation's part 'bearing', or 'direction' and 'heading': this "
            f"one has {', '.join(newest)}"
        )
    target, yaw, turn = direction.start, heading.start, 1.0 if heading.numbers[0].low == 0.0 else 2.0

    def read(seen: Floats) -> Floats:
        turns = seen[:, target] - seen[:, yaw] / np.float32(turn)
        return np.asarray((turns - np.round(turns)) * 2.0 * np.pi, dtype=np.float32)

    return read

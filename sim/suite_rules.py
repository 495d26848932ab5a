"""What a suite asks of a robot and its task beyond the arenas (pydantic only: the server asks too)."""

import json
import math
from collections.abc import Iterator
from functools import cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, Field

from sim.config import AnyRobotConfig, CentredMount, Frozen, LidarConfig, TaskConfig
from sim.errors import SuiteError
from sim.frozen import suite_text

LEAST_STEPS = 500
"""Steps that every attempt has under `SuiteRules.patience`."""


class SuiteLidar(LidarConfig):
    """A LiDAR, and how many numbers of its scan a baseline's observation has: in suites' files they stand together."""

    batches: int = Field(10, ge=1, le=360)


class SuiteRules(Frozen):
    """What is the same for everybody who is measured on a suite.

    Attributes:
        robot: body and limits; None leaves them to the task.
        arrival_distance: metres; None leaves it to the task.
        collision_distance: metres, as `TaskConfig.collision_distance`; None leaves it to the task.
        lidar: the widest and furthest scan that is allowed, and what baselines see; None allows any. One that is mounted
            elsewhere than in the middle is to be mounted there.
        control_period: seconds from one action of a baseline to the next; a policy has its own.
        patience: an attempt lasts so many times as long as its shortest path takes at top speed, at least `LEAST_STEPS`
            steps: who has no map must look.
        time_limit: seconds of an attempt, whatever its path; it goes before `patience`.
    """

    robot: AnyRobotConfig | None = None
    arrival_distance: float | None = None
    collision_distance: float | None = None
    lidar: SuiteLidar | None = None
    control_period: float | None = None
    patience: float | None = Field(None, gt=0.0)
    time_limit: float | None = Field(None, gt=0.0)

    def content(self) -> dict[str, Any]:
        """What is asked for, as a suite's file and hash have it.

        What is as usual is left out, so that settings that come later change neither.
        """
        content = self.model_dump(mode="json", exclude_defaults=True)
        if self.robot is not None:
            content["robot"]["name"] = self.robot.name
        if self.lidar is not None and "mount" in content["lidar"]:
            content["lidar"]["mount"]["name"] = self.lidar.mount.name
        if self.lidar is not None:  # in the order that the hashes are of
            order = dict.fromkeys(("rays", "batches", *LidarConfig.model_fields))
            content["lidar"] = {name: content["lidar"][name] for name in order if name in content["lidar"]}
        return content

    def task(self) -> TaskConfig:
        """The default task with what these rules ask for: what baselines are driven with."""
        names = ("robot", "lidar", "arrival_distance", "collision_distance", "control_period")
        asked = {name: getattr(self, name) for name in names}
        if self.lidar is not None:
            asked["lidar"] = self.lidar.model_dump()  # with its batches, which belong to the observation
        return TaskConfig.model_validate({name: value for name, value in asked.items() if value is not None})

    def check(self, suite: str, task: TaskConfig) -> None:
        """Whether a task may be measured on the suite of this name.

        Raises:
            SuiteError: it is another robot, or sees more; the message says what differs.
        """
        if self.robot is not None and self.robot != task.robot:
            asked, given = _title(self.robot), _title(task.robot)
            if asked == given:
                given = f"one that differs ({', '.join(_differences(self.robot, task.robot))})"
            raise SuiteError(
                f"suite {suite!r} is for the robot {asked}, and this policy drives {given}: "
                "measure it on a suite for any robot, or a policy that was trained for that one here"
            )
        for name in ("arrival_distance", "collision_distance"):
            wanted, own = getattr(self, name), getattr(task, name)
            if wanted is not None and own != wanted:
                raise SuiteError(
                    f"suite {suite!r} has {name.replace('_', ' ')}s of {wanted:g} m, and this policy was trained with "
                    f"{own:g} m: measure it on another suite"
                )
        for name, unit in (("field_of_view", "degrees"), ("range", "m")):
            given = getattr(task.lidar, name)
            if self.lidar is not None and given > getattr(self.lidar, name):
                raise SuiteError(f"suite {suite!r} lets a robot see {getattr(self.lidar, name):g} {unit}, not {given:g}")

        if self.lidar is not None and self.lidar.mount not in (CentredMount(), task.lidar.mount):
            raise SuiteError(
                f"suite {suite!r} has its LiDAR mounted {_places(self.lidar)}, and this policy's is {_places(task.lidar)}: "
                "measure it on another suite"
            )

    def step_limits(self, task: TaskConfig, shortest_paths: NDArray[np.float64]) -> NDArray[np.int64]:
        """(S,) steps that each attempt may take, from the shortest paths (S,), metres."""
        if self.time_limit is not None:
            return np.full(len(shortest_paths), math.ceil(round(self.time_limit / task.control_period, 6)))
        if self.patience is None:
            return np.full(len(shortest_paths), task.step_limit)
        quickest = shortest_paths / (task.robot.max_linear_speed * task.control_period)
        return np.maximum(LEAST_STEPS, np.ceil(self.patience * quickest)).astype(np.int64)


@cache
def frozen_rules(name: str) -> SuiteRules:
    """Those of a frozen suite.

    Raises:
        OSError: there is none of this name.
    """
    return SuiteRules.model_validate(json.loads(suite_text(name)).get("rules", {}))


def _title(robot: AnyRobotConfig) -> str:
    return type(robot).model_fields["name"].title or robot.name


def _differences(asked: BaseModel, given: BaseModel) -> Iterator[str]:
    """As "linear acceleration 20, not 0", field by field, where they are of one kind."""
    for name, field in type(asked).model_fields.items():
        one, other = getattr(asked, name), getattr(given, name)
        if one == other:
            continue
        if isinstance(one, BaseModel) and type(one) is type(other):
            yield from _differences(one, other)
        else:
            yield f"{(field.title or name).lower()} {_word(one)}, not {_word(other)}"


def _word(value: Any) -> str:
    if isinstance(value, BaseModel):
        return str(getattr(value, "name", type(value).__name__))
    return f"{value:g}" if isinstance(value, float) else str(value)


def _places(lidar: LidarConfig) -> str:
    """As "at (0.055, 0) m", ahead and to the left of the middle."""
    places = [
        f"({x:g}, {y:g}) m" + (f" turned by {math.degrees(yaw):g}°" if yaw else "") for x, y, yaw in lidar.mount.places
    ]
    return f"at {' and '.join(places)}"

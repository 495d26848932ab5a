"""The navigation task in episodes of one target each, as tools that expect a standard environment want it.

`Mapless/PointGoal-v0` differs from `Mapless/Navigation-v0` in when an episode ends: an arrival terminates it, as a collision
does, and Gymnasium's time limit (`max_episode_steps`) truncates it. The task's own `step_limit` makes no difference here.
"""

from typing import Any, ClassVar

import numpy as np
from gymnasium.spaces import Box, Space
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from sim.actions import ActionLayout, action_layout
from sim.envs.single import NavigationEnv
from sim.envs.vector import Floats, NavigationVectorEnv, Task, read_task
from sim.kernels.records import ARRIVAL

_UNLIMITED = np.iinfo(np.int32).max


def symmetric_space(layout: ActionLayout) -> Space[Floats]:
    """Actions in [-1, 1], each from the lowest that the robot takes to the highest."""
    return Box(-1.0, 1.0, (layout.size,), np.float32)


def from_symmetric(actions: Floats, layout: ActionLayout) -> Floats:
    """Actions (..., A) in [-1, 1] as the robot takes them."""
    scale = np.array(layout.half_spans, dtype=np.float32)
    offset = np.ones(layout.size, dtype=np.float32) - scale
    return np.asarray(offset + scale * np.asarray(actions, dtype=np.float32), dtype=np.float32)


class PointGoalEnv(NavigationEnv):
    """A robot that drives to one target; see `sim.envs.single.NavigationEnv`.

    `is_success` is in the info of every step: True where it arrived. Without `gymnasium.make` there is no time limit.

    Args:
        task: arena, robot, LiDAR, observation and reward.
        symmetric_actions: whether all of an action is in [-1, 1], as libraries assume that do not scale actions themselves.
        render_mode: see `NavigationEnv`.

    Raises:
        pydantic.ValidationError: a value of the task is wrong.
        ArenaError: the robot does not fit into the arena.
        DisplayError: "human" where there is no display, or no pygame.
        ValueError: there is no such render mode.
    """

    _ARRIVAL_ENDS: ClassVar[bool] = True

    def __init__(self, task: Task = None, *, symmetric_actions: bool = False, render_mode: str | None = None) -> None:
        super().__init__(read_task(task).model_copy(update={"step_limit": _UNLIMITED}), render_mode=render_mode)
        self._symmetric = symmetric_actions
        self._layout = action_layout(self.task.robot)
        if symmetric_actions:
            self.action_space = symmetric_space(self._layout)

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Drive for one control period.

        Args:
            action: (A,) as fractions of the robot's limits, see `action_space`; clipped.

        Returns:
            Observation, reward, terminated (arrival or collision), truncated (never: the time limit is a wrapper's), and an
            info with `pose`, `target`, `is_success` and, where the attempt ended, its `attempt`.

        Raises:
            ValueError: the action is not finite.
        """
        return super().step(from_symmetric(action, self._layout) if self._symmetric else action)

    def _info(self) -> dict[str, Any]:
        return super()._info() | {"is_success": bool(self._world.robots.outcomes[0] == ARRIVAL)}


# Some tools (skrl 2.1) know a Gymnasium environment by the modules of the classes that it names as its bases itself.
class PointGoalVectorEnv(NavigationVectorEnv, VectorEnv[Floats, Floats, NDArray[Any]]):
    """Robots that drive to one target in every episode; see `sim.envs.vector.NavigationVectorEnv`.

    `infos["is_success"]` (N,) is there in every step, and where episodes ended in `infos["final_info"]` too.

    Args:
        task: arena, robot, LiDAR, observation and reward.
        num_envs: robots.
        max_episode_steps: after which an episode is truncated; None is never.
        symmetric_actions: whether all of an action is in [-1, 1].
        seed: see `NavigationVectorEnv`, as for all that follow.
        render_mode: likewise.
        copy: likewise.
        autoreset_mode: likewise, but the next step unless asked otherwise, as Gymnasium's own vector environments do it.

    Raises:
        pydantic.ValidationError: a value of the task is wrong.
        ArenaError: the robot does not fit into the arena.
        ValueError: there is no such render mode, not one robot, or it should never reset.
    """

    _ARRIVAL_ENDS: ClassVar[bool] = True

    def __init__(
        self,
        task: Task = None,
        num_envs: int = 1,
        *,
        max_episode_steps: int | None = None,
        symmetric_actions: bool = False,
        seed: int | None = None,
        render_mode: str | None = None,
        copy: bool = True,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
    ) -> None:
        limited = read_task(task).model_copy(update={"step_limit": max_episode_steps or _UNLIMITED})
        super().__init__(
            limited, num_envs, seed=seed, render_mode=render_mode, copy=copy, autoreset_mode=autoreset_mode
        )  # fmt: skip
        self._symmetric = symmetric_actions
        self._layout = action_layout(self.task.robot)
        if symmetric_actions:
            self.single_action_space = symmetric_space(self._layout)
            self.action_space = batch_space(self.single_action_space, num_envs)

    def step(self, actions: Floats) -> tuple[Floats, Floats, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Drive every robot for one control period; see `NavigationVectorEnv.step`.

        Args:
            actions: (N, A) as fractions of the robot's limits, see `single_action_space`; clipped.

        Raises:
            ValueError: the actions have the wrong shape or are not finite.
        """
        return super().step(from_symmetric(actions, self._layout) if self._symmetric else actions)

    def _infos(self) -> dict[str, Any]:
        infos = super()._infos()
        arrived = self.outcomes == ARRIVAL
        if "final_info" in infos:
            # The robots of `infos` itself are in their next episodes.
            infos["final_info"] |= {"is_success": arrived, "_is_success": infos["_final_info"]}
            arrived = np.zeros_like(arrived)
        return infos | {"is_success": arrived, "_is_success": np.ones(self.num_envs, dtype=np.bool_)}

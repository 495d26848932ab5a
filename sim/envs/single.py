"""The navigation task as a plain Gymnasium environment: one robot of the same code."""

from collections.abc import Mapping
from typing import Any, ClassVar

import gymnasium
import numpy as np
from numpy.typing import NDArray

from sim.actions import action_layout
from sim.arenas import build_task_arenas
from sim.engine.world import World
from sim.envs.render import render_robot
from sim.envs.vector import Floats, Task, known_mode, read_task, single_spaces
from sim.envs.window import Window

OUTCOMES = ("none", "arrival", "collision", "timeout")


class NavigationEnv(gymnasium.Env[Floats, Floats]):
    """A robot that drives to targets by its LiDAR; see `sim.envs.vector.NavigationVectorEnv`, of which it is the N = 1.

    Args:
        task: arena, robot, LiDAR, observation, reward, limits.
        render_mode: None, "rgb_array" for pictures, or "human" for a window that follows every step in real time.

    Raises:
        pydantic.ValidationError: a value of the task is wrong.
        ArenaError: the robot does not fit into the arena.
        DisplayError: "human" where there is no display, or no pygame.
        ValueError: there is no such render mode.
    """

    metadata: ClassVar[dict[str, Any]] = {"render_modes": ["rgb_array", "human"], "render_fps": 5}  # type: ignore[misc]

    _ARRIVAL_ENDS: ClassVar[bool] = False
    """Whether an arrival ends the episode."""

    def __init__(self, task: Task = None, *, render_mode: str | None = None) -> None:
        self.task = read_task(task)
        self.render_mode = known_mode(render_mode, self.metadata)
        self._window = Window("Mapless", self.task.control_period) if render_mode == "human" else None
        self.observation_space, self.action_space = single_spaces(self.task)
        self._action_size = action_layout(self.task.robot).size
        # The next episode waits for `reset`: pose and picture of a last step are those of the episode that it ends.
        self._world = World(
            self.task,
            build_task_arenas(self.task),
            1,
            arrival_ends=self._ARRIVAL_ENDS or self.task.arrival_ends,
            restart="reset",
        )

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Begin a new episode.

        Args:
            seed: start all random numbers anew from here.
            options: `pose` (x, y, heading) and `target` (x, y) place them; what is missing is drawn.

        Returns:
            The observation, (numbers,), and an info with `pose` and `target`.

        Raises:
            PlacementError: the pose or target does not fit, or an option is not known.
        """
        super().reset(seed=seed)
        if seed is not None:
            self._world.seed(seed)
        names = {"pose": "poses", "target": "targets"}
        self._world.reset_with({names.get(name, name): value for name, value in (options or {}).items()})
        self._show()
        return self._world.robots.observations[0].copy(), self._info()

    def step(self, action: Floats) -> tuple[Floats, float, bool, bool, dict[str, Any]]:
        """Drive for one control period.

        Args:
            action: (A,) fractions of the robot's limits, see `sim.actions`; clipped.

        Returns:
            Observation, reward, terminated (collision), truncated (time-out), and an info with `pose`, `target` and, where
            an attempt ended, its `attempt`. A target reached is replaced by the next; the episode goes on.

        Raises:
            ValueError: the action is not finite.
        """
        self._world.step(np.asarray(action, dtype=np.float32).reshape(1, self._action_size))
        robots = self._world.robots
        terminated, truncated = bool(robots.terminations[0]), bool(robots.truncations[0])
        self._show()
        info = self._info()
        if robots.outcomes[0]:
            record = robots.records[0]
            info["attempt"] = {
                "outcome": OUTCOMES[robots.outcomes[0]],
                "steps": int(record["steps"]),
                "reward": float(record["attempt_reward"]),
                "path_length": float(record["path_length"]),
                "min_clearance": float(record["min_clearance"]),
            }
        return robots.observations[0].copy(), float(robots.rewards[0]), terminated, truncated, info

    def _info(self) -> dict[str, Any]:
        robots = self._world.robots
        return {"pose": robots.poses[0].copy(), "target": robots.targets[0].copy()}

    def render(self) -> NDArray[np.uint8] | None:
        """A picture from above, (height, width, 3); None without a render mode, and for "human", whose window shows it."""
        return render_robot(self._world, 0) if self.render_mode == "rgb_array" else None

    def _show(self) -> None:
        if self._window is not None:
            self._window.show(render_robot(self._world, 0))

    def close(self) -> None:
        """Close the window, if there is one."""
        if self._window is not None:
            self._window.close()

    def get_state(self) -> dict[str, NDArray[Any]]:
        """Everything that the future depends on, as plain arrays."""
        return self._world.get_state()

    def set_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Go on from what `get_state` gave, bit for bit.

        Raises:
            ValueError: the state is of another task.
        """
        self._world.set_state(state)

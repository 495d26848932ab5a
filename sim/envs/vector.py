"""The navigation task as a Gymnasium vector environment: many robots stepped together."""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from gymnasium.spaces import Box, Space
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space
from numpy.typing import NDArray

from sim.actions import action_layout
from sim.arenas import Arena, build_task_arenas
from sim.config import TaskConfig
from sim.engine.rewards import term_names
from sim.engine.stretches import Crew
from sim.engine.world import Restart, World
from sim.envs.render import render_robot
from sim.observations import observation_layout

Floats = NDArray[np.float32]
Task = TaskConfig | Mapping[str, Any] | None
"""A task, the values in which it differs from the default one, or None for the default one."""


def read_task(task: Task) -> TaskConfig:
    """The task meant; raises pydantic's ValidationError where a value is wrong."""
    return task if isinstance(task, TaskConfig) else TaskConfig.model_validate(dict(task or {}))


def single_spaces(task: TaskConfig) -> tuple[Space[Floats], Space[Floats]]:
    """Observation and action space of one robot."""
    numbers = observation_layout(task).numbers
    observation: Space[Any] = Box(
        np.array([number.low for number in numbers], dtype=np.float32),
        np.array([number.high for number in numbers], dtype=np.float32),
    )
    actions = action_layout(task.robot)
    action: Space[Any] = Box(np.array(actions.lows, dtype=np.float32), np.ones(actions.size, dtype=np.float32))
    return observation, action


_RESTARTS: dict[AutoresetMode, Restart] = {AutoresetMode.SAME_STEP: "same step", AutoresetMode.NEXT_STEP: "next step"}


def known_mode(render_mode: str | None, metadata: Mapping[str, Any]) -> str | None:
    """The render mode; raises ValueError where `metadata` has none of this name."""
    if render_mode is not None and render_mode not in metadata["render_modes"]:
        raise ValueError(f"render_mode must be None or one of {metadata['render_modes']}, not {render_mode!r}")
    return render_mode


class NavigationVectorEnv(VectorEnv[Floats, Floats, NDArray[Any]]):
    """Robots that drive to targets by their LiDAR, each alone in its arena.

    An *attempt* is the way to one target and ends with an arrival, a collision or a time-out. An arrival pays its reward
    and brings a new target, and the episode goes on; a collision terminates the episode, a time-out truncates it. Unless
    asked otherwise, both start anew in the same step: the observation returned is the new episode's first, the last one is
    in `final_observations` and in `infos["final_obs"]`.

    Args:
        task: arena, robot, LiDAR, observation, reward, limits.
        num_envs: robots.
        seed: of all that is random, until `reset` gives another; None takes one from the operating system.
        render_mode: None, or "rgb_array" for pictures of the first robots.
        copy: whether `step` and `reset` return copies; False returns the environment's own arrays, which the next step
            overwrites.
        autoreset_mode: when the next episode of a robot begins: in the step that ended one, or, as Gymnasium's own vector
            environments do, in the one after it, whose action makes no difference and whose reward is 0.
        guides: whether `guidance` is kept, for critics that are told the way.

    Raises:
        pydantic.ValidationError: a value of the task is wrong.
        ArenaError: the robot does not fit into the arena.
        ValueError: there is no such render mode, not one robot, or it should never reset.

    >>> envs = NavigationVectorEnv(num_envs=4, seed=1)
    >>> observations, infos = envs.reset()
    >>> observations.shape
    (4, 16)
    """

    metadata: ClassVar[dict[str, Any]] = {  # type: ignore[misc]
        "autoreset_mode": AutoresetMode.SAME_STEP,
        "render_modes": ["rgb_array"],
        "render_fps": 5,
    }

    _ARRIVAL_ENDS: ClassVar[bool] = False
    """Whether an arrival ends the episode whatever the task says."""

    def __init__(
        self,
        task: Task = None,
        num_envs: int = 1,
        *,
        seed: int | None = None,
        render_mode: str | None = None,
        copy: bool = True,
        autoreset_mode: AutoresetMode | str = AutoresetMode.SAME_STEP,
        guides: bool = False,
    ) -> None:
        if num_envs < 1:
            raise ValueError(f"num_envs must be at least 1, not {num_envs}")
        mode = AutoresetMode(autoreset_mode)
        if mode not in _RESTARTS:
            raise ValueError(f"autoreset_mode must be {' or '.join(repr(one.value) for one in _RESTARTS)}")
        self.metadata = {**self.metadata, "autoreset_mode": mode}  # type: ignore[misc]  # as Gymnasium's own do
        self._same_step = mode is AutoresetMode.SAME_STEP
        self.task = read_task(task)
        self.num_envs = num_envs
        self.render_mode = known_mode(render_mode, self.metadata)
        self.single_observation_space, self.single_action_space = single_spaces(self.task)
        self.observation_space = batch_space(self.single_observation_space, num_envs)
        self.action_space = batch_space(self.single_action_space, num_envs)
        self._copy = copy
        self._world = World(
            self.task,
            build_task_arenas(self.task),
            num_envs,
            seed=seed,
            arrival_ends=self._ARRIVAL_ENDS or self.task.arrival_ends,
            restart=_RESTARTS[mode],
            guides=guides,
        )
        robots = self._world.robots
        self.poses = robots.poses
        """(N, 3) x, y in metres, heading in radians: in the robot's arena, after the step and its resets."""
        self.targets = robots.targets
        """(N, 2) metres."""
        self.ranges = robots.ranges
        """(N, rays) metres: the raw scan at `poses`."""
        self.fields_of_view = self._world.fields_of_view
        """(N,) degrees that each robot's rays cover in this episode, from which their angles follow (`sim.lidar`)."""
        self.outcomes = robots.outcomes
        """(N,) how the attempt that ended in this step ended: 1 arrival, 2 collision, 3 time-out; 0 where none did."""
        self.final_observations = robots.final_observations
        """(N, numbers) last observation of the episodes that ended in this step; meaningless elsewhere."""
        self.guidance = self._world.guidance
        """What the robots would have to know of the shortest paths to their targets; None unless asked for."""
        self.reward_terms = robots.terms
        """(N, terms) of this step's reward, named by `reward_term_names`."""
        self.reward_term_names = term_names(self.task.reward)
        records = robots.records
        self.attempt_steps: NDArray[np.int32] = records["steps"]
        """(N,) steps of the attempt that ended in this step, elsewhere of the one that goes on."""
        self.attempt_rewards: NDArray[np.float64] = records["attempt_reward"]
        """(N,) summed reward of that attempt."""
        self.attempt_path_lengths: NDArray[np.float64] = records["path_length"]
        """(N,) metres driven in that attempt."""
        self.attempt_min_clearances: Floats = records["min_clearance"]
        """(N,) smallest distance of the body from anything else in that attempt, metres."""
        self.arena_indices: NDArray[np.int32] = records["map"]
        """(N,) which of `arenas` each robot is in."""

        self.discs = self._world.movers.walking
        """(tiles, K, 5) movers of every copy of an arena: x, y, radius, and how far each came in the last step in x and y,
        metres; a radius below zero is none. `tiles` says which row a robot meets."""

    @property
    def threads(self) -> int:
        """How many threads follow the physics of a step, at most: the same bit for bit whatever their number."""
        return self._world.crew.threads

    @threads.setter
    def threads(self, threads: int) -> None:
        self._world.crew = Crew(threads)

    def places(self) -> NDArray[np.int32]:
        """(N,) row of `discs` of each robot, of robots that are together that of the first: the same for all that meet."""
        return self.tiles()[np.arange(self.num_envs) // self.task.together * self.task.together]

    def tiles(self) -> NDArray[np.int32]:
        """(N,) which copy of an arena each robot is in; modulo the number of arenas it is the arena."""
        return self._world.tiles()

    @property
    def arenas(self) -> tuple[Arena, ...]:
        """The arenas that robots start in."""
        return self._world.arenas

    def velocities(self) -> Floats:
        """(N, 2) speed forwards, m/s, and turning rate, rad/s, of the last step; zero for robots that started anew in it."""
        return self.twists()[:, [0, 2]]

    def twists(self) -> Floats:
        """(N, 3) speeds forwards and to the left, m/s, and turning rate, rad/s, of the middle of each body; likewise."""
        return self._world.twists()

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Floats, dict[str, Any]]:
        """Begin a new episode for every robot.

        Args:
            seed: start all random numbers anew from here.
            options: `poses` (N, 3), `targets` (N, 2) and `arenas` (N,) place the robots; what is missing is drawn.

        Returns:
            Observations (N, numbers), and infos (empty).

        Raises:
            PlacementError: a pose or target does not fit, or an option is not known.
        """
        super().reset(seed=seed)
        if seed is not None:
            self._world.seed(seed)
        self._world.reset_with(options)
        observations = self._world.robots.observations
        return (observations.copy() if self._copy else observations), {}

    def step(self, actions: Floats) -> tuple[Floats, Floats, NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Drive every robot for one control period.

        Args:
            actions: (N, A) fractions of the robot's limits, see `sim.actions`; clipped.

        Returns:
            Observations (N, numbers), rewards (N,), terminations (N,), truncations (N,), and infos: `attempt` where one
            ended, and where the next episode has begun in this step already `final_obs` and `final_info`, each with its
            mask `_attempt`, `_final_obs`, `_final_info`.

        Raises:
            ValueError: the actions have the wrong shape or are not finite.
        """
        actions = np.ascontiguousarray(actions, dtype=np.float32)
        expected = self.num_envs, action_layout(self.task.robot).size
        if actions.shape != expected:
            raise ValueError(f"actions must have shape {expected}, not {actions.shape}")
        self._world.step(actions)
        robots = self._world.robots
        results = (robots.observations, robots.rewards, robots.terminations, robots.truncations)
        infos = self._infos()
        if self._copy:
            observations, rewards, terminations, truncations = results
            return observations.copy(), rewards.copy(), terminations.copy(), truncations.copy(), infos
        return (*results, infos)

    def _infos(self) -> dict[str, Any]:
        """What ended in this step, in Gymnasium's layout: values, and a mask that says where they mean something."""
        robots = self._world.robots
        if not robots.outcomes.any():
            return {}
        attempts = {
            "outcome": robots.outcomes.copy(),
            "steps": self.attempt_steps.copy(),
            "reward": self.attempt_rewards.copy(),
            "path_length": self.attempt_path_lengths.copy(),
            "min_clearance": self.attempt_min_clearances.copy(),
        }
        infos: dict[str, Any] = {"attempt": attempts, "_attempt": robots.outcomes > 0}
        ended = robots.terminations | robots.truncations
        if self._same_step and ended.any():
            infos |= {"final_obs": robots.final_observations.copy(), "_final_obs": ended}
            infos |= {"final_info": {"attempt": attempts, "_attempt": ended}, "_final_info": ended}
        return infos

    def render(self) -> tuple[NDArray[np.uint8], ...] | None:
        """One picture of every robot, (height, width, 3) each; None without a render mode."""
        if self.render_mode is None:
            return None
        return tuple(render_robot(self._world, index) for index in range(self.num_envs))

    def get_state(self) -> dict[str, NDArray[Any]]:
        """Everything that the future depends on, as plain arrays."""
        return self._world.get_state()

    def set_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        """Go on from what `get_state` gave, bit for bit.

        Raises:
            ValueError: the state is of another task or number of robots.
        """
        self._world.set_state(state)

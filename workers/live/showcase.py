"""Policy mode of the live view: some robots of their own, driven by the newest weights at a chosen pace."""

import numpy as np
from numpy.typing import NDArray

from sim.actions import action_layout, twists
from sim.arenas import build_task_arenas
from sim.arrays import PolicyFunction
from sim.config import ArenaPool, TaskConfig
from sim.drivers import Driver
from sim.engine.world import World
from sim.scan import scan
from workers.frames import Frame


def along_arc(
    poses: NDArray[np.float32], velocities: NDArray[np.float32], seconds: float | NDArray[np.float32]
) -> NDArray[np.float32]:
    """Where robots are that have driven with constant velocities: exactly on the arc, as the simulation steps too.

    Args:
        poses: (N, 3) x, y, heading at the start; metres, radians.
        velocities: (N, 3) forwards and to the left, m/s, and turning rate, rad/s.
        seconds: how long they have driven; one number, or one for each.

    Returns:
        (N, 3) float32 poses, headings in [-pi, pi].
    """
    forwards, aside, rate = velocities.T
    turn = rate * seconds
    # The chord of an arc: NumPy's sinc is sin(pi x) / (pi x).
    chord = seconds * np.sinc(turn / (2.0 * np.pi))
    direction = poses[:, 2] + 0.5 * turn
    cos, sin = np.cos(direction), np.sin(direction)
    heading = poses[:, 2] + turn
    return np.stack(
        [
            poses[:, 0] + chord * (forwards * cos - aside * sin),
            poses[:, 1] + chord * (forwards * sin + aside * cos),
            np.arctan2(np.sin(heading), np.cos(heading)),
        ],
        axis=1,
        dtype=np.float32,
    )


def _in_first_map(task: TaskConfig) -> TaskConfig:
    """The task in one map of its pool, which the view draws, instead of in all of them."""
    if not isinstance(task.arena, ArenaPool):
        return task
    return task.model_copy(update={"arena": task.arena.model_copy(update={"maps": 1})})


class Showcase:
    """Robots that show what a policy can do, moment by moment; between two control steps they are interpolated.

    All of them drive in the same arena, the first where the training has a pool of them, and no more than are together there
    where they see one another.

    Args:
        task: environment of the training.
        robots: how many, at most.

    Attributes:
        world: where they drive; another one of as many robots may take its place between two steps.
        driver: who drives; None before the first step.
    """

    def __init__(self, task: TaskConfig, robots: int) -> None:
        task = _in_first_map(task)
        self._together = task.together
        robots = min(robots, task.together) if task.together > 1 else robots
        self.world = World(task, build_task_arenas(task), robots)
        self.world.reset()
        self._lidar = task.lidar
        self._period = task.control_period
        self._robot = task.robot
        self._lows = np.array(action_layout(task.robot).lows, np.float32)
        self.driver: Driver | None = None
        self._sim_time = 0.0
        # Time into the control step that is being shown; the first one is yet to be made.
        self._into = self._period
        self._last_outcomes = np.zeros(robots, np.uint8)
        self.look()

    @property
    def sim_time(self) -> float:
        """Simulated seconds that have passed, as frames say."""
        return self._sim_time

    @property
    def robots(self) -> int:
        """How many robots drive."""
        return len(self.world)

    def look(self) -> None:
        """Show the world as it stands, at rest until the next control step: somebody has changed it."""
        self._begin()
        self._velocities = np.zeros((self.robots, 3), np.float32)
        self._moved = np.zeros_like(self._discs[:, :2])

    def advance(self, policy: PolicyFunction, seconds: float) -> None:
        """Lets simulated time pass; at every control step the policy chooses anew."""
        self._sim_time += seconds
        self._into += seconds
        self.driver = self.driver or Driver(policy, self.robots)
        self.driver.policy = policy
        while self._into >= self._period:
            self._into -= self._period
            self._step(self.driver)

    def frame(self, step: int, speed: float) -> Frame:
        """This moment.

        Args:
            step: environment steps of the training that the policy has learned from.
            speed: simulated seconds per wall second.
        """
        poses = along_arc(self._poses, self._velocities, self._into)
        discs = self._discs.copy()
        discs[:, :2] += self._into / self._period * self._moved
        movers = discs[discs[:, 2] > 0.0]
        return Frame(
            mode="policy",
            step=step,
            sim_time=self._sim_time,
            speed=speed,
            poses=poses,
            targets=self._targets,
            ranges=self._scans(poses, movers),
            fields_of_view=self._fields,
            rewards=self._rewards,
            outcomes=self._outcomes,
            movers=movers,
        )

    def _scans(self, poses: NDArray[np.float32], movers: NDArray[np.float32]) -> NDArray[np.float32]:
        """(N, rays) metres that robots at poses (N, 3) see of movers (n, 3), and of one another where they are together."""
        arena, lidar, fields = self.world.arenas[0], self._lidar, self._fields
        if self._together == 1:
            return scan(arena, poses, lidar, movers=movers, fields_of_view=fields)
        discs = np.column_stack([poses[:, :2], np.full(self.robots, self._robot.circumscribed_radius, np.float32)])
        met = [np.vstack([movers, np.delete(discs, i, axis=0)]) for i in range(self.robots)]
        rows = [slice(i, i + 1) for i in range(self.robots)]
        return np.vstack([scan(arena, poses[i], lidar, movers=met[i.start], fields_of_view=fields[i]) for i in rows])

    def _step(self, driver: Driver) -> None:
        """One control step. What is shown during it is how things stood when it began."""
        self._begin()
        world, robots = self.world, self.world.robots
        actions = np.clip(driver(robots.observations), self._lows, 1.0).astype(np.float32)
        world.step(actions)
        # Late or slow, robots drive otherwise than commanded; of those that stand at a new start, that is all we know.
        ended = robots.terminations | robots.truncations
        driver.forget(ended)
        self._velocities = np.where(ended[:, None], twists(self._robot, actions).astype(np.float32), world.twists())
        self._moved = world.movers.walking[0, :, 3:].copy()
        self._last_outcomes = np.where(robots.outcomes > 0, robots.outcomes, self._last_outcomes)

    def _begin(self) -> None:
        robots = self.world.robots
        self._poses = robots.poses.copy()
        self._targets = robots.targets.copy()
        self._fields = self.world.fields_of_view.astype(np.float32)
        # A reward that belongs to an attempt that has just ended is history.
        self._rewards = np.where(robots.outcomes > 0, 0.0, robots.records["attempt_reward"]).astype(np.float32)
        self._outcomes = self._last_outcomes.copy()
        self._discs = self.world.movers.walking[0, :, :3].copy()

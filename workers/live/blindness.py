"""A policy that sees nothing in a sector: what it is told of there is the LiDAR's full range."""

import numpy as np

from sim.arrays import Floats, PolicyFunction
from sim.config import RangesPart, TaskConfig
from sim.lidar import drawn_ray_angles
from sim.observations import near_distance, observation_layout
from workers.play_protocol import PlaySettings


class Blinded:
    """Stands between a robot and its policy.

    Numbers of an observation that stand for several rays are blind where at least half of these are.

    Args:
        policy: any.
        task: of its robot.
    """

    def __init__(self, policy: PolicyFunction, task: TaskConfig) -> None:
        self._policy = policy
        self._task = task
        self._angles = np.degrees(drawn_ray_angles(task.lidar, [task.lidar.field_of_view])[0])
        self._columns = np.empty(0, np.intp)
        self._values = np.empty(0, np.float32)
        self.rays = np.zeros(len(self._angles), np.bool_)
        """(scan,) which rays are blind."""
        self.memory_size: int = getattr(policy, "memory_size", 0)

    def blind(self, settings: PlaySettings) -> None:
        """Take the sector from the settings."""
        off = np.abs((self._angles - settings.blind_direction + 180.0) % 360.0 - 180.0)
        self.rays = (off <= settings.blind_width / 2.0) & (settings.blind_width > 0.0)
        columns: list[int] = []
        values: list[float] = []
        near, limit = near_distance(self._task), self._task.lidar.range
        for block in observation_layout(self._task).blocks:
            if isinstance(block.part, RangesPart):
                shares = self.rays.reshape(len(block.numbers), -1).mean(axis=1)
                blind = np.flatnonzero(shares >= 0.5)
                columns += (block.start + blind).tolist()
                values += [near / max(limit, near) if block.part.inverse else 1.0] * len(blind)
        self._columns, self._values = np.array(columns, np.intp), np.array(values, np.float32)

    def __call__(self, observations: Floats) -> Floats:
        """Observations (n, numbers) to actions (n, A)."""
        return self._policy(self._dimmed(observations))

    def step(self, observations: Floats, memory: Floats) -> tuple[Floats, Floats]:
        """See `sim.drivers.RecurrentPolicy`."""
        following: tuple[Floats, Floats] = self._policy.step(self._dimmed(observations), memory)  # type: ignore[attr-defined]
        return following

    def _dimmed(self, observations: Floats) -> Floats:
        if not len(self._columns):
            return observations
        dimmed = observations.copy()
        dimmed[:, self._columns] = self._values
        return dimmed

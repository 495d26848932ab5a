"""Training mode of the live view: short clips of what the training robots really do, recorded as they step.

Training runs a hundred times faster than anyone can watch. So every few seconds a clip of consecutive steps is kept and
played one step a frame; what happens meanwhile is not shown.
"""

from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from workers.frames import Frame

if TYPE_CHECKING:
    from sim.vector_env import NavigationVectorEnv

CLIP_STEPS = 90
"""Consecutive steps of a clip: three seconds of playing."""

# With fewer frames than this left to play, the next clip is recorded.
_RUNNING_OUT = 10


class ClipRecorder:
    """Records on the training's thread; another one takes the frames away.

    Args:
        robots: how many of the training robots to show, from the first on.
        control_period: simulated seconds per step.
        frame_rate: frames per second at which the clips are played.
    """

    def __init__(self, robots: int, control_period: float, frame_rate: float) -> None:
        self.robots = robots
        self._period = control_period
        self._speed = control_period * frame_rate
        self._frames: deque[Frame] = deque()
        self._steps = 0
        self._left = 0
        self._outcomes = np.zeros(0, np.uint8)

    def record(self, env: "NavigationVectorEnv", step: int) -> None:
        """Looks at the environment after a step; keeps a frame while a clip is being recorded."""
        count = min(self.robots, env.num_envs)
        if len(self._outcomes) != count:
            self._outcomes = np.zeros(count, np.uint8)
        outcomes = env.outcomes[:count]
        ended = outcomes > 0
        self._outcomes[ended] = outcomes[ended]
        self._steps += 1
        if self._left == 0:
            if len(self._frames) >= _RUNNING_OUT:
                return
            self._left = CLIP_STEPS
        self._left -= 1
        self._frames.append(
            Frame(
                mode="training",
                step=step,
                sim_time=self._steps * self._period,
                speed=self._speed,
                poses=env.poses[:count].copy(),
                targets=env.targets[:count].copy(),
                ranges=env.ranges[:count].copy(),
                rewards=np.where(ended, 0.0, env.attempt_rewards[:count]).astype(np.float32),
                outcomes=self._outcomes.copy(),
            )
        )

    def take(self) -> Frame | None:
        """The next frame to play; None while there is none."""
        try:
            return self._frames.popleft()
        except IndexError:
            return None

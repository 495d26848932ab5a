"""Training mode of the live view: short clips of what the training robots really do, recorded as they step.

Training runs a hundred times faster than anyone can watch. So every few seconds a clip of consecutive steps is kept and
played one step a frame; what happens meanwhile is not shown.
"""

from collections import deque
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from workers.frames import Frame

if TYPE_CHECKING:
    from sim.envs.vector import NavigationVectorEnv

CLIP_STEPS = 90
"""Consecutive steps of a clip: three seconds of playing."""

# With fewer frames than this left to play, the next clip is recorded.
_RUNNING_OUT = 10

# Steps of simulated time between two clips that show different robots.
_LEAP = 1000


class ClipRecorder:
    """Records on the training's thread; another one takes the frames away.

    A clip shows robots of one arena, the one where most of them are, and where something moves of one copy of it. A robot
    that starts anew elsewhere stays as it was last seen until the clip is over.

    Args:
        robots: how many of the training robots to show at most.
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
        self._place = 0
        self._shown = np.zeros(0, np.intp)
        self._gone = np.zeros(0, np.bool_)
        self._last: Frame | None = None
        self._outcomes = np.zeros(0, np.uint8)

    def record(self, env: "NavigationVectorEnv", step: int) -> None:
        """Looks at the environment after a step; keeps a frame while a clip is being recorded."""
        if len(self._outcomes) != env.num_envs:
            self._outcomes = np.zeros(env.num_envs, np.uint8)
        ended = env.outcomes > 0
        self._outcomes[ended] = env.outcomes[ended]
        self._steps += 1
        if self._left == 0:
            if len(self._frames) >= _RUNNING_OUT:
                return
            self._begin(env)
        self._left -= 1
        self._frames.append(self._frame(env, step))

    def _begin(self, env: "NavigationVectorEnv") -> None:
        self._left = CLIP_STEPS
        places = _places(env)
        self._place = int(np.bincount(places).argmax())
        shown = np.flatnonzero(places == self._place)[: self.robots]
        if not np.array_equal(shown, self._shown):
            # Other robots: nobody should take this clip for the continuation of the one before.
            self._steps += _LEAP
        self._shown = shown
        self._gone = np.zeros(len(self._shown), np.bool_)

    def _frame(self, env: "NavigationVectorEnv", step: int) -> Frame:
        shown, gone = self._shown, self._gone
        gone |= _places(env)[shown] != self._place
        discs = env.discs[self._place]
        frame = Frame(
            mode="training",
            step=step,
            sim_time=self._steps * self._period,
            speed=self._speed,
            poses=env.poses[shown],
            targets=env.targets[shown],
            ranges=env.ranges[shown],
            fields_of_view=env.fields_of_view[shown].astype(np.float32),
            rewards=np.where(env.outcomes[shown] > 0, 0.0, env.attempt_rewards[shown]).astype(np.float32),
            outcomes=self._outcomes[shown],
            arena=self._place % len(env.arenas),
            movers=discs[discs[:, 2] > 0.0, :3],
        )
        last = self._last
        if last is not None and gone.any():
            frame.poses[gone] = last.poses[gone]
            frame.targets[gone] = last.targets[gone]
            frame.ranges[gone] = 0.0
            frame.rewards[gone] = last.rewards[gone]
            frame.outcomes[gone] = last.outcomes[gone]
        self._last = frame
        return frame

    def take(self) -> Frame | None:
        """The next frame to play; None while there is none."""
        try:
            return self._frames.popleft()
        except IndexError:
            return None


def _places(env: "NavigationVectorEnv") -> NDArray[np.int32]:
    """(N,) where each robot is: robots of the same number drive among the same things."""
    return env.places() if env.discs.shape[1] or env.task.together > 1 else env.arena_indices

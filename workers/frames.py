"""One moment of the robots that somebody watches, and its bytes on the link (NumPy only: the server decodes them)."""

import math
import struct
from dataclasses import dataclass, field, replace
from itertools import accumulate
from typing import Literal, Self

import numpy as np
from numpy.typing import NDArray

from workers.errors import FrameError

ViewMode = Literal["training", "policy"]

# version, mode, movers, robots, rays, arena, step, seconds of simulated time, seconds of simulated time per wall second
_HEADER = struct.Struct("<BBBHHHQdf")
_VERSION = 4
_MODES: tuple[ViewMode, ...] = ("training", "policy")


@dataclass(frozen=True, slots=True)
class Frame:
    """What the live view draws; all lengths are metres, all angles radians, in the arena's own coordinates.

    Attributes:
        mode: whether these are the training robots or the newest policy on its own.
        step: environment steps of the training when the frame was made.
        sim_time: simulated seconds since the view started; grows monotonically within a mode.
        speed: simulated seconds per wall second.
        poses: (robots, 3) float32: x, y, heading.
        targets: (robots, 2) float32.
        ranges: (robots, rays) float32, at most the LiDAR's range.
        fields_of_view: (robots,) float32, degrees that the rays of each cover, which may be drawn.
        rewards: (robots,) float32, reward since the last target.
        outcomes: (robots,) uint8: how the attempt that ended last ended (0 none yet, 1 arrival, 2 collision, 3 time-out).
        arena: which arena of the task's pool all of this is in.
        movers: (movers, 3) float32: x, y, radius of what moves there, at most 255.
    """

    mode: ViewMode
    step: int
    sim_time: float
    speed: float
    poses: NDArray[np.float32]
    targets: NDArray[np.float32]
    ranges: NDArray[np.float32]
    fields_of_view: NDArray[np.float32]
    rewards: NDArray[np.float32]
    outcomes: NDArray[np.uint8]
    arena: int = 0
    movers: NDArray[np.float32] = field(default_factory=lambda: np.empty((0, 3), np.float32))

    def of_first(self, robots: int) -> "Frame":
        """The same moment with at most so many robots, the first ones."""
        if len(self.poses) <= robots:
            return self
        names = ("poses", "targets", "ranges", "fields_of_view", "rewards", "outcomes")
        return replace(self, **{name: getattr(self, name)[:robots] for name in names})

    def encode(self) -> bytes:
        """The frame as bytes: a fixed header, then the arrays one after another, little-endian."""
        robots, rays = self.ranges.shape
        mode, movers = _MODES.index(self.mode), len(self.movers)
        header = _HEADER.pack(_VERSION, mode, movers, robots, rays, self.arena, self.step, self.sim_time, self.speed)
        arrays = (self.poses, self.targets, self.ranges, self.fields_of_view, self.rewards, self.movers)
        floats = np.concatenate([np.ravel(array).astype("<f4") for array in arrays], dtype="<f4")
        return header + floats.tobytes() + self.outcomes.astype(np.uint8).tobytes()

    @classmethod
    def decode(cls, data: bytes) -> Self:
        """The frame that `encode` wrote.

        Raises:
            FrameError: `data` is no frame of this version, is cut short, or holds what is no number.
        """
        if len(data) < _HEADER.size:
            raise FrameError("shorter than a frame's header")
        version, mode, movers, robots, rays, arena, step, sim_time, speed = _HEADER.unpack_from(data)
        if version != _VERSION or mode >= len(_MODES):
            raise FrameError(f"frame version {version}, mode {mode}: not known here")
        # Where each part ends, in numbers.
        ends = tuple(accumulate((3 * robots, 2 * robots, rays * robots, robots, robots, 3 * movers)))
        if len(data) != _HEADER.size + 4 * ends[-1] + robots:
            raise FrameError("length does not match the header")
        floats = np.frombuffer(data, "<f4", ends[-1], _HEADER.size)
        if not (np.isfinite(floats).all() and math.isfinite(sim_time) and math.isfinite(speed)):
            raise FrameError("a number is not finite")
        outcomes = np.frombuffer(data, np.uint8, robots, _HEADER.size + 4 * ends[-1])
        if (outcomes > 3).any():
            raise FrameError("an outcome that nobody knows")
        poses, targets, ranges, fields, rewards, discs = (
            floats[first:end] for first, end in zip((0, *ends[:-1]), ends, strict=True)
        )
        if (discs[2::3] <= 0.0).any():
            raise FrameError("a mover without a size")
        return cls(
            mode=_MODES[mode],
            step=step,
            sim_time=sim_time,
            speed=speed,
            poses=poses.reshape(robots, 3),
            targets=targets.reshape(robots, 2),
            ranges=ranges.reshape(robots, rays),
            fields_of_view=fields,
            rewards=rewards,
            outcomes=outcomes,
            arena=arena,
            movers=discs.reshape(movers, 3),
        )

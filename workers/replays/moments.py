"""Who drives in a film, and where they and what moves are at any time, between two recorded moments."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim.config import TaskConfig
from workers.frames import Frame
from workers.replays.recording import Track
from workers.reporting import EpisodeResult

LAST_PICTURE_SECONDS = 1.5
# Between two steps a ray that leaves one thing for another jumps; all others sweep.
_SAME_THING = 0.4
# As `Frame.outcomes` counts them.
_OUTCOME_NUMBERS = {"arrival": 1, "collision": 2, "timeout": 3}


@dataclass(frozen=True, eq=False)
class Filmed:
    """What one robot did, how it ended, and with which robot, LiDAR and limits."""

    track: Track
    result: EpisodeResult
    task: TaskConfig

    @property
    def seconds(self) -> float:
        """Of simulated time."""
        return (len(self.track.poses) - 1) * self.task.control_period

    @property
    def outcome(self) -> int:
        """How it ended, as `Frame.outcomes` counts."""
        return _OUTCOME_NUMBERS[self.result.outcome]


def _between(filmed: Filmed, times: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """The moments before and after each of these times, seconds, and how far it is from the one to the other, 0 to 1."""
    moments, last = times / filmed.task.control_period, len(filmed.track.poses) - 1
    before = np.minimum(moments.astype(np.int64), last)
    return before, np.minimum(before + 1, last), moments - before


def movers_at(filmed: Filmed, times: NDArray[np.float64]) -> NDArray[np.float32]:
    """(T, movers, 3) what moves at each of these times, seconds."""
    before, after, share = _between(filmed, times)
    movers = filmed.track.movers
    return (movers[before] + share[:, None, None] * (movers[after] - movers[before])).astype(np.float32)


def frames_at(filmed: Filmed, times: NDArray[np.float64], movers: NDArray[np.float32]) -> list[Frame]:
    """What to draw at each of these times, seconds: between two recorded moments; a robot that has ended stands."""
    track = filmed.track
    before, after, share = _between(filmed, times)
    share = share[:, None]
    change = track.poses[after] - track.poses[before]
    change[:, 2] = (change[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    poses = (track.poses[before] + share * change).astype(np.float32)
    jump = track.ranges[after] - track.ranges[before]
    sweep = np.where(np.abs(jump) < _SAME_THING, share * jump, np.where(share < 0.5, 0.0, jump))
    ranges = (track.ranges[before] + sweep).astype(np.float32)
    return [
        Frame(
            mode="policy",
            step=0,
            sim_time=float(seconds),
            speed=1.0,
            poses=poses[index : index + 1],
            targets=track.target[None],
            ranges=ranges[index : index + 1],
            fields_of_view=track.fields_of_view[before[index], None],
            rewards=np.zeros(1, np.float32),
            outcomes=np.zeros(1, np.uint8),
            movers=movers[index],
        )
        for index, seconds in enumerate(times)
    ]

"""What a person chooses in the live view of a run, and what the view says about itself."""

from typing import Literal

from pydantic import BaseModel, Field

from sim.config import Frozen
from workers.frames import ViewMode
from workers.reporting import WatchRequest

MAX_ROBOTS = 64

# A view that has received nothing for this long has nothing to show; frames come 30 times a second.
RECEIVING_SECONDS = 2.0


class LiveSettings(Frozen):
    """What the live view of a run shows: mode and speed to everyone who watches it, the rest as each person chose."""

    mode: ViewMode = Field(
        "policy", title="Show", description="Training: what the training robots do, time-lapsed. Policy: the newest weights."
    )
    robots: int = Field(8, ge=1, le=MAX_ROBOTS, title="Robots")
    speed: Literal[1, 2, 5, 10] = Field(1, title="Speed", description="Simulated seconds per second, in policy mode.")
    rays: bool = Field(True, title="LiDAR rays")
    ray_robots: Literal["followed", "all"] = Field(
        "followed",
        title="Rays of",
        description="The followed robot, or the first one where none is; or all, which bury the arena.",
    )
    follow: int | None = Field(None, ge=0, lt=MAX_ROBOTS, title="Follow", description="Index of the robot to stay with.")

    def watch_request(self) -> WatchRequest:
        """The part of these settings that the worker has to know."""
        return WatchRequest(mode=self.mode, robots=self.robots, speed=float(self.speed))


class LiveStatus(BaseModel):
    """Whether the live view of a run has anything to show.

    Attributes:
        connected: a worker that runs this training is linked to the server, or its finished policy drives.
        receiving: frames have arrived within the last seconds.
        watchers: browsers that watch this run now.
    """

    connected: bool
    receiving: bool
    watchers: int


class LiveState(LiveSettings):
    """The settings of a run's live view together with its status."""

    status: LiveStatus

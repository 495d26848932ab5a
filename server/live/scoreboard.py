"""What the live view says in words: how the robots on screen have fared since somebody started to look."""

from typing import Any, Literal

import numpy as np
from pydantic import BaseModel

from workers.frames import Frame, ViewMode
from workers.scene.continuity import continues, ended

# More robots than this are summed up rather than listed.
_LISTED = 8

ViewState = Literal["no worker", "waiting", "live"]


class RobotLine(BaseModel):
    """One robot: its index, the reward since its last target, and how its last attempt ended (see `Frame.outcomes`)."""

    index: int
    reward: float
    outcome: int


class Score(BaseModel):
    """What the head-up display shows.

    Attributes:
        state: no worker runs this training; one does, but no frames come yet; or frames come.
        mode: what is shown.
        step: environment steps of the training behind it.
        after_training: whether the policy is a finished one.
        playground: whether a person plays with it.
        checkpoint: whether it is one that somebody chose among those of a run.
        speed: simulated seconds per wall second.
        arrivals, collisions, timeouts: attempts of the robots on screen that ended since the view began.
        robots: the first few, or the one that is followed.
        refusal: why nothing can be shown for now, and what to do about it.
        moment: of a playground, what its page says of the moment that is shown (`server.playground.schemas.Moment`).
    """

    state: ViewState = "waiting"
    mode: ViewMode | None = None
    step: int = 0
    after_training: bool = False
    playground: bool = False
    checkpoint: bool = False
    speed: float = 1.0
    arrivals: int = 0
    collisions: int = 0
    timeouts: int = 0
    robots: list[RobotLine] = []
    refusal: str | None = None
    moment: dict[str, Any] | None = None


class Scoreboard:
    """Counts attempts frame by frame."""

    def __init__(self) -> None:
        self._counts = np.zeros(4, np.int64)
        self._frame: Frame | None = None

    def update(self, frame: Frame) -> None:
        """Takes the next frame into account; another mode starts the counts anew."""
        last, self._frame = self._frame, frame
        if last is None or last.mode != frame.mode:
            self._counts[:] = 0
        elif continues(last, frame):
            self._counts += np.bincount(frame.outcomes[ended(last, frame)], minlength=4)

    def score(self, state: ViewState, follow: int | None) -> Score:
        """The numbers as they stand."""
        frame = self._frame
        if frame is None:
            return Score(state=state)
        count = len(frame.poses)
        listed = [follow] if follow is not None and follow < count else list(range(count if count <= _LISTED else 0))
        return Score(
            state=state,
            mode=frame.mode,
            step=frame.step,
            speed=frame.speed,
            arrivals=int(self._counts[1]),
            collisions=int(self._counts[2]),
            timeouts=int(self._counts[3]),
            robots=[
                RobotLine(index=i, reward=round(float(frame.rewards[i]), 1), outcome=int(frame.outcomes[i])) for i in listed
            ],
        )

"""What is told of a robot's recording, as JSON (pydantic only: the server and the pages read it)."""

from typing import Literal

from pydantic import Field

from sim.config import Frozen

Role = Literal["scan", "odometry", "commands", "goal"]
"""What a topic is read as."""

MAX_MOMENTS = 3_000
"""At which a robot's way is told, at most."""
MAX_POINTS = 20_000
"""Of what its LiDAR met, at most."""


class TopicChoice(Frozen):
    """Which topics are read; None: the one with most messages."""

    scan: str | None = Field(None, max_length=200)
    odometry: str | None = Field(None, max_length=200)
    commands: str | None = Field(None, max_length=200)
    goal: str | None = Field(None, max_length=200)


class Topic(Frozen):
    """A topic of a recording that could be read as `role`.

    Attributes:
        role: what it would be read as.
        name: of the topic.
        type: of its messages.
        messages: how many there are.
        chosen: whether it is the one that is read.
    """

    role: Role
    name: str
    type: str
    messages: int
    chosen: bool


class Fitted(Frozen):
    """A quantity of the robot or its sensors, fitted from a recording.

    Attributes:
        key: of the quantity; that of a setting of a task where there is one, such as `lidar.noise`.
        title: for people.
        unit: of the numbers.
        value: the estimate; None where it can't be told.
        low, high: its interval of 95 %; None where the recording sets no bound on that side.
        note: how it was found, or why it can't be told and what would help.
    """

    key: str
    title: str
    unit: str
    value: float | None
    low: float | None
    high: float | None
    note: str


class LidarFacts(Frozen):
    """What the scans say of the LiDAR; angles in degrees, lengths in metres.

    Attributes:
        beams: of a scan.
        field_of_view: from the first beam to the last.
        looks: where the middle of that is, against the heading, left positive.
        range: the longest that it measures.
    """

    beams: int
    field_of_view: float
    looks: float
    range: float


class Setting(Frozen):
    """A setting of a task, as the recording has it.

    Attributes:
        path: of the setting within a task.
        title: for people.
        value: of the setting.
    """

    path: tuple[str, ...]
    title: str
    value: float | tuple[int, ...]


class BagReading(Frozen):
    """A recording: what is in it, the way that was driven, what was fitted. Times are seconds since its begin.

    Attributes:
        seconds: that it lasts.
        topics: that could be read, and those that are.
        notes: what one should know of it, each a sentence.
        times: of the moments (n) below.
        path: (n) x, y and heading of the robot, in the frame of its odometry.
        forwards, turning: (n) measured, m/s and rad/s.
        asked_forwards, asked_turning: (n) commanded, likewise; None where nothing was yet.
        points: x and y of what the LiDAR met, metres.
        scan_times: of the scans that are kept to be drawn.
        scan_bearings: of their rays against the heading, radians.
        scans: ranges along these, metres; None where nothing was met.
        lidar_at: x and y of the LiDAR on the robot, metres.
        goals: time, x, y of each goal.
        lidar: what the scans say.
        fitted: quantities with their intervals.
        settings: what a training with these would begin with.
    """

    seconds: float
    topics: tuple[Topic, ...]
    notes: tuple[str, ...]
    times: tuple[float, ...] = Field(max_length=MAX_MOMENTS)
    path: tuple[tuple[float, float, float], ...]
    forwards: tuple[float, ...]
    turning: tuple[float, ...]
    asked_forwards: tuple[float | None, ...]
    asked_turning: tuple[float | None, ...]
    points: tuple[tuple[float, float], ...] = Field(max_length=MAX_POINTS)
    scan_times: tuple[float, ...]
    scan_bearings: tuple[float, ...]
    scans: tuple[tuple[float | None, ...], ...]
    lidar_at: tuple[float, float]
    goals: tuple[tuple[float, float, float], ...]
    lidar: LidarFacts
    fitted: tuple[Fitted, ...]
    settings: tuple[Setting, ...]


class Parting(Frozen):
    """A moment from which policy and robot would have come furthest apart.

    Attributes:
        at: the moment.
        start, end: of the while about it in which there is no other.
        metres: how far apart their noses would have been a second later, see `workers.bags.beside`.
        share: of the furthest that two could come apart in that time, one at the policy's top speed and one at the robot's.
    """

    at: float
    start: float
    end: float
    metres: float
    share: float


class BagBeside(Frozen):
    """What a policy would have commanded in a recording, moment by moment, beside what the robot did.

    Attributes:
        policy: its name.
        period: seconds between its commands.
        notes: what one should know, each a sentence.
        times: of its commands (n).
        forwards, turning: (n) what it would have commanded, m/s and rad/s.
        did_forwards, did_turning: (n) what the robot did in the period that follows.
        states: (n) index into `reasons`: why it would drive or stand.
        reasons: for people.
        driving: (n) whether the policy itself decides there.
        partings: the largest first.
    """

    policy: str
    period: float
    notes: tuple[str, ...]
    times: tuple[float, ...]
    forwards: tuple[float, ...]
    turning: tuple[float, ...]
    did_forwards: tuple[float, ...]
    did_turning: tuple[float, ...]
    states: tuple[int, ...]
    reasons: tuple[str, ...]
    driving: tuple[bool, ...]
    partings: tuple[Parting, ...]

"""Replays in JSON."""

from typing import Literal

from pydantic import Field

from server.schemas import Schema
from workers.reporting import Outcome

_FAITHFUL = "Whether it ended as recorded. Another processor than the one it was recorded on may round otherwise."
_OF = "As addresses of replays name it: checkpoint:ID, evaluation:ID or policy:NAME:SUITE."
_PAGE = "Path of the player; append `light/` or `dark/`, and `?download` to take it away."


class Replay(Schema):
    """An episode that was driven once more, ready to be played."""

    episode: int = Field(description="Its place in the suite, from 0.")
    suite: str
    outcome: Outcome
    steps: int
    seconds: float = Field(description="Of simulated time.")
    faithful: bool = Field(description=_FAITHFUL)
    page: str = Field(description=_PAGE)


class ReplayedPolicy(Schema):
    """What one policy did."""

    of: str = Field(description=_OF)
    title: str
    colour: str = Field(description="Of its robot in the picture, as CSS writes it.")
    outcome: Outcome
    steps: int
    seconds: float = Field(description="Of simulated time.")
    faithful: bool = Field(description=_FAITHFUL)


class EpisodeReplay(Schema):
    """One scenario, driven once more by one policy or several, ready to be played."""

    episode: int = Field(description="Its place in the suite, from 0.")
    suite: str
    seconds: float = Field(description="Of simulated time, of the longest.")
    page: str = Field(description=_PAGE)
    policies: list[ReplayedPolicy] = Field(description="In the order that was asked for.")


ChartName = Literal["ahead", "linear", "lateral", "turning", "steering", "value", "reward"]
"""Nearest thing ahead; speeds and steering angle, asked for and driven; the return to come; the step's reward."""


class ChartedSeries(Schema):
    """Numbers over an episode's time."""

    chart: ChartName
    name: str
    unit: str
    values: list[float] = Field(description="One for each of the policy's times.")


class PolicySeries(Schema):
    """What is charted of one policy's episode."""

    of: str = Field(description=_OF)
    times: list[float] = Field(description="Seconds since the start; 600 at most.")
    series: list[ChartedSeries]


class EpisodeSeries(Schema):
    """What the charts beside a replay show."""

    policies: list[PolicySeries]


class ReplayProgress(Schema):
    """How far the evaluations of a replay are driven."""

    ready: int = Field(description="Policies whose episodes are there.")
    policies: int
    share: float = Field(description="Of the work, 0 to 1.")


class FilmProgress(Schema):
    """How far a film is made."""

    ready: bool = Field(description="It is there.")
    share: float = Field(description="Of the work, 0 to 1; 0 while it waits for its turn, or for the episodes to be driven.")


class LapseChapter(Schema):
    """What one checkpoint of a time lapse does."""

    step: int
    success: float = Field(description="Share of all the suite's episodes that arrived.")
    begins: float = Field(description="Seconds after the time lapse's start.")


class Lapse(Schema):
    """The same scenarios by one checkpoint of a run after another."""

    suite: str
    scenarios: int = Field(description="Robots in the picture.")
    page: str = Field(description=_PAGE)
    chapters: list[LapseChapter] = Field(description="Eight at most, the oldest first.")


class Beside(Schema):
    """Somebody else who drove the same scenarios."""

    of: str = Field(description=_OF)
    title: str
    success: float = Field(description="Share of the suite's episodes that arrived.")


class BesideList(Schema):
    """Who else drove the same scenarios."""

    suite: str
    items: list[Beside] = Field(description="Those of the same run first, then what ships, then what was asked for.")

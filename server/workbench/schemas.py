"""What the table of trainings is made of, in JSON."""

from typing import Annotated, Literal

from pydantic import Field, StringConstraints

from server.database.tables import RunState
from server.experiments.schemas import ExperimentName, ExperimentState
from server.schemas import UNREADABLE, Estimate, Line, Page, Schema, SeedMean

Place = Literal["live", "archived", "trash"]
"""Where a training is: in the table, put away, or deleted and not yet removed."""

MAX_TAGS = 20
MAX_NOTES = 20_000
MAX_AT_ONCE = 1_000
"""Trainings that one action may be about."""

Tag = Annotated[Line, StringConstraints(max_length=40)]
Key = Annotated[str, StringConstraints(min_length=1, max_length=160)]


class ListedExperiment(Schema):
    """An experiment as a list shows it: without its whole configuration and its runs."""

    id: str
    project_id: str
    name: str
    created_at: float
    arena: str
    arena_title: str = Field(description="As people call it; of an imported one the name that its file gave it.")
    movers: int = Field(description="Moving obstacles.")
    robot: str
    algorithm: str
    network: str
    reward: str
    unreadable: list[str] = Field(description=UNREADABLE)
    state: ExperimentState = Field(description="Of its runs together; mixed where they ended differently.")
    states: list[RunState] = Field(description="That its runs are in, each once.")
    runs: int
    run_id: str | None = Field(description="Of its only run; null where it has several.")
    progress: float = Field(description="Steps done by all runs over the steps that they were given, 0 to 1.")
    seconds_left: float | None = Field(
        description="Until its last run is through, those that wait included; null where that is not known."
    )
    campaign: str | None = Field(description="Of the paper's reproduction that it was launched by; null for all others.")
    study_id: str | None = Field(description="Of the study that it is a trial of; null for all others.")
    success: Estimate | None = Field(
        description="Success rate of its runs' last evaluated checkpoints; null before the first evaluation."
    )
    tags: list[str]
    starred: bool
    noted: bool = Field(description="Whether it has notes.")
    archived: bool
    deleted_at: float | None = Field(description="When it was put into the trash; null unless it lies there.")
    settings: dict[str, float | str] = Field(description="Those asked for, by dotted name; what it does not have is absent.")
    metrics: dict[str, SeedMean] = Field(description="Newest values of those asked for, over its runs, by name.")


class ListedPage(Page[ListedExperiment]):
    """A part of the list of experiments."""

    next: str | None = Field(description="What to ask for as `after` to get what follows; null at the end.")


class Group(Schema):
    """The experiments that have the same value under a key."""

    value: float | str | None = Field(description="Null for those that have none.")
    query: str = Field(description="Finds exactly these, within the query that was grouped.")
    experiments: int
    runs: int
    states: dict[RunState, int] = Field(description="How many of the runs are in each state.")
    success: SeedMean | None = Field(
        description="Success rate over all of its runs that were last evaluated on the suite that most of them were."
    )
    metrics: dict[str, SeedMean] = Field(description="Newest values of those asked for, over all of its runs, by name.")


class Groups(Schema):
    """A list of experiments by the values of one key."""

    by: str = Field(description="The key's whole name.")
    items: list[Group] = Field(description="The largest first.")
    total: int = Field(description="How many groups there are; the smallest may be left out.")


class KnownKey(Schema):
    """Something to filter, sort and group by."""

    key: str
    kind: Literal["text", "number", "time", "yes"]
    of: Literal["property", "setting", "metric"]
    meaning: str
    values: list[str] = Field(description="That it may have, where they are few.")


class KnownKeys(Schema):
    """Everything to filter, sort and group by."""

    items: list[KnownKey]


class Notes(Schema):
    """What people have written about an experiment."""

    notes: str = Field(max_length=MAX_NOTES, pattern="^[^\\x00]*$", description="Markdown.")


class ExperimentMarks(Schema):
    """What an experiment's page shows beside its runs."""

    tags: list[str]
    starred: bool
    archived: bool
    notes: str = Field(description="Markdown; empty where there are none.")


ActionName = Literal[
    "stop", "resume", "repeat", "star", "unstar", "archive", "unarchive", "tag", "untag", "delete", "restore", "remove"
]


class Action(Schema):
    """Something to do to several experiments at once.

    `repeat` queues their failed runs again, from the last checkpoint where there is one. `delete` puts them into the trash,
    `restore` takes them out of it, `remove` removes them for good.
    """

    action: ActionName
    experiments: list[str] = Field(min_length=1, max_length=MAX_AT_ONCE)
    tag: Tag | None = Field(None, description="To put on or take off; of those actions only.")


class LeftOut(Schema):
    """An experiment to which an action was not done."""

    id: str
    reason: str


class ActionDone(Schema):
    """What has become of an action."""

    done: list[str] = Field(description="The experiments that it was done to.")
    left_out: list[LeftOut]


class MatchingIds(Schema):
    """The experiments that a query finds."""

    ids: list[str]
    total: int


class MoreSeeds(Schema):
    """Seeds to add to an experiment."""

    seeds: list[Annotated[int, Field(ge=0, le=2**31 - 1)]] = Field(min_length=1, max_length=50)


class SavedViewEdit(Schema):
    """A view of the table under a name."""

    name: Annotated[ExperimentName, StringConstraints(max_length=80)]
    address: str = Field(max_length=4_000, pattern="^[^\\x00-\\x1f]*$", description="The query of the table's address.")


class SavedView(SavedViewEdit):
    """A view that was saved."""

    id: str
    created_at: float


class SavedViews(Schema):
    """All named views."""

    items: list[SavedView] = Field(description="By name.")

"""The queue and the workers in JSON."""

from typing import Literal

from pydantic import Field

from server.runs.limits import Limit
from server.schemas import Page, Schema
from workers.protocol import ExtensionState, Machine, Queue

MAX_PRIORITY = 1_000_000
EDITORS_PRIORITY = 100
"""An editor may give a run this much; more takes an administrator of the installation, whose queue it is."""

WaitsFor = Literal["turn", "worker", "gpu", "extension", "other worker", Limit]


class WaitingRun(Schema):
    """A run in the queue."""

    id: str
    experiment_id: str
    experiment_name: str
    project_id: str
    seed: int
    algorithm: str
    step: int = Field(description="Environment steps done by earlier attempts.")
    total_steps: int
    priority: int = Field(
        description="The highest is claimed first; of equal ones whoever has the fewest runs under way comes first."
    )
    queued_at: float
    position: int = Field(description="In the whole queue, from 1; those that one may not see count.")
    waits_for: WaitsFor = Field(
        description="`turn`: a worker that could train it is there. Otherwise none is: no worker at all, none with a GPU, "
        "none with its extensions, none but those that have lost it again and again. `person limit`, `experiment limit`: "
        "as many runs of whoever launched it, or of its experiment, are under way as may be."
    )
    parallel_runs: int | None = Field(
        description="Of its experiment's runs that may be under way at a time; null: as the installation says."
    )
    extensions: list[str] = Field(description="That it needs.")
    starts_in: float | None = Field(description="Seconds, by the rates of what runs; null where that is not known.")


class QueuePage(Page[WaitingRun]):
    """A part of the queue, in the order of its turns."""

    hidden: int = Field(description="Runs that wait in projects that one may not see.")
    jobs: int = Field(description="Views, replays, films, exports and evaluations that wait for a worker of jobs.")


class Priority(Schema):
    """Where in the queue a run stands."""

    priority: int = Field(ge=-MAX_PRIORITY, le=MAX_PRIORITY)


class QueuePlace(Schema):
    """Where in the queue a run is to stand."""

    beside: str = Field(min_length=1, max_length=16, description="Id of another run that waits.")
    side: Literal["before", "after"] = Field(description="Whether it has its turn right before that one, or right after it.")


class WorkersRun(Schema):
    """What a worker trains."""

    id: str
    experiment_id: str
    experiment_name: str
    seed: int
    progress: float = Field(description="0 to 1.")
    steps_per_second: float | None
    seconds_left: float | None


class Worker(Schema):
    """A worker process: it trains one run at a time."""

    name: str
    queue: Queue
    last_seen: float
    there: bool = Field(description="It was heard of lately.")
    draining: bool = Field(description="It was asked to finish its run and take up no more.")
    trouble: str | None = Field(description="Why it takes up no run, a full disk say; null while it does.")
    machine: Machine | None = Field(description="Null until it has said so.")
    extensions: list[ExtensionState] = Field(description="That were found where it runs.")
    busy: bool
    run: WorkersRun | None = Field(description="Null where it has none, or one that one may not see.")
    activity: list[float] = Field(
        description="Share of each six hours of the last week in which it had a run, 0 to 1; the oldest first."
    )
    last_words: str | None = Field(description="Of one that has gone: the last line in the log of the run that it had last.")


class Workers(Schema):
    """All workers that have not been removed."""

    items: list[Worker] = Field(description="Those that are there first, by name.")

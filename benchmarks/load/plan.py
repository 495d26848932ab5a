"""What the processes that make the load are told, and what they tell when it is over."""

import sys
import time
from collections import Counter, defaultdict

from pydantic import BaseModel, ConfigDict, Field


class Plan(BaseModel):
    """One process's part.

    Attributes:
        server_url: base URL.
        token, worker_token: of logins and of workers.
        run_ids: the runs that report, in the order of their numbers.
        experiment_ids: theirs.
        series: in each report.
        batches: reports a second of each run.
        history: points of each series that a run has reported before it begins.
        browsers: open pages.
        page_seconds: between two pages that a browser opens.
        views: watched runs.
        seconds: how long it lasts.
        settling_seconds: at its beginning, of which views tell nothing.
        end: when it is over, on the machine's clock; known when everybody is ready.
    """

    model_config = ConfigDict(frozen=True)

    server_url: str
    token: str
    worker_token: str
    run_ids: tuple[str, ...]
    experiment_ids: tuple[str, ...]
    series: int
    batches: float
    history: int = 0
    browsers: int
    page_seconds: float
    views: int
    seconds: float
    settling_seconds: float = 0.0
    end: float = 0.0

    @property
    def over(self) -> bool:
        """Whether the time has come."""
        return time.time() >= self.end

    @property
    def settled(self) -> bool:
        """Whether what is measured counts."""
        return time.time() >= self.end - self.seconds + self.settling_seconds


class WorkersTold(BaseModel):
    """Of the synthetic workers: items made and acknowledged, leases lost, frames sent, errors by their text, and lags."""

    items: int = 0
    acknowledged: int = 0
    leases_lost: int = 0
    frames: int = 0
    errors: dict[str, int] = {}
    lags: list[float] = []
    processor_seconds: float = 0.0


class PagesTold(BaseModel):
    """Of the pages.

    Attributes:
        seconds: until each page had all its answers.
        opened: when each was opened, in seconds from the beginning.
        routes: seconds until each answer was there, by route.
        errors: by their text.
        asked_again: requests on kept connections that the server had closed, which were asked for on another one.
        lags: seconds by which this part was late itself.
        processor_seconds: that it took.
    """

    seconds: list[float] = []
    opened: list[float] = []
    routes: defaultdict[str, list[float]] = Field(default_factory=lambda: defaultdict[str, list[float]](list))
    errors: Counter[str] = Counter()
    asked_again: int = 0
    lags: list[float] = []
    processor_seconds: float = 0.0


class StreamsTold(BaseModel):
    """Of the event streams: bytes read, streams that ended early, and lags."""

    bytes: int = 0
    ended: int = 0
    lags: list[float] = []
    processor_seconds: float = 0.0


class ViewsTold(BaseModel):
    """Of the live views: messages and bytes, seconds watched by all of them together, views that ended early, and lags."""

    messages: int = 0
    bytes: int = 0
    seconds: float = 0.0
    ended: int = 0
    lags: list[float] = []
    processor_seconds: float = 0.0


def read_plan() -> Plan:
    """The plan on standard input."""
    return Plan.model_validate_json(sys.stdin.readline())


def await_beginning(plan: Plan) -> Plan:
    """Say that this part is ready; returns when everybody is, with the end."""
    sys.stdout.write("ready\n")
    sys.stdout.flush()
    return plan.model_copy(update={"end": float(sys.stdin.readline())})


def tell(told: WorkersTold | PagesTold | StreamsTold | ViewsTold) -> None:
    """What is told goes to standard output."""
    told.processor_seconds = time.process_time()
    sys.stdout.write(told.model_dump_json())

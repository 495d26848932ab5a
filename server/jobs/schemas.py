"""Jobs in JSON."""

from pydantic import Field

from server.database.tables import JobState
from server.schemas import Page, Schema
from sim.extending.discovery import UsedExtension
from workers.job_protocol import JobKind

WAITS_FOR = "Extensions that a worker must have to do it, while no worker is there that has them."


class Job(Schema):
    """Something that was asked for beside trainings."""

    id: str
    kind: JobKind
    title: str = Field(description="Whose: a policy's name; of an evaluation with the suite.")
    state: JobState
    worker: str | None
    attempt: int
    progress: float = Field(description="Share of the work that is done, 0 to 1.")
    seconds_left: float | None = Field(description="Null where that is not known yet, and once it has ended.")
    error: str | None
    waits_for: list[UsedExtension] = Field(description=WAITS_FOR)
    created_at: float
    started_at: float | None
    finished_at: float | None


class JobPage(Page[Job]):
    """Some of the jobs: those under way, those that wait in the order of their turn, then what has ended."""

    workers: int = Field(description="Workers that take up jobs now.")

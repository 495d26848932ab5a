"""The service itself in JSON."""

from pydantic import Field

from server.schemas import Schema
from workers.protocol import ExtensionState


class Version(Schema):
    """What is running."""

    version: str
    commit: str | None = Field(description="Git commit, short; null where it is not known.")


class WorkerStatus(Schema):
    """A worker that has been heard of lately."""

    name: str
    last_seen: float
    run_id: str | None = Field(description="The run that it trains now.")
    draining: bool = Field(description="It was asked to finish its runs and take up no more.")
    trouble: str | None = Field(description="Why it takes up no run, a full disk say; null while it does.")
    extensions: list[ExtensionState] = Field(description="That were found where it runs.")


class Readiness(Schema):
    """Whether the service can do its work."""

    ready: bool
    checks: dict[str, str] = Field(description="Of each part `ok`, or what is wrong.")


class WorkerName(Schema):
    """Which worker is meant."""

    worker: str = Field(min_length=1, max_length=120, description='Its name, "worker@host" for all of its processes.')


class Status(Version):
    """The service at a glance."""

    workers: list[WorkerStatus]
    queued: int = Field(description="Runs that wait for a worker.")
    running: int = Field(description="Runs that a worker trains, those about to stop included.")
    extensions: list[ExtensionState] = Field(description="That were found where the service runs.")

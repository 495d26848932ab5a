"""What a worker is told from outside: environment variables with the prefix MAPLESS_, set by `mapless worker`."""

import os
import socket
import tempfile
from pathlib import Path

from pydantic import Field, SecretStr
from pydantic_settings import BaseSettings, SettingsConfigDict

from workers.logs import LogFormat
from workers.protocol import Queue

EXTENSIONS_SETTING = (
    "Modules of extensions besides those that are installed as such, separated by commas: `my_lab`, or "
    "`my_lab.parts:extension`."
)
"""What `MAPLESS_EXTENSIONS` means; `sim.extending.discovery` reads it."""


def _private_place() -> Path:
    """A folder that other users of the machine can neither guess their way into nor make first."""
    cache = os.environ.get("XDG_CACHE_HOME")
    try:
        return (Path(cache) if cache else Path.home() / ".cache") / "mapless" / "work"
    except RuntimeError:  # a user without a home
        return Path(tempfile.gettempdir()) / f"mapless-{os.geteuid()}"


class WorkerSettings(BaseSettings):
    """Where a worker finds its work and brings its results: two URLs and a token, no database and no shared disk."""

    model_config = SettingsConfigDict(env_prefix="MAPLESS_", frozen=True, extra="ignore", env_ignore_empty=True)

    server_url: str = Field("http://127.0.0.1:8400", description="The server.")
    broker_url: str = Field(description="The Celery broker that rings for work.")
    queue_prefix: str = Field("mapless.", description="Of the queues' names, as the server has it.")
    worker_token: SecretStr = Field(description="The workers' token, as the server has it.")
    worker_queue: Queue = Field("cpu", description="The queue to listen to.")
    worker_name: str = Field("worker", description="Tells workers of one machine apart.")
    work_dir: Path = Field(
        default_factory=_private_place,
        description="Reports and checkpoints on their way to the server; in the user's cache folder if not given.",
    )
    extensions: str = Field("", description=EXTENSIONS_SETTING)
    log_format: LogFormat = Field("text", description="Of the log: `text`, or `json`, an object a line.")
    min_free_bytes: int = Field(
        256 * 2**20, ge=0, description="Free space in the work folder below which a worker takes up no run."
    )
    until_idle_seconds: float | None = Field(
        None, gt=0.0, description="End after so long without work; for ever there if not given."
    )
    stop_grace_seconds: float = Field(
        20.0, gt=0.0, description="A trainer that was asked to stop is killed after this long."
    )
    release_grace_seconds: float = Field(6.0, gt=0.0, description="The same, while the worker itself shuts down.")

    def name(self, slot: int) -> str:
        """The name under which the server knows the `slot`-th process of this worker."""
        return f"{self.host_name}/{slot}"

    @property
    def host_name(self) -> str:
        """The name that all processes of this worker share."""
        return f"{self.worker_name}@{socket.gethostname()}"

"""Log lines as people or programs read them; each says which run it is about, where it is about one."""

import json
import logging
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from datetime import UTC, datetime
from typing import Literal

LogFormat = Literal["text", "json"]
"""Lines for people, or an object a line: `time` (ISO 8601, UTC), `level`, `logger`, `message`, `run`, `exception`."""

_run: ContextVar[str | None] = ContextVar("run", default=None)
# A worker's process trains one run at a time, with several threads.
_run_of_process: str | None = None


@contextmanager
def about(run_id: str) -> Iterator[None]:
    """Whatever is logged in this block, and on threads that work for it, is about this run."""
    token = _run.set(run_id)
    try:
        yield
    finally:
        _run.reset(token)


@contextmanager
def process_is_about(run_id: str) -> Iterator[None]:
    """Whatever this process logs during this block is about this run, on every thread of it."""
    global _run_of_process  # one a process, as it says
    _run_of_process = run_id
    try:
        yield
    finally:
        _run_of_process = None


def configure(log_format: LogFormat) -> None:
    """Log to standard error: our own words from INFO on, everybody else's from WARNING on."""
    handler = logging.StreamHandler(sys.stderr)
    handler.setFormatter(JsonFormatter() if log_format == "json" else _TextFormatter())
    root = logging.getLogger()
    root.handlers[:] = [handler]
    root.setLevel(logging.WARNING)
    logging.captureWarnings(True)
    for name in ("server", "workers"):
        logging.getLogger(name).setLevel(logging.INFO)


class JsonFormatter(logging.Formatter):
    """One JSON object a line, whatever was logged."""

    def format(self, record: logging.LogRecord) -> str:
        """The line."""
        said: dict[str, str] = {
            "time": datetime.fromtimestamp(record.created, UTC).isoformat(timespec="milliseconds"),
            "level": record.levelname,
            "logger": record.name,
            "message": record.getMessage(),
        }
        if (run_id := _about()) is not None:
            said["run"] = run_id
        if record.exc_info:
            said["exception"] = self.formatException(record.exc_info)
        return json.dumps(said, ensure_ascii=False)


class _TextFormatter(logging.Formatter):
    def __init__(self) -> None:
        super().__init__("%(asctime)s %(levelname)-7s %(message)s")

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 (logging's name)
        line = super().formatMessage(record)
        run_id = _about()
        return line if run_id is None or run_id in line else f"{line} [run {run_id}]"


def _about() -> str | None:
    return _run.get() or _run_of_process

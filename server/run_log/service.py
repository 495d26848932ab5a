"""A run's log: printed lines and events by time."""

from collections import deque
from collections.abc import Iterable, Iterator
from datetime import UTC, datetime
from heapq import merge

from sqlalchemy.orm import Session

from server.errors import ConflictError
from server.run_log.repository import LogRepository, PrintedLine
from server.run_log.schemas import LogLine, RunLog
from server.runs.repository import RunRepository
from server.services import Services
from workers.protocol import LogBatch
from workers.wording import counted

_BLOCK_LINES = 500


class LogService:
    """Takes in and reads logs."""

    def __init__(self, services: Services) -> None:
        self._services = services

    def append(self, run_id: str, attempt: int, batch: LogBatch) -> None:
        """Add what the trainer of an attempt has printed; what comes twice is there once.

        Raises:
            NotFoundError: there is no such run.
            ConflictError: a later attempt has it.
        """
        with self._services.database.write() as session:
            run = RunRepository(session).get(run_id, for_update=True)
            if run.attempt != attempt:
                raise ConflictError(f"Attempt {attempt} of run {run_id} is over.")
            LogRepository(session).append(run_id, attempt, batch)

    def end(self, run_id: str, limit: int, search: str) -> RunLog:
        """The last lines, or the last of those that hold a text, whatever its case.

        Raises:
            NotFoundError: there is no such run.
        """
        wanted = search.casefold()
        lines: deque[LogLine] = deque(maxlen=limit)
        total = 0
        with self._services.database.read() as session:
            RunRepository(session).check(run_id)
            for line in _stream(session, run_id):
                if wanted in line.text.casefold():
                    total += 1
                    lines.append(line)
        return RunLog(lines=list(lines), total=total)

    def text(self, run_id: str) -> Iterator[bytes]:
        """The whole log as text, a line each, block by block.

        Raises:
            NotFoundError: at once, if there is no such run.
        """
        with self._services.database.read() as session:
            RunRepository(session).check(run_id)
            # Bounded, and read at once: whoever reads slowly keeps no transaction open.
            lines = [_as_text(line) for line in _stream(session, run_id)]
        return ("".join(lines[start : start + _BLOCK_LINES]).encode() for start in range(0, len(lines), _BLOCK_LINES))


def _stream(session: Session, run_id: str) -> Iterable[LogLine]:
    """Printed lines and events, the oldest first."""
    events = [
        LogLine(at=event.at, kind="event", attempt=None, step=event.step, level=event.level, text=event.message)
        for event in RunRepository(session).events(run_id)
    ]
    return merge(events, _printed(LogRepository(session).lines(run_id)), key=lambda line: line.at)


def _printed(lines: Iterable[PrintedLine]) -> Iterator[LogLine]:
    """The lines as they are shown, and in every gap of their numbers how many are missing."""
    attempt, number = 0, 0
    for line in lines:
        if line.attempt != attempt:
            attempt, number = line.attempt, 0
        if (missing := line.number - number - 1) > 0:
            said = f"{counted(missing)} {'line was' if missing == 1 else 'lines were'} not kept."
            yield LogLine(at=line.at, kind="left out", attempt=attempt, step=None, level="warning", text=said)
        number = line.number
        yield LogLine(at=line.at, kind="output", attempt=attempt, step=None, level="info", text=line.text)


def _as_text(line: LogLine) -> str:
    moment = datetime.fromtimestamp(line.at, UTC).strftime("%Y-%m-%d %H:%M:%S.%f")[:-3]
    origin = f"attempt {line.attempt}" if line.kind == "output" else line.kind if line.kind == "left out" else line.level
    return f"{moment}Z [{origin}] {line.text}\n"

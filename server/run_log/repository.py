"""Printed lines in SQL: in chunks, numbered by attempt, so that a gap in the numbers says how many are missing."""

import json
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from sqlalchemy import Select, select
from sqlalchemy.orm import Session, defer

from server.database import tables
from workers.protocol import LogBatch

HEAD_BYTES = 512 * 1024
"""Of a run's first lines, which stay."""
TAIL_BYTES = 3 * 512 * 1024
"""Of its last lines; what lies between goes."""

_CHUNK_BYTES = 32 * 1024
# Number and time of a line.
_LINE_BYTES = 24


@dataclass(frozen=True)
class PrintedLine:
    """A line; `number` counts all lines of the attempt from 1, those that were not kept included."""

    attempt: int
    number: int
    at: float
    text: str


class LogRepository:
    """Reads and writes printed lines within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def append(self, run_id: str, attempt: int, batch: LogBatch) -> bool:
        """Add what is not there yet; returns whether anything was. Beyond the bound the middle goes."""
        # Of all but the last one only how large they are.
        chunks = list(self._session.scalars(_chunks_of(run_id).options(defer(tables.RunLogChunk.lines))))
        last = chunks[-1] if chunks else None
        known = last.first + last.count - 1 if last is not None and last.attempt == attempt else 0
        lines = [(line.at, line.text) for line in batch.lines][max(known + 1 - batch.first, 0) :]
        if not lines:
            return False
        first = max(batch.first, known + 1)
        if last is not None and known == first - 1 and known and last.size < _CHUNK_BYTES:
            kept = _unpack(last.lines) + lines
            last.lines, last.count, last.size = _pack(kept), len(kept), _size(kept)
        else:
            chunk = tables.RunLogChunk(
                run_id=run_id, attempt=attempt, first=first, count=len(lines), size=_size(lines), lines=_pack(lines)
            )
            self._session.add(chunk)
            chunks.append(chunk)
        for middle in _middle(chunks):
            self._session.delete(middle)
        return True

    def chunks(self, run_id: str) -> Iterator[tuple[int, int, list[tuple[float, str]]]]:
        """All that is kept, piece by piece: its attempt, the number of its first line, and the lines with their times."""
        for chunk in self._session.scalars(_chunks_of(run_id)):
            yield chunk.attempt, chunk.first, _unpack(chunk.lines)

    def add_chunk(self, run_id: str, attempt: int, first: int, lines: list[tuple[float, str]]) -> None:
        """Add such a piece as it is, behind those that are there."""
        self._session.add(
            tables.RunLogChunk(
                run_id=run_id, attempt=attempt, first=first, count=len(lines), size=_size(lines), lines=_pack(lines)
            )
        )

    def lines(self, run_id: str) -> Iterator[PrintedLine]:
        """All that are kept, the oldest first, a chunk at a time."""
        for attempt, first, lines in self.chunks(run_id):
            for number, (at, text) in enumerate(lines, start=first):
                yield PrintedLine(attempt, number, at, text)


def _chunks_of(run_id: str) -> Select[tables.RunLogChunk]:
    query = select(tables.RunLogChunk).where(tables.RunLogChunk.run_id == run_id)
    return query.order_by(tables.RunLogChunk.id)


def _middle(chunks: Sequence[tables.RunLogChunk]) -> list[tables.RunLogChunk]:
    """The chunks that go, so that head and tail keep to their bounds; the newest stays."""
    head = 0
    rest = list(chunks)
    while rest and head + rest[0].size <= HEAD_BYTES:
        head += rest.pop(0).size
    tail = sum(chunk.size for chunk in rest)
    gone = []
    while len(rest) > 1 and tail > TAIL_BYTES:
        tail -= rest[0].size
        gone.append(rest.pop(0))
    return gone


def _size(lines: list[tuple[float, str]]) -> int:
    return sum(len(text.encode()) + _LINE_BYTES for _, text in lines)


def _pack(lines: list[tuple[float, str]]) -> bytes:
    return zlib.compress(json.dumps(lines, ensure_ascii=False, separators=(",", ":")).encode())


def _unpack(data: bytes) -> list[tuple[float, str]]:
    return [(at, text) for at, text in json.loads(zlib.decompress(data))]

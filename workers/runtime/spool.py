"""What a training reports, in a local file first: kept until the server has it, however long the server is away.

One line an item: the CRC-32 of its JSON in eight hexadecimal digits, a space, the JSON. A line that a disk, or somebody,
has altered is noticed even where it still parses. Memory stays constant: what waits is read back from the file.
"""

import threading
import time
import zlib
from collections.abc import Mapping
from math import isfinite
from pathlib import Path

from pydantic import ValidationError

from workers.errors import SpoolDamagedError
from workers.protocol import ITEM, MAX_BATCH_ITEMS, EventItem, MetricItem
from workers.reporting import EventLevel

# What is acknowledged is cut off once there is this much of it: a training may last for days.
_SHORTEN_BYTES = 2**20
# Far above any line: an event has 10,000 characters, an item of metrics 256 values.
_MAX_LINE_BYTES = 2**20


class Spool:
    """Numbered items of one attempt, oldest first. Thread-safe.

    Args:
        path: the file; one that is there already is gone on with, without its last line if that was torn by a crash.
        last_seq: number of the last item that the server has.

    Raises:
        SpoolDamagedError: the file that is there already is damaged before its last line.
    """

    def __init__(self, path: Path, last_seq: int) -> None:
        self._lock = threading.Lock()
        self._file = path.open("a+b", buffering=0)
        self._acked = self._seq = last_seq
        self._acked_offset = 0
        self._file.seek(0)
        self._end = 0
        for line in self._file.read().splitlines(keepends=True):
            if not line.endswith(b"\n"):
                break
            self._seq = max(self._seq, _decode(line).seq)
            self._end += len(line)
        self._file.truncate(self._end)

    def metrics(self, step: int, at: float, values: Mapping[str, float]) -> int:
        """Append numbers at a step, made at `at`; returns the item's number."""
        finite = {name: value if isfinite(value) else None for name, value in values.items()}
        with self._lock:
            return self._append(MetricItem(seq=self._seq + 1, step=step, at=at, values=finite))

    def event(self, step: int, level: EventLevel, message: str) -> int:
        """Append a line for the event log; returns the item's number."""
        with self._lock:
            return self._append(EventItem(seq=self._seq + 1, step=step, at=time.time(), level=level, message=message))

    @property
    def last_seq(self) -> int:
        """Number of the last item appended."""
        return self._seq

    @property
    def acked(self) -> int:
        """Number of the last item that the server has."""
        return self._acked

    def pending(self, limit: int = MAX_BATCH_ITEMS) -> tuple[MetricItem | EventItem, ...]:
        """The oldest items that the server has not acknowledged, at most `limit`; where one is damaged, those before it.

        Raises:
            SpoolDamagedError: the oldest of them is not what was written, or cannot be read.
        """
        with self._lock:
            items: list[MetricItem | EventItem] = []
            try:
                self._read(items, limit)
            except (SpoolDamagedError, OSError) as error:
                if not items:
                    raise SpoolDamagedError(
                        f"what the training reported after item {self._acked} cannot be read back from {self._file.name}: "
                        f"{error}"
                    ) from error
            return tuple(items)

    def acknowledge(self, seq: int) -> None:
        """The server has everything up to `seq`."""
        with self._lock:
            self._acked = max(self._acked, seq)
            if self._acked >= self._seq and self._end > _SHORTEN_BYTES:
                self._file.truncate(0)
                self._end = self._acked_offset = 0

    def close(self) -> None:
        """Close the file; it stays where it is."""
        self._file.close()

    def _read(self, items: list[MetricItem | EventItem], limit: int) -> None:
        """Fill `items`, as far as the file is whole."""
        self._file.seek(self._acked_offset)
        offset = self._acked_offset
        before: int | None = None
        with open(self._file.fileno(), "rb", closefd=False) as lines:
            while offset < self._end and len(items) < limit:
                line = lines.readline(_MAX_LINE_BYTES)
                offset += len(line)
                item = _decode(line)
                if before is not None and item.seq != before + 1:
                    raise SpoolDamagedError(f"item {item.seq} follows item {before}")
                before = item.seq
                if item.seq > self._acked:
                    if not items and item.seq != self._acked + 1:
                        raise SpoolDamagedError(f"item {item.seq} follows item {self._acked}")
                    items.append(item)
                elif not items:
                    self._acked_offset = offset

    def _append(self, item: MetricItem | EventItem) -> int:
        line = _encode(item)
        written = self._file.write(line)
        if written != len(line):
            # A full disk: nothing may follow half a line.
            self._file.truncate(self._end)
            raise OSError(f"no space for what the training reports: {self._file.name}")
        self._end += len(line)
        self._seq = item.seq
        return item.seq


def _encode(item: MetricItem | EventItem) -> bytes:
    document = item.model_dump_json().encode()
    return b"%08x %s\n" % (zlib.crc32(document), document)


def _decode(line: bytes) -> MetricItem | EventItem:
    checksum, _, document = line.removesuffix(b"\n").partition(b" ")
    if not line.endswith(b"\n") or checksum != b"%08x" % zlib.crc32(document):
        raise SpoolDamagedError("a line is not as it was written")
    try:
        return ITEM.validate_json(document)
    except ValidationError as error:
        raise SpoolDamagedError("a line is no item of the protocol") from error

"""What a training reports, in a local file first: kept until the server has it, however long the server is away.

One JSON line an item. Memory stays constant: what waits is read back from the file.
"""

import threading
import time
from collections.abc import Mapping
from math import isfinite
from pathlib import Path

from workers.protocol import ITEM, MAX_BATCH_ITEMS, EventItem, MetricItem
from workers.reporting import EventLevel

# What is acknowledged is cut off once there is this much of it: a training may last for days.
_SHORTEN_BYTES = 2**20


class Spool:
    """Numbered items of one attempt, oldest first. Thread-safe.

    Args:
        path: the file; one that is there already is gone on with, without its last line if that was torn by a crash.
        last_seq: number of the last item that the server has.
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
            self._seq = max(self._seq, ITEM.validate_json(line).seq)
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
        """The oldest items that the server has not acknowledged, at most `limit`."""
        with self._lock:
            items: list[MetricItem | EventItem] = []
            self._file.seek(self._acked_offset)
            offset = self._acked_offset
            with open(self._file.fileno(), "rb", closefd=False) as lines:
                while offset < self._end and len(items) < limit:
                    line = lines.readline()
                    offset += len(line)
                    item = ITEM.validate_json(line)
                    if item.seq > self._acked:
                        items.append(item)
                    elif not items:
                        self._acked_offset = offset
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

    def _append(self, item: MetricItem | EventItem) -> int:
        line = item.model_dump_json().encode() + b"\n"
        written = self._file.write(line)
        if written != len(line):
            # A full disk: nothing may follow half a line.
            self._file.truncate(self._end)
            raise OSError(f"no space for what the training reports: {self._file.name}")
        self._end += len(line)
        self._seq = item.seq
        return item.seq

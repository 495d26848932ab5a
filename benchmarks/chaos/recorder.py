"""What the workers wrote to their spools, kept when they remove it: the truth that the database is compared with."""

import contextlib
import json
import os
import threading
import zlib
from collections import defaultdict
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

_INTERVAL_SECONDS = 0.02
_SPOOL = "spool.jsonl"
_KEPT = ".kept"


@dataclass(frozen=True)
class Attempt:
    """What one attempt of a run has spooled, in order of the items' numbers.

    Attributes:
        number: of the attempt.
        items: as JSON says them.
    """

    number: int
    items: tuple[dict[str, Any], ...]


class Recorder:
    """Links every spool under another name as soon as it is there; the bytes stay when the worker removes its own.

    Args:
        directories: of the workers: each has its work directory `work`, and gets the links in `recorded`.
    """

    def __init__(self, directories: Iterable[Path]) -> None:
        self._directories = tuple(directories)
        for directory in self._directories:
            (directory / "work").mkdir()
            (directory / "recorded").mkdir()
        self._closed = threading.Event()
        self._thread = threading.Thread(target=self._watch, name="recorder", daemon=True)
        self._thread.start()

    def keep(self, spool: Path) -> None:
        """Copy a spool as it is now, before it is damaged."""
        target = spool.parents[2] / "recorded" / f"{spool.parent.name}{_KEPT}"
        with target.open("ab") as kept:
            kept.write(spool.read_bytes())

    def close(self) -> None:
        """Link no more."""
        self._closed.set()
        self._thread.join()

    def attempts(self) -> dict[str, list[Attempt]]:
        """What was spooled, by run: its attempts in order.

        Raises:
            RuntimeError: a spool was not recorded whole, so nothing can be proved.
        """
        found: dict[tuple[str, int], dict[int, dict[str, Any]]] = defaultdict(dict)
        damaged: set[tuple[str, int]] = set()
        for directory in self._directories:
            for path in (directory / "recorded").iterdir():
                _, run_id, attempt = path.stem.split("-")
                found[run_id, int(attempt)].update((item["seq"], item) for item in _items(path))
                if path.suffix == _KEPT:
                    damaged.add((run_id, int(attempt)))
        runs: dict[str, list[Attempt]] = defaultdict(list)
        for (run_id, number), items in sorted(found.items()):
            numbers = sorted(items)
            whole = [seq for place, seq in enumerate(numbers) if seq == numbers[0] + place]
            # What is written onto a torn line is lost with it, and nothing beyond is ever read: the attempt ends there.
            if whole != numbers and (run_id, number) not in damaged:
                raise RuntimeError(f"the spool of attempt {number} of run {run_id} was not recorded whole")
            runs[run_id].append(Attempt(number, tuple(items[seq] for seq in whole)))
        return runs

    def _watch(self) -> None:
        while not self._closed.wait(_INTERVAL_SECONDS):
            for directory in self._directories:
                for spool in (directory / "work").glob(f"*/{_SPOOL}"):
                    target = directory / "recorded" / f"{spool.parent.name}.jsonl"
                    with contextlib.suppress(FileExistsError, FileNotFoundError):
                        os.link(spool, target)


def _items(path: Path) -> Iterator[dict[str, Any]]:
    """The lines that are as they were written; a damaged one stands whole in what was kept before the damage."""
    for line in path.read_bytes().splitlines():
        checksum, _, document = line.partition(b" ")
        if checksum == b"%08x" % zlib.crc32(document):
            yield json.loads(document)

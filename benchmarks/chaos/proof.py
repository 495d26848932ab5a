"""What the workers spooled against what the database has, point by point, and weights against those of undisturbed runs."""

import hashlib
import math
import struct
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import select
from sqlalchemy.orm import Session

from benchmarks.chaos.recorder import Attempt
from server.database import tables
from server.database.engine import Database
from server.metrics.axes import AxisRepository
from server.runs.repository import RunRepository
from workers.checkpoints import read_checkpoint
from workers.errors import ArchiveError
from workers.wording import NARROW_SPACE

# A series' name, a step, and the bits of the time and of the value: what the database keeps of a reported number.
Point = tuple[str, int, bytes]
_BITS = struct.Struct("<df")
_NAN = b"nan"


@dataclass
class Verdict:
    """What was compared, and what was found; everything but the counts should be zero or empty.

    Attributes:
        points: that must be in the database.
        lost: of these, those that are not there.
        doubled: that are there more often than once, or should have been taken back with a lost attempt.
        altered: that are there with another value or time.
        events: lines of event logs that must be there.
        events_wrong: of these, those that are missing or there twice.
        checkpoints: that nobody damaged.
        torn: of these, those whose archive is not what was registered.
        runs: completed ones whose weights were compared.
        differing: of these, those whose final state differs from the undisturbed run's in any bit.
    """

    points: int = 0
    lost: int = 0
    doubled: int = 0
    altered: int = 0
    events: int = 0
    events_wrong: int = 0
    checkpoints: int = 0
    torn: int = 0
    runs: int = 0
    differing: list[str] = field(default_factory=list)


class Proof:
    """Compares, run by run.

    Args:
        database_url: of the service's database.
        archives: the directory of the checkpoints.
        attempts: what was spooled, by run.
        damaged: ids of checkpoints that were damaged on purpose.
    """

    def __init__(
        self, database_url: str, archives: Path, attempts: Mapping[str, Sequence[Attempt]], damaged: set[str]
    ) -> None:
        self._database = Database(database_url)
        self._archives = archives
        self._attempts = attempts
        self._damaged = damaged
        self.verdict = Verdict()

    def close(self) -> None:
        """Close the database."""
        self._database.dispose()

    def check(self, run_id: str, reference_id: str) -> None:
        """Compare all that there is of a completed run, and its final state with that of the undisturbed one."""
        with self._database.read() as session:
            limits = _limits(session, run_id)
            self._check_points(session, run_id, limits)
            self._check_events(session, run_id, limits)
            self._check_archives(session, run_id)
            self.verdict.runs += 1
            ours, theirs = self._final_state(session, run_id), self._final_state(session, reference_id)
            if ours is None or ours != theirs:
                self.verdict.differing.append(run_id)

    def _check_points(self, session: Session, run_id: str, limits: Mapping[int, float]) -> None:
        expected: Counter[Point] = Counter()
        for attempt in self._attempts.get(run_id, ()):
            for item in attempt.items:
                if item["kind"] == "metrics" and item["step"] <= limits[attempt.number]:
                    expected.update(_point(name, item["step"], item["at"], value) for name, value in item["values"].items())
        found: Counter[Point] = Counter()
        # The tables as they are: whoever reads curves sees one point a step, and would hide what is there twice.
        for row in session.scalars(select(tables.MetricRow).where(tables.MetricRow.run_id == run_id)):
            found.update(_point(name, row.step, row.wall_time, value) for name, value in row.values.items())
        chunks = session.scalars(select(tables.MetricChunk).where(tables.MetricChunk.run_id == run_id))
        for chunk, points in AxisRepository(session).decoded(chunks):
            rows = zip(points.steps.tolist(), points.times.tolist(), points.values.tolist(), strict=True)
            found.update(_point(chunk.name, step, at, value) for step, at, value in rows)
        compare(expected, found, self.verdict)

    def _check_events(self, session: Session, run_id: str, limits: Mapping[int, float]) -> None:
        """What was said before the checkpoint that the next attempt resumed from is there; nothing is there twice."""
        found = Counter(event.message + repr(event.at) for event in RunRepository(session).events(run_id))
        for attempt in self._attempts.get(run_id, ()):
            kept = [item["seq"] for item in attempt.items if item["step"] <= limits[attempt.number]]
            for item in attempt.items:
                if item["kind"] != "event":
                    continue
                times = found[item["message"] + repr(item["at"])]
                needed = bool(kept) and item["seq"] <= kept[-1]
                self.verdict.events += needed
                self.verdict.events_wrong += times > 1 or (needed and times == 0)

    def _check_archives(self, session: Session, run_id: str) -> None:
        query = select(tables.Checkpoint).where(tables.Checkpoint.run_id == run_id)
        for checkpoint in session.scalars(query):
            if checkpoint.id in self._damaged:
                continue
            self.verdict.checkpoints += 1
            path = self._archives / f"{checkpoint.id}.zip"
            whole = path.exists() and hashlib.sha256(path.read_bytes()).hexdigest() == checkpoint.sha256
            self.verdict.torn += not whole

    def _final_state(self, session: Session, run_id: str) -> dict[str, bytes] | None:
        """Weights and everything else that a resumed training would go on from; None where the archive cannot be read."""
        query = select(tables.Checkpoint.id).where(tables.Checkpoint.run_id == run_id)
        last = session.scalars(query.order_by(tables.Checkpoint.step.desc()).limit(1)).one()
        try:
            checkpoint = read_checkpoint(self._archives / f"{last}.zip")
        except (ArchiveError, OSError):
            return None
        return {
            # How long it took differs from time to time.
            "counters": checkpoint.counters.model_dump_json(exclude={"effort": {"wall_seconds", "cpu_seconds"}}).encode(),
            **{f"weights {name}": _bits(array) for name, array in checkpoint.weights.items()},
            **{f"state {name}": _bits(array) for name, array in checkpoint.arrays.items()},
        }


def compare(expected: Counter[Point], found: Counter[Point], verdict: Verdict) -> None:
    """Add what is lost, doubled and altered to the verdict.

    A point that is missing while another one stands at its step is altered; one too many is doubled, whether it is there
    twice or should not be there at all.
    """
    missing, surplus = expected - found, found - expected
    surplus_at: dict[tuple[str, int], int] = defaultdict(int)
    for (name, step, _), count in surplus.items():
        surplus_at[name, step] += count
    altered = 0
    for (name, step, _), count in missing.items():
        taken = min(count, surplus_at[name, step])
        surplus_at[name, step] -= taken
        altered += taken
    verdict.points += expected.total()
    verdict.altered += altered
    verdict.lost += missing.total() - altered
    verdict.doubled += surplus.total() - altered


def _limits(session: Session, run_id: str) -> dict[int, float]:
    """For each attempt the last step that was not taken back: the smallest that a later attempt went on from."""
    resumed: dict[int, float] = {}
    for event in RunRepository(session).events(run_id):
        words = event.message.split(" ")
        if words[:1] == ["Attempt"] and words[2:4] == ["begins", "from"]:
            resumed[int(words[1])] = -1 if words[4] == "the" else int(words[5].replace(NARROW_SPACE, ""))
    limits: dict[int, float] = {}
    limit = math.inf
    for number in sorted(resumed, reverse=True):
        limits[number] = limit
        limit = min(limit, resumed[number])
    return limits


def _point(name: str, step: int, at: float, value: float | None) -> Point:
    if value is None or math.isnan(value):
        return name, step, struct.pack("<d", at) + _NAN
    return name, step, _BITS.pack(at, np.float32(value))


def _bits(array: NDArray[np.generic]) -> bytes:
    return f"{array.dtype} {array.shape} ".encode() + np.ascontiguousarray(array).tobytes()

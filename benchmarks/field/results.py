"""What came of each piece, kept line by line in a file that the next run goes on with."""

import math
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.field.candidates import Candidate
from benchmarks.field.suites import STARTS, TEN_STARTS, Piece, rules_of, suite_of_piece
from sim.config import Frozen
from sim.suites import EpisodeTable, Suite, run_controller
from sim.suites.people import run_among_people
from sim.suites.scores import barn_score
from workers.shipped.field import FieldKey, FieldRow
from workers.shipped.figures import worst_tenth
from workers.training.evaluation import to_result

_ARRIVAL, _COLLISION = 1, 2


class PieceResult(Frozen):
    """A line of the file: a candidate's episodes in a piece of a suite, in its order.

    Attributes:
        key: who drove what.
        first: scenario of the suite.
        hash: of the piece's scenarios and arenas.
        outcomes: 1 arrival, 2 collision, 3 time-out.
        seconds: taken.
        efficiencies: shortest path over the driven one, 0 where it did not arrive.
        scores: of the BARN challenge; empty elsewhere, as are the following where nobody walks.
        at_fault: whether the robot collided by its own motion.
        intrusion, delay, detour: see `sim.suites.people.PeopleTable`.
        cpu: seconds of processor that it took.
    """

    key: FieldKey
    first: int
    hash: str
    outcomes: tuple[int, ...]
    seconds: tuple[float, ...]
    efficiencies: tuple[float, ...]
    scores: tuple[float, ...] = ()
    at_fault: tuple[bool, ...] = ()
    intrusion: tuple[float, ...] = ()
    delay: tuple[float, ...] = ()
    detour: tuple[float, ...] = ()
    cpu: float


class Kept:
    """The file of results, one JSON line a piece.

    Args:
        path: of the file; it need not exist.
    """

    def __init__(self, path: Path) -> None:
        self._path = path
        lines = path.read_text().splitlines() if path.exists() else []
        self._results = {}
        for line in lines:
            result = PieceResult.model_validate_json(line)
            self._results[result.key, result.first] = result

    def __iter__(self) -> Iterator[PieceResult]:
        return iter(self._results.values())

    def get(self, key: FieldKey, piece: Piece) -> PieceResult | None:
        """What was kept of a piece of as many scenarios."""
        result = self._results.get((key, piece.first))
        return result if result and len(result.outcomes) == piece.count else None

    def add(self, result: PieceResult) -> None:
        """Keeps it, on the disk at once."""
        self._results[result.key, result.first] = result
        with self._path.open("a") as file:
            file.write(result.model_dump_json(exclude_defaults=True) + "\n")


def key_of(candidate: Candidate, piece: Piece) -> FieldKey:
    """Who drives what."""
    lidar = candidate.task_under(rules_of(piece)).lidar
    return FieldKey(
        part=piece.part,
        suite=piece.suite,
        driver=candidate.name,
        policy=candidate.policy,
        seed=candidate.seed,
        rays=lidar.rays,
        field_of_view=lidar.field_of_view,
    )


def drive(candidate: Candidate, piece: Piece) -> PieceResult:
    """Drives a piece of a suite.

    Raises:
        SuiteError: the suite is for another robot.
    """
    begun, suite = time.process_time(), suite_of_piece(piece)
    task = candidate.task_under(suite.rules)
    controller = candidate.controller(task, suite)
    more: dict[str, tuple[float, ...]] = {}
    if piece.part == "people":
        found = run_among_people(controller, task, suite)
        table = found.episodes
        more = {name: _rounded(getattr(found, name)) for name in ("intrusion", "delay", "detour")}
        more["at_fault"] = tuple(found.at_fault.tolist())
    else:
        table = run_controller(controller, task, suite)
    if piece.part == "barn":
        more["scores"] = _rounded(barn_score(table, task))
    return PieceResult(
        key=key_of(candidate, piece),
        first=piece.first,
        hash=suite.hash,
        outcomes=tuple(table.outcomes.tolist()),
        seconds=_rounded(task.control_period * table.steps),
        efficiencies=_efficiencies(table, suite, task.arrival_distance),
        **more,
        cpu=round(time.process_time() - begun, 2),
    )


def rows(results: Iterator[PieceResult]) -> tuple[FieldRow, ...]:
    """The results of each candidate on each suite in one row."""
    together: dict[FieldKey, list[PieceResult]] = {}
    for result in results:
        together.setdefault(result.key, []).append(result)
    return tuple(_row(key, found) for key, found in together.items())


def _row(key: FieldKey, found: list[PieceResult]) -> FieldRow:
    def joined(name: str) -> NDArray[np.floating[Any]]:
        return np.array([value for result in found for value in getattr(result, name)], dtype=np.float64)

    def mean(name: str) -> float | None:
        values = joined(name)
        return round(float(values.mean()), 4) if len(values) else None

    outcomes, seconds, merits = joined("outcomes"), joined("seconds"), joined("efficiencies")
    arrived = outcomes == _ARRIVAL
    return FieldRow(
        **key.model_dump(),
        episodes=len(outcomes),
        arrivals=int(arrived.sum()),
        collisions=int((outcomes == _COLLISION).sum()),
        spl=round(float(merits.mean()), 4),
        worst_tenth_spl=round(worst_tenth(merits.tolist()), 4),
        seconds=round(float(seconds[arrived].mean()), 2) if arrived.any() else None,
        score=mean("scores"),
        at_fault=int(joined("at_fault").sum()) if key.part == "people" else None,
        intrusion=mean("intrusion"),
        delay=mean("delay"),
        detour=mean("detour"),
        worlds=_worlds(arrived) if key.suite == TEN_STARTS else None,
    )


def _worlds(arrived: NDArray[np.bool_]) -> tuple[int, ...]:
    return tuple(np.bincount(arrived.reshape(-1, STARTS).sum(axis=1), minlength=STARTS + 1).tolist())


def _efficiencies(table: EpisodeTable, suite: Suite, arrival_distance: float) -> tuple[float, ...]:
    return tuple(
        round(episode.path_efficiency(arrival_distance), 3) if episode.outcome == "arrival" else 0.0
        for episode in to_result(table, suite).episodes
    )


def _rounded(values: NDArray[np.floating[Any]]) -> tuple[float, ...]:
    return tuple(round(float(value), 3) if math.isfinite(value) else 0.0 for value in values)

"""Series of the runs that were looked at last, which grow by what is reported, so that a look costs what is new."""

import threading
from collections import OrderedDict
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from server.metrics.lines import Line, grown, sharing_places
from server.metrics.repository import MetricRepository
from server.recent import Turns
from server.runs.repository import PointsState

_MAX_BYTES = 64 * 2**20
# A series that has so many points beyond its summary is read anew, when the summary may have them.
_MAX_POINTS = 8_192


@dataclass(frozen=True, slots=True, eq=False)
class _Kept:
    """What was read of a run."""

    state: PointsState
    lines: Mapping[str, Line]
    nbytes: int

    @property
    def newest(self) -> int:
        """The last step of all series; -1 where there is none."""
        return max((line.newest for line in self.lines.values()), default=-1)

    def goes_on_to(self, run: PointsState) -> bool:
        """Whether the run has only been added to since then."""
        then = self.state
        unchanged = (then.attempt, then.thinned_at, then.thinned_from, then.thinned_to) == (
            run.attempt,
            run.thinned_at,
            run.thinned_from,
            run.thinned_to,
        )
        return unchanged and then.last_seq <= run.last_seq and self.newest <= run.step


class KeptSeries:
    """All series of the runs asked for last, fine enough for `SUMMARY_WIDTH`; bounded in bytes. Thread-safe."""

    def __init__(self, max_bytes: int = _MAX_BYTES) -> None:
        self._max_bytes = max_bytes
        self._turns = Turns()
        self._lock = threading.Lock()
        self._runs: OrderedDict[str, _Kept] = OrderedDict()
        self._bytes = 0

    def of(self, run: PointsState, repository: MetricRepository) -> Mapping[str, Line]:
        """A run's series, by name; what has come since the last look is read, once for all who ask at once.

        Args:
            run: what its points depend on, as the repository's transaction sees it.
            repository: reads what is not known.
        """
        with self._turns.of(run.run_id):
            with self._lock:
                known = self._runs.get(run.run_id)
            if known is None or known.state != run:
                known = self._keep(run, self._read(run, known, repository))
        return known.lines

    def _read(self, run: PointsState, known: _Kept | None, repository: MetricRepository) -> dict[str, Line]:
        if known is not None and known.goes_on_to(run):
            fresh = repository.since(run.run_id, None, known.newest)
            lines = None if fresh is None else grown(known.lines, fresh)
            if lines is not None and all(len(line.points) <= _MAX_POINTS for line in lines.values()):
                return lines
        return sharing_places(repository.lines([run.run_id])[run.run_id])

    def _keep(self, run: PointsState, lines: Mapping[str, Line]) -> _Kept:
        kept = _Kept(run, lines, _nbytes(lines.values()))
        with self._lock:
            before = self._runs.pop(run.run_id, None)
            self._runs[run.run_id] = kept
            self._bytes += kept.nbytes - (before.nbytes if before is not None else 0)
            while self._bytes > self._max_bytes:
                _, oldest = self._runs.popitem(last=False)
                self._bytes -= oldest.nbytes
        return kept


def _nbytes(lines: Iterable[Line]) -> int:
    """Of all arrays, each counted once."""
    return sum({id(array): array.nbytes for line in lines for array in line.arrays()}.values())

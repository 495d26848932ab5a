"""What the reports of one transaction hold, of however many runs, in few statements."""

from collections import defaultdict
from collections.abc import Sequence

from sqlalchemy.orm import Session

from server.database import tables
from server.metrics.repository import MetricRepository, ReportedRow
from workers.protocol import EventItem, MetricItem

# Whether rows should be compacted is looked at once in so many items: counting them costs a query.
_COMPACT_EVERY = 64


class ReportedItems:
    """Collects items, and writes them within the caller's transaction.

    Attributes:
        grown: runs of which enough rows may wait by then to be compacted.
    """

    def __init__(self, session: Session) -> None:
        self._session = session
        self._metrics = MetricRepository(session)
        self._rows: dict[str, list[ReportedRow]] = defaultdict(list)
        self.grown: set[str] = set()

    def add(self, run: tables.Run, items: Sequence[MetricItem | EventItem]) -> None:
        """Take up the next items of a run, none of which is stored, and move the run on; they are written later."""
        if not items:
            return
        rows = [
            ReportedRow(item.seq, item.step, item.at, {k: float("nan") if v is None else v for k, v in item.values.items()})
            for item in items
            if isinstance(item, MetricItem)
        ]
        self._rows[run.id] += rows
        self._session.add_all(
            tables.RunEvent(run_id=run.id, at=item.at, step=item.step, level=item.level, message=item.message)
            for item in items
            if isinstance(item, EventItem)
        )
        before, run.last_seq = run.last_seq, items[-1].seq
        run.step = max([run.step, *(row.step for row in rows)])
        if before // _COMPACT_EVERY != run.last_seq // _COMPACT_EVERY:
            self.grown.add(run.id)

    def write(self) -> None:
        """Write what was taken up."""
        if not self._rows:
            return
        self._metrics.append(self._rows)
        self._rows.clear()

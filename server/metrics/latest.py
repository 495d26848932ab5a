"""The newest value of each series, in SQL; as many runs and series at once as reports bring, in one statement."""

from collections.abc import Mapping

from sqlalchemy import text
from sqlalchemy.orm import Session

# Written out: the driver takes them as they are, where statements that are put together a value at a time take most of the
# time that a report takes.
_SQLITE = """
INSERT INTO latest_metrics (run_id, name, step, value) VALUES (?, ?, ?, ?)
ON CONFLICT (run_id, name) DO UPDATE SET step = excluded.step, value = excluded.value
"""
_POSTGRESQL = text(
    """
INSERT INTO latest_metrics (run_id, name, step, value)
SELECT * FROM unnest(CAST(:runs AS text[]), CAST(:names AS text[]), CAST(:steps AS bigint[]), CAST(:values AS float8[]))
ON CONFLICT (run_id, name) DO UPDATE SET step = excluded.step, value = excluded.value
"""
)


def set_latest(session: Session, newest: Mapping[tuple[str, str], tuple[int, float]]) -> None:
    """Write step and value of series, by run and name, in place of those that are there."""
    if not newest:
        return
    rows = [(run_id, name, step, value) for (run_id, name), (step, value) in newest.items()]
    if session.get_bind().dialect.name == "postgresql":
        runs, names, steps, values = map(list, zip(*rows, strict=True))
        session.execute(_POSTGRESQL, {"runs": runs, "names": names, "steps": steps, "values": values})
    else:
        session.flush()
        session.connection().exec_driver_sql(_SQLITE, rows)

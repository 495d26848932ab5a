"""How runs stand, read from the database itself: the server may be away, and is not asked to vouch for itself."""

from collections.abc import Collection
from dataclasses import dataclass

from sqlalchemy import bindparam, create_engine, text
from sqlalchemy.exc import SQLAlchemyError
from sqlalchemy.pool import NullPool

_QUERY = text("SELECT id, state, attempt, last_seq, step, losses, worker FROM runs WHERE id IN :ids").bindparams(
    bindparam("ids", expanding=True)
)


@dataclass(frozen=True)
class Progress:
    """A run's row.

    Attributes:
        last_seq: number of the last item that was taken: it only ever grows.
        losses: attempts in a row that brought no checkpoint.
        worker: the node's name; None where nobody has the run.
    """

    state: str
    attempt: int
    last_seq: int
    step: int
    losses: int
    worker: str | None


class Rows:
    """Reads the rows of runs, each time on a connection of its own."""

    def __init__(self, url: str) -> None:
        self._engine = create_engine(url, poolclass=NullPool)

    def read(self, run_ids: Collection[str]) -> dict[str, Progress]:
        """The runs as they stand now, by id; empty where the database does not answer."""
        try:
            with self._engine.connect() as connection:
                rows = connection.execute(_QUERY, {"ids": list(run_ids)}).all()
        except SQLAlchemyError:
            return {}
        return {
            row.id: Progress(
                row.state,
                row.attempt,
                row.last_seq,
                row.step,
                row.losses,
                row.worker.partition("@")[0] if row.worker else None,
            )
            for row in rows
        }

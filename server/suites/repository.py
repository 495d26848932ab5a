"""Suites of one's own in SQL."""

from collections.abc import Sequence

from sqlalchemy import func, select
from sqlalchemy.orm import Session

from server.database import tables
from server.errors import NotFoundError


class SuiteRepository:
    """Reads and writes them within the caller's transaction."""

    def __init__(self, session: Session) -> None:
        self._session = session

    def all(self) -> Sequence[tables.OwnSuite]:
        """Every suite, by name."""
        row = tables.OwnSuite
        return self._session.scalars(select(row).order_by(func.lower(row.name), row.id)).all()

    def get(self, suite_id: str) -> tables.OwnSuite:
        """One of them.

        Raises:
            NotFoundError: there is none.
        """
        found = self._session.get(tables.OwnSuite, suite_id)
        if found is None:
            raise NotFoundError.of("suite", suite_id)
        return found

    def add(self, suite: tables.OwnSuite) -> None:
        """Add one."""
        self._session.add(suite)
        self._session.flush()

    def delete(self, suite: tables.OwnSuite) -> None:
        """Remove one."""
        self._session.delete(suite)

    def using(self, sha256: str) -> list[str]:
        """Names of the suites that have a scenario in an arena."""
        return [suite.name for suite in self.all() if any(one["sha256"] == sha256 for one in suite.scenarios)]

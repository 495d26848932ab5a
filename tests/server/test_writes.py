"""How often each table was written, counted where transactions end."""

import pytest
from sqlalchemy import delete, text, update

from server.audit.repository import AuditRepository
from server.database import tables
from server.services import Services


class StoppedError(Exception):
    """Ends a transaction early."""


def test_a_transaction_counts_once_for_each_table_that_it_wrote(services: Services, client: object) -> None:
    writes = services.database.writes
    before = writes.of("audit_entries", "projects")

    with services.database.write() as session:
        AuditRepository(session).add("run.stopped")
        AuditRepository(session).add("run.stopped")
        session.flush()
        assert writes.of("audit_entries", "projects") == before, "it is not committed"

    assert writes.of("audit_entries", "projects") == (before[0] + 1, before[1])


def test_what_reads_counts_for_nothing(services: Services, client: object) -> None:
    names = ("experiments", "projects", "runs")  # the service itself may write an alert meanwhile
    before = services.database.writes.of(*names)

    with services.database.read() as session:
        session.get(tables.Project, "default")
    with services.database.write() as session:
        session.get(tables.Project, "default")

    assert services.database.writes.of(*names) == before


def test_a_deletion_reaches_what_points_there(services: Services, client: object) -> None:
    names = ("runs", "checkpoints", "evaluations", "experiment_tags", "projects")
    before = services.database.writes.of(*names)

    with services.database.write() as session:
        session.execute(delete(tables.Experiment).where(tables.Experiment.id == "nobody"))

    moved = [now > then for now, then in zip(services.database.writes.of(*names), before, strict=True)]
    assert moved == [True, True, True, True, False]


def test_statements_of_other_kinds_count_for_every_table(services: Services, client: object) -> None:
    names = tuple(tables.Base.metadata.tables)
    before = services.database.writes.of(*names)

    with services.database.write() as session:
        session.execute(text("WITH none AS (SELECT 1) SELECT * FROM none"))

    assert all(now > then for now, then in zip(services.database.writes.of(*names), before, strict=True))


def test_a_transaction_that_was_rolled_back_may_count(services: Services, client: object) -> None:
    """Too often is harmless; and whether a commit that failed was one nobody can tell."""
    before = services.database.writes.of("projects")

    with pytest.raises(StoppedError):
        _give_up(services)

    assert services.database.writes.of("projects") > before


def _give_up(services: Services) -> None:
    with services.database.write() as session:
        session.execute(update(tables.Project).values(name="Other"))
        raise StoppedError

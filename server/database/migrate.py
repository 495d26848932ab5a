"""Brings the database to the tables of this version."""

import logging
import time
from pathlib import Path
from typing import TYPE_CHECKING

from sqlalchemy import Connection, inspect, text
from sqlalchemy.exc import OperationalError

from server.database.engine import Database
from server.errors import ServiceError

if TYPE_CHECKING:
    from alembic.config import Config

logger = logging.getLogger(__name__)

_RETRY_SECONDS = 0.5
_SCRIPTS = Path(__file__).resolve().parents[1] / "migrations"


class IncompatibleDatabaseError(ServiceError):
    """The database was written by a newer version."""


class UnreachableDatabaseError(ServiceError):
    """The database does not answer, or does not let us in."""


def head() -> str:
    """The newest revision: migrations are numbered, and their files begin with their number."""
    return known_revisions()[-1]


def upgrade(database: Database, wait_seconds: float = 0.0) -> None:
    """Run the migrations that the database has not seen, all in one transaction.

    Args:
        database: to be brought up to date.
        wait_seconds: how long a database server may take to come up: whatever starts both at once does not wait for it.

    Raises:
        IncompatibleDatabaseError: the database is from a newer version.
        UnreachableDatabaseError: it can't be reached.
        UnusableDatabaseError: it can't hold what the service keeps.
    """
    patience = 0.0 if database.engine.dialect.name == "sqlite" else wait_seconds
    deadline = time.monotonic() + patience
    told = ""
    while True:
        try:
            if revision(database) != head():
                _run_migrations(database)
        except OperationalError as error:
            # What follows the first line are guesses at the cause.
            reason, *_ = str(error.orig).splitlines()
            url = database.engine.url.render_as_string(hide_password=True)
            if time.monotonic() >= deadline:
                raise UnreachableDatabaseError(f"The database {url} can't be used: {reason}") from error
            if reason != told:
                logger.warning("The database %s can't be used yet: %s. Trying for %g s.", url, reason, patience)
                told = reason
            time.sleep(_RETRY_SECONDS)
        else:
            return


def migration_config(database: Database) -> "Config":
    """Alembic's configuration for this database; there is no alembic.ini that could disagree with the settings."""
    return _config(database=database)


def known_revisions() -> list[str]:
    """The revisions that lead to this version's tables, the oldest first."""
    return sorted(path.name.partition("_")[0] for path in (_SCRIPTS / "versions").glob("[0-9]*.py"))


def bring(connection: Connection, to: str) -> None:
    """Bring the tables to a revision that they have not seen, within the caller's transaction (`rebuilding`)."""
    from alembic import command

    command.upgrade(_config(connection=connection), to)


def tear_down(connection: Connection) -> None:
    """Take every migration back, and with it every table and row, within the caller's transaction (`rebuilding`)."""
    from alembic import command

    command.downgrade(_config(connection=connection), "base")


def revision(database: Database) -> str | None:
    """The last migration that the database has seen; None where it has no tables yet."""
    with database.read() as session:
        if not inspect(session.connection()).has_table("alembic_version"):
            return None
        revision: str | None = session.scalar(text("SELECT version_num FROM alembic_version"))
        return revision


def _config(**attributes: object) -> "Config":
    from alembic.config import Config

    config = Config()
    config.set_main_option("script_location", str(_SCRIPTS))
    config.attributes.update(attributes)
    return config


def _run_migrations(database: Database) -> None:
    # Late: Alembic is a tenth of the server's start, and most starts find nothing to do.
    from alembic import command
    from alembic.util import CommandError

    try:
        command.upgrade(migration_config(database), "head")
    except CommandError as error:
        raise IncompatibleDatabaseError(
            f"The database was written by a newer version of Mapless ({error}): update the program, or use another database."
        ) from error

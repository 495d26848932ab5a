"""Brings the database to the tables of this version."""

from pathlib import Path

from alembic import command
from alembic.config import Config
from alembic.util import CommandError
from sqlalchemy.exc import OperationalError

from server.database import Database
from server.errors import ServiceError

_SCRIPTS = Path(__file__).resolve().parent / "migrations"


class IncompatibleDatabaseError(ServiceError):
    """The database was written by a newer version."""


class UnreachableDatabaseError(ServiceError):
    """The database does not answer, or does not let us in."""


def migration_config(database: Database) -> Config:
    """Alembic's configuration for this database; there is no alembic.ini that could disagree with the settings."""
    config = Config()
    config.set_main_option("script_location", str(_SCRIPTS))
    config.attributes["database"] = database
    return config


def upgrade(database: Database) -> None:
    """Run the migrations that the database has not seen, all in one transaction.

    Raises:
        IncompatibleDatabaseError: the database is from a newer version.
        UnreachableDatabaseError: it can't be reached.
    """
    try:
        command.upgrade(migration_config(database), "head")
    except CommandError as error:
        raise IncompatibleDatabaseError(
            f"The database was written by a newer version of Mapless ({error}): update the program, or use another database."
        ) from error
    except OperationalError as error:
        # What follows the first line are guesses at the cause.
        reason, *_ = str(error.orig).splitlines()
        url = database.engine.url.render_as_string(hide_password=True)
        raise UnreachableDatabaseError(f"The database {url} can't be used: {reason}") from error

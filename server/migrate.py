"""Brings the database to the tables of this version."""

from pathlib import Path

from alembic import command
from alembic.config import Config

from server.database import Database

_SCRIPTS = Path(__file__).resolve().parent / "migrations"


def migration_config(database: Database) -> Config:
    """Alembic's configuration for this database; there is no alembic.ini that could disagree with the settings."""
    config = Config()
    config.set_main_option("script_location", str(_SCRIPTS))
    config.attributes["database"] = database
    return config


def upgrade(database: Database) -> None:
    """Run the migrations that the database has not seen, all in one transaction.

    Raises:
        alembic.util.CommandError: the database is from a newer version.
        sqlalchemy.exc.SQLAlchemyError: it can't be reached or changed.
    """
    command.upgrade(migration_config(database), "head")

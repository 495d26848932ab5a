"""`mapless move-checkpoints`: takes every archive from one store to another, of either kind, while the service runs."""

import asyncio
import tempfile
from collections.abc import Callable
from pathlib import Path

from server.checkpoints.hold import held
from server.database.engine import Database
from server.database.migrate import revision
from server.errors import ConflictError
from server.files import FileStore
from server.keeping.archives import NamedArchive, bring, named_archives, sum_in
from server.keeping.copying import check_revision
from server.keeping.rows import shapes
from server.keeping.snapshot import exists, snapshot
from server.settings import Settings


def move_checkpoints(settings: Settings, source_url: str, target_url: str, say: Callable[[str], None]) -> None:
    """Copy the archives that the database names; both are read, and the source stays as it is.

    What has come into the source since then is copied by doing it again: what is whole in the target is not copied twice.

    Args:
        settings: of the installation; its service may run.
        source_url: directory or fsspec URL of the store that is read.
        target_url: of the one that is filled.
        say: told what was done.

    Raises:
        ConflictError: there is no installation, or no such source.
        CorruptUploadError: the target does not give back what was written.
        OSError: one of the stores can't be reached; what was copied until then stays.
    """
    if not exists(settings.resolved_database_url):
        raise ConflictError(f"There is no database in {settings.data_dir}, which would say what to copy.")
    if "://" not in source_url and not Path(source_url).is_dir():
        raise ConflictError(f"There is no folder {source_url}.")
    database = Database(settings.resolved_database_url)
    try:
        with held(settings.data_dir):
            with snapshot(database, Path(tempfile.gettempdir())) as connection:
                check_revision(revision(database), "The database")
                named = named_archives(connection, shapes(connection))
            largest = max((one.size for one in named), default=0)
            limit = max(largest, settings.max_checkpoint_bytes)
            source, target = FileStore(source_url, limit), FileStore(target_url, limit)
            there, copied, missing = _copy(source, target, named)
            target.clear_torn([one.id for one in named])
    finally:
        database.dispose()
    say(f"{copied} checkpoints were copied and compared, {there} were there already.")
    others = len(target.ids() - {one.id for one in named})
    if others:
        say(f"{others} other archives lie in {target_url}, which this database does not name: left as they are.")
    if missing:
        say(f"Not whole in {source_url}, and left out: the archives of checkpoints {', '.join(missing)}.")
    say("With the server stopped do this again, for what has come since; then name the new store in MAPLESS_FILES_URL.")


def _copy(source: FileStore, target: FileStore, named: list[NamedArchive]) -> tuple[int, int, list[str]]:
    """How many were there, how many were copied, and the ids of those that the source has no more, or not as they were."""
    there, copied, missing = 0, 0, list[str]()
    for one in named:
        found = sum_in(source, one.id)
        wanted = one.sha256 or found
        if wanted is not None and sum_in(target, one.id) == wanted:
            there += 1
        elif wanted is not None and found == wanted:
            asyncio.run(bring(target, one.id, source.read(one.id), wanted))
            copied += 1
        elif one.sha256 is not None:
            missing.append(one.id)
    return there, copied, missing

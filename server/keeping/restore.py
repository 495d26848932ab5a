"""`mapless restore`: brings back what a backup holds, after all of it was looked at and before anything is changed."""

import asyncio
import re
import time
import zipfile
from collections.abc import Callable, Iterator
from contextlib import suppress
from pathlib import Path

from pydantic import ValidationError
from sqlalchemy import Connection, insert, select, update

from server.database import tables
from server.database.engine import Database
from server.database.migrate import head, revision, tear_down
from server.database.rebuilding import rebuilding
from server.errors import ConflictError, CorruptUploadError
from server.files import FileStore
from server.keeping.archives import bring, sum_in
from server.keeping.backup import ARCHIVES, ARENAS, MANIFEST, TABLES, TOKENS, Manifest
from server.keeping.copying import check_revision, fill, holds
from server.keeping.rows import Row, Shape, row_of
from server.keeping.snapshot import in_use
from server.settings import Settings
from workers.checkpoints import sha256_of

_BLOCK = 2**20
_PART = re.compile(r"tables/[a-z0-9_]+\.jsonl|checkpoints/[0-9a-z]+\.zip|arenas/[0-9a-f]{64}\.json|token|worker-token")
# Enough for a table of any length: rows are read one by one.
_MAX_MANIFEST = 256 * 2**20


def restore(settings: Settings, path: Path, say: Callable[[str], None], *, replace: bool = False) -> None:
    """Bring an installation to the state of a backup; the database is changed in one transaction, last of all.

    Runs that were under way when the backup was made go back into the queue: a worker that still has one is cut off.

    Args:
        settings: of the installation; no server may run on it.
        path: of the backup, of this version or an older one.
        say: told what was done.
        replace: what is there is given up.

    Raises:
        CorruptUploadError: the file is no backup, or not as it was written.
        ConflictError: it is of a newer version, a server runs, or the installation is not empty; nothing was changed.
        ServiceError: a row can't be taken over; the database was not changed.
    """
    try:
        with zipfile.ZipFile(path) as archive:
            manifest = check(archive)
            _restore(settings, archive, manifest, say, replace=replace)
    except zipfile.BadZipFile as error:
        raise CorruptUploadError(f"{path} is not whole: {error}.") from error


def check(archive: zipfile.ZipFile) -> Manifest:
    """Read a backup to its end; its manifest.

    Raises:
        CorruptUploadError: it is not as it was written.
        ConflictError: it is of a newer version.
    """
    names = archive.namelist()
    if MANIFEST not in names or archive.getinfo(MANIFEST).file_size > _MAX_MANIFEST:
        raise CorruptUploadError(f"{archive.filename} is no backup of Mapless.")
    try:
        manifest = Manifest.model_validate_json(archive.read(MANIFEST))
    except ValidationError as error:
        raise CorruptUploadError(f"{archive.filename} is of another version, or no backup of Mapless.") from error
    check_revision(manifest.revision, str(archive.filename))
    expected = {MANIFEST, *manifest.parts}
    if sorted(names) != sorted(expected) or not manifest.parts.keys() >= {
        f"{TABLES}{name}.jsonl" for name in manifest.tables
    }:
        raise CorruptUploadError(f"{archive.filename} does not hold what its manifest says.")
    for name, part in manifest.parts.items():
        if not _PART.fullmatch(name) or archive.getinfo(name).file_size != part.size:
            raise CorruptUploadError(f"{name} in {archive.filename} is not what its manifest says.")
        with archive.open(name) as file:
            if sha256_of(file) != part.sha256:
                raise CorruptUploadError(f"{name} in {archive.filename} is damaged: its SHA-256 is another one.")
    return manifest


def _restore(
    settings: Settings, archive: zipfile.ZipFile, manifest: Manifest, say: Callable[[str], None], *, replace: bool
) -> None:
    database = Database(settings.resolved_database_url)
    files = FileStore(settings.resolved_files_url, max((part.size for part in manifest.parts.values()), default=1))
    try:
        found = _check_target(database, replace=replace)
        missing = _missing_archives(files, manifest, replace=replace)
        brought: list[str] = []
        try:
            asyncio.run(_bring_archives(files, archive, manifest, missing, brought))
            # Of a restore that was killed.
            files.clear_torn([_id(name) for name in manifest.parts if name.startswith(ARCHIVES)])
            _bring_files(settings, archive, manifest, replace=replace)
            with rebuilding(database) as connection:
                before = _archives(connection) if found == head() else set()
                if found:
                    tear_down(connection)
                read = fill(
                    connection,
                    manifest.revision,
                    {name: Shape(name, dict(table.columns)) for name, table in manifest.tables.items()},
                    lambda shape: _rows(archive, shape),
                    say,
                )
                _go_on_from_here(connection, manifest, before)
        except BaseException:
            # No database names them: nobody would ever remove them.
            for identifier in brought:
                # What has gone wrong first is what is told.
                with suppress(OSError):
                    files.delete(identifier)
            raise
    finally:
        database.dispose()
    say(
        f"Restored {sum(one.rows for one in read.values())} rows and {len(missing)} checkpoints, as they were on "
        f"{time.strftime('%Y-%m-%d %H:%M:%S', time.gmtime(manifest.made_at))} UTC."
    )
    _say_what_was_there(files, manifest, len(missing), say)
    if manifest.damaged:
        say(f"Marked as damaged, for the backup had no archive: checkpoints {', '.join(manifest.damaged)}.")


def _check_target(database: Database, *, replace: bool) -> str | None:
    if in_use(database):
        raise ConflictError("A server runs on this database: stop it first.")
    found = revision(database)
    if found is None:
        return None
    check_revision(found, "The database that is there")
    there = holds(database)
    if there is not None and not replace:
        raise ConflictError(f"The database is not empty ({there}): with --replace all of it is given up.")
    return found


def _missing_archives(files: FileStore, manifest: Manifest, *, replace: bool) -> dict[str, bool]:
    """The ids of archives that have to be brought into the store, and whether another one lies there under that id.

    Those that are as they should be, after a restore that broke off, need not be brought.
    """
    missing = {}
    for name, part in manifest.parts.items():
        if not name.startswith(ARCHIVES):
            continue
        identifier = _id(name)
        there = sum_in(files, identifier)
        if there == part.sha256:
            continue
        if there is not None and not replace:
            raise ConflictError(f"The store has another archive {identifier}: with --replace it is given up.")
        missing[identifier] = there is not None
    return missing


async def _bring_archives(
    files: FileStore, archive: zipfile.ZipFile, manifest: Manifest, missing: dict[str, bool], brought: list[str]
) -> None:
    for identifier, replaces in missing.items():
        name = f"{ARCHIVES}{identifier}.zip"
        if not replaces:
            brought.append(identifier)
        await bring(files, identifier, _blocks(archive, name), manifest.parts[name].sha256)


def _bring_files(settings: Settings, archive: zipfile.ZipFile, manifest: Manifest, *, replace: bool) -> None:
    for name in manifest.parts:
        if name.startswith(ARENAS):
            settings.arenas_dir.mkdir(parents=True, exist_ok=True)
            (settings.arenas_dir / name.removeprefix(ARENAS)).write_bytes(archive.read(name))
        elif name in TOKENS:
            path = settings.data_dir / name
            if replace or not path.exists():
                path.touch(0o600)
                path.write_bytes(archive.read(name))


def _rows(archive: zipfile.ZipFile, shape: Shape) -> Iterator[Row]:
    with archive.open(f"{TABLES}{shape.name}.jsonl") as file:
        for line in file:
            yield row_of(line, shape)


def _go_on_from_here(connection: Connection, manifest: Manifest, before: set[str]) -> None:
    """What is true of now, and not of when the backup was made."""
    # A worker that has gone on since then reports what this database has never heard of.
    run, job, checkpoint = tables.Run, tables.Job, tables.Checkpoint
    connection.execute(update(run).where(run.state.in_(("running", "stopping"))).values(attempt=run.attempt + 1))
    connection.execute(update(job).where(job.state == "running").values(attempt=job.attempt + 1))
    now = time.time()
    for identifier in manifest.damaged:
        whole = (checkpoint.id == identifier, checkpoint.damaged_at.is_(None))
        connection.execute(update(checkpoint).where(*whole).values(damaged_at=now))
    # What lies in the store, and only the database that was given up knew of.
    left = [{"id": identifier, "since": now, "doomed": True} for identifier in before - _archives(connection)]
    if left:
        connection.execute(insert(tables.LooseArchive), left)


def _archives(connection: Connection) -> set[str]:
    """The ids of all archives that the database has brought into the store."""
    found = set(connection.scalars(select(tables.Checkpoint.id)))
    return found | set(connection.scalars(select(tables.LooseArchive.id)))


def _say_what_was_there(files: FileStore, manifest: Manifest, brought: int, say: Callable[[str], None]) -> None:
    named = {_id(name) for name in manifest.parts if name.startswith(ARCHIVES)}
    if len(named) > brought:
        say(f"{len(named) - brought} more checkpoints lay in the store already, as the backup has them.")
    others = len(files.ids() - named)
    if others:
        say(f"{others} other archives lie in the store, which the backup does not name: left as they are.")


def _blocks(archive: zipfile.ZipFile, name: str) -> Iterator[bytes]:
    with archive.open(name) as file:
        while block := file.read(_BLOCK):
            yield block


def _id(name: str) -> str:
    return name.removeprefix(ARCHIVES).removesuffix(".zip")

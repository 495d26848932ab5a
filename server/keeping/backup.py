"""`mapless backup`: everything that can't be made again, in one file, while the service runs.

A zip: the database's rows as `tables/NAME.jsonl`, one JSON list each; every checkpoint's archive as it lies in the store;
imported arenas; the two tokens where they are kept in the data directory; and `manifest.json` with the SHA-256 of all of it.
Robots' recordings are rows like others. Recordings of evaluations and bundles are not in it: they are made again when
somebody asks.
"""

import hashlib
import os
import shutil
import time
import zipfile
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path
from typing import IO, Literal

from pydantic import BaseModel, ConfigDict
from sqlalchemy import Connection

from server.checkpoints.hold import held
from server.database.engine import Database
from server.database.migrate import revision
from server.errors import ConflictError, NotFoundError
from server.files import FileStore
from server.keeping.archives import NamedArchive, named_archives
from server.keeping.copying import check_revision
from server.keeping.rows import Kind, Shape, Sum, line_of, read_rows, shapes
from server.keeping.snapshot import exists, size, snapshot
from server.settings import Settings
from server.version import version
from workers.checkpoints import sha256_of, sync_directory

MANIFEST = "manifest.json"
TABLES, ARCHIVES, ARENAS = "tables/", "checkpoints/", "arenas/"
TOKENS = ("token", "worker-token")

_BLOCK = 2**20


class Part(BaseModel):
    """A file of the backup, in bytes and lower-case hexadecimal."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    size: int
    sha256: str


class TablePart(BaseModel):
    """A table of the backup: its columns in the order of its rows, and how many rows there are."""

    model_config = ConfigDict(frozen=True, extra="forbid")

    columns: dict[str, Kind]
    rows: int


class Manifest(BaseModel):
    """What a backup holds.

    Attributes:
        format: of the file.
        mapless: the version that wrote it.
        revision: of the database's tables.
        made_at: when the state was taken, seconds since the epoch.
        tables: by name.
        parts: every other file of the zip, by its name there.
        damaged: ids of checkpoints whose archives were gone, or were not what was registered; they are left out.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    format: Literal[1] = 1
    mapless: str
    revision: str
    made_at: float
    tables: dict[str, TablePart]
    parts: dict[str, Part]
    damaged: tuple[str, ...]


def back_up(settings: Settings, path: Path, say: Callable[[str], None]) -> Manifest:
    """Write a backup; the file appears whole or not at all, and others may not read it.

    Args:
        settings: of the installation; its service may run.
        path: of the file, which must not be there.
        say: told what was done.

    Raises:
        ConflictError: the file is there, there is no room for it, or no installation to back up.
        OSError: it can't be written.
    """
    if path.exists():
        raise ConflictError(f"{path} is there already: name another file.")
    if not exists(settings.resolved_database_url):
        raise ConflictError(f"There is no database in {settings.data_dir}: nothing to back up.")
    database = Database(settings.resolved_database_url)
    files = FileStore(settings.resolved_files_url, settings.max_checkpoint_bytes)
    torn = path.with_name(path.name + ".part")
    settings.data_dir.mkdir(parents=True, exist_ok=True)
    try:
        with held(settings.data_dir), snapshot(database, path.parent) as connection:
            found = check_revision(revision(database), "The database")
            described = shapes(connection)
            wanted = named_archives(connection, described)
            _check_room(path.parent, size(database) + sum(one.size for one in wanted))
            with zipfile.ZipFile(torn, "x", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
                manifest = _write(_Writer(archive), settings, found, connection, described, files, wanted)
        _to_disk(torn)
        torn.rename(path)
        sync_directory(path.parent)
    except BaseException:
        torn.unlink(missing_ok=True)
        raise
    finally:
        database.dispose()
    kept = sum(name.startswith(ARCHIVES) for name in manifest.parts)
    say(
        f"{path}: {sum(table.rows for table in manifest.tables.values())} rows, {kept} checkpoints, "
        f"{path.stat().st_size / 2**20:.1f} MiB."
    )
    if manifest.damaged:
        say(f"Not whole in the store, and left out: the archives of checkpoints {', '.join(manifest.damaged)}.")
    return manifest


class _Writer:
    """Adds parts to a zip, and remembers what they are."""

    def __init__(self, archive: zipfile.ZipFile) -> None:
        self._archive = archive
        self.parts: dict[str, Part] = {}

    def add(self, name: str, blocks: Iterable[bytes], *, compress: bool = True) -> Part:
        """One more part."""
        info = zipfile.ZipInfo(name, time.localtime()[:6])
        info.compress_type = zipfile.ZIP_DEFLATED if compress else zipfile.ZIP_STORED
        digest, length = hashlib.sha256(), 0
        with self._archive.open(info, "w", force_zip64=True) as file:
            for block in blocks:
                digest.update(block)
                length += len(block)
                file.write(block)
        self.parts[name] = Part(size=length, sha256=digest.hexdigest())
        return self.parts[name]

    def close(self, manifest: Manifest) -> None:
        """Write the manifest."""
        self._archive.writestr(MANIFEST, manifest.model_dump_json(indent=1))


def _write(
    writer: _Writer,
    settings: Settings,
    found: str,
    connection: Connection,
    described: Sequence[Shape],
    files: FileStore,
    wanted: Sequence[NamedArchive],
) -> Manifest:
    made_at = time.time()
    tables = {shape.name: _add_table(writer, connection, shape) for shape in described}
    damaged = [one.id for one in wanted if not _add_archive(writer, files, one) and one.sha256 is not None]
    for path in sorted(settings.arenas_dir.glob("*.json")):
        writer.add(ARENAS + path.name, [path.read_bytes()])
    for name in TOKENS:
        token = settings.data_dir / name
        if token.exists():
            writer.add(name, [token.read_bytes()])
    manifest = Manifest(
        mapless=version(), revision=found, made_at=made_at, tables=tables, parts=writer.parts, damaged=tuple(damaged)
    )
    writer.close(manifest)
    return manifest


def _add_table(writer: _Writer, connection: Connection, shape: Shape) -> TablePart:
    found = Sum()

    def lines() -> Iterator[bytes]:
        for row in read_rows(connection, shape):
            line = line_of(row)
            found.add(line)
            yield line

    writer.add(f"{TABLES}{shape.name}.jsonl", lines())
    return TablePart(columns=shape.columns, rows=found.rows)


def _add_archive(writer: _Writer, files: FileStore, wanted: NamedArchive) -> bool:
    """Whether it was whole; looked at first, for what is in a zip stays there."""
    try:
        with files.open(wanted.id) as file:
            if wanted.sha256 is not None and sha256_of(file) != wanted.sha256:
                return False
            file.seek(0)
            writer.add(f"{ARCHIVES}{wanted.id}.zip", _blocks(file), compress=False)
    except NotFoundError:
        return False
    return True


def _blocks(file: IO[bytes]) -> Iterator[bytes]:
    while block := file.read(_BLOCK):
        yield block


def _check_room(folder: Path, needed: int) -> None:
    free = shutil.disk_usage(folder).free
    if free < needed:
        raise ConflictError(f"{folder} has {free / 2**30:.1f} GiB left, and up to {needed / 2**30:.1f} GiB are needed.")


def _to_disk(path: Path) -> None:
    with path.open("rb") as file:
        os.fsync(file.fileno())

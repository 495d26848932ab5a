"""The archives that a state of the database names, and how one gets from a store to another."""

import hashlib
from collections.abc import AsyncIterator, Iterable, Sequence
from dataclasses import dataclass

from sqlalchemy import Connection, text

from server.errors import CorruptUploadError, NotFoundError
from server.files import FileStore
from server.keeping.rows import Shape
from workers.checkpoints import sha256_of


@dataclass(frozen=True)
class NamedArchive:
    """An archive that the database names.

    Attributes:
        id: of its checkpoint.
        size: in bytes, as registered; 0 where `sha256` is None.
        sha256: as registered, in lower-case hexadecimal; None of one that no checkpoint names (any more).
    """

    id: str
    size: int
    sha256: str | None


def named_archives(connection: Connection, described: Sequence[Shape]) -> list[NamedArchive]:
    """All of them, in the words of the first migrations, which all later ones have."""
    rows = connection.execute(text("SELECT id, size, sha256 FROM checkpoints ORDER BY id"))
    archives = [NamedArchive(*row) for row in rows]
    if any(shape.name == "loose_archives" for shape in described):
        # A training may begin with one whose checkpoint is gone.
        loose = connection.execute(text("SELECT id FROM loose_archives WHERE NOT doomed ORDER BY id"))
        archives += [NamedArchive(identifier, 0, None) for (identifier,) in loose]
    return archives


def sum_in(store: FileStore, identifier: str) -> str | None:
    """The SHA-256 of what a store has under an id, read to its end; None where it has nothing."""
    try:
        with store.open(identifier) as file:
            return sha256_of(file)
    except NotFoundError:
        return None


async def bring(store: FileStore, identifier: str, blocks: Iterable[bytes], sha256: str | None) -> None:
    """Write an archive into a store, and read it again.

    Args:
        store: where to.
        identifier: of the archive.
        blocks: its bytes.
        sha256: as registered; None where nobody knows it.

    Raises:
        CorruptUploadError: what was read, or what the store gives back, is something else; it is not in the store then.
        OSError: one of the stores can't be reached.
    """
    digest = hashlib.sha256()

    async def stream() -> AsyncIterator[bytes]:
        for block in blocks:
            digest.update(block)
            yield block

    await store.write(identifier, stream(), sha256)
    if sum_in(store, identifier) != digest.hexdigest():
        store.delete(identifier)
        raise CorruptUploadError(f"The store does not give back the archive {identifier} as it was written.")

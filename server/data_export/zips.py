"""Several files in one, made while it is sent."""

from collections.abc import Iterable, Iterator
from zipfile import ZIP_DEFLATED, ZipFile

from server.data_export.outbox import Outbox

# The fastest: it halves numbers, and slower levels save little more.
_LEVEL = 1


def zipped(files: Iterable[tuple[str, Iterable[bytes]]]) -> Iterator[bytes]:
    """A zip archive of named files, block by block; no file is held whole."""
    outbox = Outbox()
    with ZipFile(outbox, "w", ZIP_DEFLATED, compresslevel=_LEVEL) as archive:
        for name, blocks in files:
            with archive.open(name, "w", force_zip64=True) as file:
                for block in blocks:
                    file.write(block)
                    yield outbox.taken()
    yield outbox.taken()

"""Several files in one, made while it is sent."""

from collections.abc import Iterable, Iterator
from zipfile import ZIP_DEFLATED, ZipFile

# The fastest: it halves numbers, and slower levels save little more.
_LEVEL = 1


def zipped(files: Iterable[tuple[str, Iterable[bytes]]]) -> Iterator[bytes]:
    """A zip archive of named files, block by block; no file is held whole."""
    outbox = _Outbox()
    with ZipFile(outbox, "w", ZIP_DEFLATED, compresslevel=_LEVEL) as archive:
        for name, blocks in files:
            with archive.open(name, "w", force_zip64=True) as file:
                for block in blocks:
                    file.write(block)
                    yield outbox.taken()
    yield outbox.taken()


class _Outbox:
    """What `ZipFile` writes to where it can't go back."""

    def __init__(self) -> None:
        self._written = bytearray()

    def write(self, data: bytes) -> int:
        """Keep it until it is taken."""
        self._written += data
        return len(data)

    def flush(self) -> None:
        """Nothing waits."""

    def close(self) -> None:
        """Nothing is open."""

    def taken(self) -> bytes:
        """What was written since the last time."""
        data = bytes(self._written)
        self._written.clear()
        return data

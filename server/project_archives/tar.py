"""A tar file that is made while it is sent, and read while it arrives: nothing of it is held but one block."""

import tarfile
from collections.abc import AsyncIterator, Iterable, Iterator

from server.errors import InvalidRequestError

_BLOCK = tarfile.BLOCKSIZE


def member(name: str, size: int, blocks: Iterable[bytes]) -> Iterator[bytes]:
    """A file of an archive: exactly `size` bytes must come.

    Raises:
        ValueError: the name is too long, or more or fewer bytes came.
    """
    header = tarfile.TarInfo(name)
    header.size = size
    yield header.tobuf(tarfile.USTAR_FORMAT)
    sent = 0
    for block in blocks:
        sent += len(block)
        yield block
    if sent != size:
        raise ValueError(f"{name} has {sent} bytes, not {size}")
    yield bytes(-size % _BLOCK)


def end() -> bytes:
    """What stands behind the last file."""
    return bytes(2 * _BLOCK)


class IncomingTar:
    """The files of an archive, one after another as they arrive.

    Args:
        stream: the archive's bytes.
    """

    def __init__(self, stream: AsyncIterator[bytes]) -> None:
        self._stream = stream
        self._rest = b""
        self._unread = 0

    async def next(self) -> str | None:
        """The next file's name, whatever is left of the one before; None behind the last.

        Raises:
            InvalidRequestError: it is no such archive, or has no end.
        """
        async for _ in self.blocks():
            pass
        header = await self._take(_BLOCK)
        if not any(header):
            return None
        try:
            found = tarfile.TarInfo.frombuf(header, "utf-8", "strict")
        except (tarfile.HeaderError, UnicodeDecodeError) as error:
            raise InvalidRequestError(f"This is no project's archive, or it is damaged: {error}") from error
        if not found.isreg() or found.size < 0:
            raise InvalidRequestError(f"This is no project's archive: {found.name} is no plain file.")
        self.size = found.size
        self._unread = found.size + -found.size % _BLOCK
        self._padding = -found.size % _BLOCK
        return found.name

    async def blocks(self) -> AsyncIterator[bytes]:
        """What is left of this file.

        Raises:
            InvalidRequestError: the archive ends before.
        """
        while self._unread > 0:
            block = self._rest or await self._more()
            taken, self._rest = block[: self._unread], block[self._unread :]
            content = len(taken) - max(0, self._padding - (self._unread - len(taken)))
            self._unread -= len(taken)
            if content > 0:
                yield taken[:content]

    async def whole(self, most: int) -> bytes:
        """All of this file.

        Raises:
            InvalidRequestError: it is larger than `most` bytes, or the archive ends before.
        """
        if self.size > most:
            raise InvalidRequestError(f"This is no project's archive: a part of it is larger than {most} bytes.")
        return b"".join([block async for block in self.blocks()])

    async def _take(self, count: int) -> bytes:
        while len(self._rest) < count:
            self._rest += await self._more()
        taken, self._rest = self._rest[:count], self._rest[count:]
        return taken

    async def _more(self) -> bytes:
        async for block in self._stream:
            if block:
                return block
        raise InvalidRequestError("The archive ends too early: what it holds of the last run is not taken.")

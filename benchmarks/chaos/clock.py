"""`python -m benchmarks.chaos.clock FILE serve`: the server by a clock that FILE puts forward or back while it runs.

Only what the clock says changes (`time.time`); the monotonic clock goes on, as it does where an administrator or a time
server sets the hour.
"""

import mmap
import struct
import sys
import time
from pathlib import Path

_OFFSET = struct.Struct("<d")


class Clock:
    """The offset in a file that a server and whoever sets its clock share, in seconds."""

    def __init__(self, path: Path) -> None:
        if not path.exists():
            path.write_bytes(_OFFSET.pack(0.0))
        with path.open("r+b") as file:
            self._memory = mmap.mmap(file.fileno(), _OFFSET.size)

    @property
    def offset(self) -> float:
        """How far the server's clock is ahead of this machine's."""
        (seconds,) = _OFFSET.unpack(self._memory[:])
        return float(seconds)

    def shift(self, seconds: float) -> None:
        """Put the clock forward, or back by less than zero."""
        self._memory[:] = _OFFSET.pack(self.offset + seconds)


def main() -> None:
    """Put the clock in place before anything else is imported, then do what the arguments say."""
    clock, now = Clock(Path(sys.argv.pop(1))), time.time
    time.time = lambda: now() + clock.offset
    from server.cli import main as mapless

    mapless()


if __name__ == "__main__":
    main()

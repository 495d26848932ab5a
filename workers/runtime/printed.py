"""What a process prints: on into the log line by line, and the last of it kept to explain its end with."""

import logging
import threading
from collections import deque
from collections.abc import Callable
from typing import IO

_LINES = 15


class Printed:
    """Reads on a thread until the process, and whatever it has started, has closed its output.

    Args:
        stream: the output, in bytes.
        log: where the lines go on to.
        who: begins each line there, as "trainer 17".
    """

    def __init__(self, stream: IO[bytes], log: logging.Logger, who: str) -> None:
        self.on_line: Callable[[str], None] | None = None
        self._stream = stream
        self._log = log
        self._who = who
        self._last: deque[str] = deque(maxlen=_LINES)
        self._thread = threading.Thread(target=self._read, name=f"output of {who}", daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Hear the last of it."""
        self._thread.join()
        self._stream.close()

    def explains(self, how: str) -> str:
        """How the process ended, and what it printed last; call it after `close`."""
        last = "\n".join(self._last)
        return how + (f" It printed last:\n{last}" if last else "")

    def _read(self) -> None:
        for line in self._stream:
            text = line.decode(errors="replace").replace("\0", "").rstrip()
            self._last.append(text)
            if self.on_line is not None:
                self.on_line(text)
            self._log.info("%s: %s", self._who, text)

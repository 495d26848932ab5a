"""What a trainer prints, on its way to the run's log: in batches, and never more than a trainer's own work can bear."""

import logging
import threading
import time
from collections import deque

from workers.errors import RequestRefusedError, RunRefusedError, ServerUnavailableError
from workers.protocol import MAX_LOG_LINE, MAX_LOG_LINES, LogBatch, LogLine
from workers.runtime.client import ServerClient

logger = logging.getLogger(__name__)

# Between two batches: so long are lines that a killed worker takes with it.
_PAUSE_SECONDS = 1.0
_LAST_PAUSE_SECONDS = 30.0
# That wait while the server is away; of a trainer that prints without end the newest are kept.
_WAITING_LINES = 2_000
_CLOSE_SECONDS = 3.0


class Output:
    """The printed lines of an attempt and the thread that sends them. Lines that were dropped leave a gap in the numbers."""

    def __init__(self, client: ServerClient, run_id: str, attempt: int) -> None:
        self._client = client
        self._run_id = run_id
        self._attempt = attempt
        self._lock = threading.Lock()
        self._waiting: deque[LogLine] = deque(maxlen=_WAITING_LINES)
        self._printed = 0
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self._run, name=f"output {run_id}", daemon=True)
        self._thread.start()

    def line(self, text: str) -> None:
        """The trainer has printed a line."""
        with self._lock:
            self._printed += 1
            self._waiting.append(LogLine(at=time.time(), text=text[:MAX_LOG_LINE]))

    def close(self) -> None:
        """Send what waits, if that is soon done."""
        self._ending.set()
        self._thread.join(_CLOSE_SECONDS)

    def _run(self) -> None:
        pause = _PAUSE_SECONDS
        while True:
            ending = self._ending.wait(pause)
            try:
                self._send()
                pause = _PAUSE_SECONDS
            except ServerUnavailableError:
                pause = min(2 * pause, _LAST_PAUSE_SECONDS)
            except (RunRefusedError, RequestRefusedError) as refusal:
                logger.info("run %s: its log takes no more of attempt %d: %s", self._run_id, self._attempt, refusal)
                return
            if ending:
                return

    def _send(self) -> None:
        while True:
            with self._lock:
                lines = list(self._waiting)[:MAX_LOG_LINES]
                first = self._printed - len(self._waiting) + 1
            if not lines:
                return
            self._client.log(self._run_id, self._attempt, LogBatch(first=first, lines=tuple(lines)))
            with self._lock:
                # While it was sent, the oldest may have made room for new ones.
                sent = first + len(lines) - 1
                while self._waiting and self._printed - len(self._waiting) + 1 <= sent:
                    self._waiting.popleft()

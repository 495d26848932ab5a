"""Whether the server answers, as a worker's log tells it: once that it does not, and once that it does again."""

import logging
import threading

logger = logging.getLogger(__name__)


class ServerSight:
    """What threads of one process know of their server. Thread-safe.

    Args:
        server_url: of the server, for people.
    """

    def __init__(self, server_url: str) -> None:
        self._server_url = server_url
        self._lock = threading.Lock()
        self._answers = True

    def lost(self, error: Exception) -> None:
        """It did not answer."""
        with self._lock:
            before, self._answers = self._answers, False
        if before:
            logger.warning("Waiting for the server at %s: %s", self._server_url, error)

    def found(self) -> None:
        """It answered."""
        with self._lock:
            before, self._answers = self._answers, True
        if not before:
            logger.info("The server at %s answers again.", self._server_url)

"""The real doorbell: a Celery message for a run that waits, published from a thread so that nobody waits for a broker."""

import logging
import queue
import sqlite3
import threading
from contextlib import closing

from sqlalchemy import make_url

from workers.protocol import Queue
from workers.runtime.app import TRAIN_TASK, create_app

logger = logging.getLogger(__name__)

# At shutdown: time for the last messages; what is lost is rung again at the next start.
_CLOSE_SECONDS = 2.0


class CeleryDoorbell:
    """Rings through a Celery broker. A broker that is away costs a log line: the sweeper rings again."""

    def __init__(self, broker_url: str, queue_prefix: str) -> None:
        self._app = create_app(broker_url)
        self._prefix = queue_prefix
        self._rings: queue.SimpleQueue[tuple[str, int, Queue] | None] = queue.SimpleQueue()
        self._thread = threading.Thread(target=self._publish, name="doorbell", daemon=True)
        self._thread.start()

    def ring(self, run_id: str, attempt: int, queue: Queue) -> None:
        """Say that a run waits at this attempt, from any thread."""
        self._rings.put((run_id, attempt, queue))

    def close(self) -> None:
        """Publish what is pending, and end the thread."""
        self._rings.put(None)
        self._thread.join(_CLOSE_SECONDS)
        self._app.close()

    def _publish(self) -> None:
        while (ring := self._rings.get()) is not None:
            run_id, attempt, to = ring
            try:
                self._app.send_task(TRAIN_TASK, (run_id, attempt), queue=self._prefix + to, retry=False, ignore_result=True)
            except Exception as error:  # whatever a broker's driver raises: nobody's request may fail of it
                logger.warning("the broker does not take the message for run %s: %s", run_id, error)


def prepare_broker(broker_url: str, queue_prefix: str) -> None:
    """Make the embedded broker's file ready: its tables must exist before workers race to create them.

    Other brokers need nothing.
    """
    if not broker_url.startswith("sqla+sqlite"):
        return
    with create_app(broker_url).connection_for_write() as connection:
        for name in ("cpu", "gpu"):
            # A queue's size is asked for; finding out creates the tables and the queue.
            connection.default_channel._size(queue_prefix + name)  # noqa: SLF001 (kombu's virtual channels have no public way)
    path = make_url(broker_url.removeprefix("sqla+")).database
    assert path is not None
    with closing(sqlite3.connect(path)) as database, database:
        database.execute("PRAGMA journal_mode=WAL")
        # kombu only marks what has been delivered.
        database.execute("DELETE FROM kombu_message WHERE NOT visible")

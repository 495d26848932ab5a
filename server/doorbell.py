"""The real doorbell: a Celery message for a run that waits, published from a thread so that nobody waits for a broker."""

import queue
import sqlite3
import threading
from collections.abc import Callable
from contextlib import closing
from functools import partial

from sqlalchemy import make_url

from server.outage import Outage
from workers.protocol import Queue
from workers.runtime.app import TRAIN_TASK, create_app

# At shutdown: time for the last messages; what is lost is rung again at the next start.
_CLOSE_SECONDS = 2.0


class CeleryDoorbell:
    """Rings through a Celery broker. One that is away costs a log line, and is asked now and then whether it is back.

    What should have rung meanwhile is dropped: the sweeper rings again.
    """

    def __init__(self, broker_url: str, queue_prefix: str) -> None:
        self._app = create_app(broker_url)
        self._prefix = queue_prefix
        self._outage = Outage(f"The broker {self._app.connection_for_write().as_uri()}")
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
        while True:
            try:
                ring = self._rings.get(timeout=self._outage.until_next)
            except queue.Empty:
                if self._outage.may_ask():
                    self._try(self._look)
                continue
            if ring is None:
                return
            if self._outage.may_ask():
                self._try(partial(self._send, *ring))

    def _try(self, do: Callable[[], object]) -> None:
        try:
            do()
        except Exception as error:  # whatever a broker's driver raises: nobody's request may fail of it
            self._outage.gone(str(error) or type(error).__name__)
        else:
            self._outage.back()

    def _send(self, run_id: str, attempt: int, to: Queue) -> None:
        self._app.send_task(TRAIN_TASK, (run_id, attempt), queue=self._prefix + to, retry=False, ignore_result=True)

    def _look(self) -> None:
        with self._app.connection_for_write() as connection:
            connection.ensure_connection(max_retries=1, interval_start=0)


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

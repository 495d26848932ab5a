"""Checkpoints on their way to the server: one after another, in a thread, each only after the metrics that precede it."""

import logging
import threading
from collections import deque
from dataclasses import dataclass
from pathlib import Path

from workers.errors import RequestRefusedError, RunRefusedError, ServerUnavailableError
from workers.reporting import EvaluationResult
from workers.runtime.client import ServerClient
from workers.runtime.spool import Spool

logger = logging.getLogger(__name__)

_FIRST_RETRY_SECONDS = 0.5
_LAST_RETRY_SECONDS = 5.0


@dataclass(frozen=True)
class _Upload:
    step: int
    archive: Path
    after_seq: int
    evaluation: EvaluationResult | None


class Uploads:
    """The queue of an attempt's checkpoints and the thread that brings them up; archives that the server has are removed."""

    def __init__(self, client: ServerClient, run_id: str, attempt: int, spool: Spool) -> None:
        self._client = client
        self._run_id = run_id
        self._attempt = attempt
        self._spool = spool
        self._condition = threading.Condition()
        self._queue: deque[_Upload] = deque()
        self._closed = False
        self._last_seq: int | None = None
        self._refusal: str | None = None
        self._fault: str | None = None
        self._thread = threading.Thread(target=self._run, name=f"uploads {run_id}", daemon=True)
        self._thread.start()

    @property
    def refusal(self) -> str | None:
        """Why the server will never take a checkpoint of this attempt; None while all is well."""
        return self._refusal

    @property
    def fault(self) -> str | None:
        """Why this machine cannot bring a checkpoint up; None while all is well."""
        return self._fault

    @property
    def idle(self) -> bool:
        """Whether everything is up, or the server has refused it."""
        with self._condition:
            return not self._queue or self._closed

    def put(self, step: int, archive: Path, evaluation: EvaluationResult | None) -> None:
        """Bring this archive up once everything that is in the spool by now has been acknowledged."""
        with self._condition:
            self._queue.append(_Upload(step, archive, self._spool.last_seq, evaluation))
            self._drop_hopeless()
            self._condition.notify()

    def drop_beyond(self, seq: int) -> None:
        """No item after `seq` will ever be acknowledged: what waits for one, now or later, does so in vain."""
        with self._condition:
            self._last_seq = seq
            self._drop_hopeless()
            self._condition.notify()

    def notify(self) -> None:
        """The server has acknowledged more."""
        with self._condition:
            self._condition.notify()

    def close(self) -> None:
        """Give up what is still waiting, and end the thread."""
        with self._condition:
            self._closed = True
            self._condition.notify()
        self._thread.join()

    def _run(self) -> None:
        retry = _FIRST_RETRY_SECONDS
        while (upload := self._next()) is not None:
            try:
                self._client.upload(
                    self._run_id, self._attempt, upload.step, upload.archive, upload.after_seq, upload.evaluation
                )
            except ServerUnavailableError as error:
                logger.warning("checkpoint at step %d waits: %s", upload.step, error)
                with self._condition:
                    self._condition.wait_for(lambda: self._closed, retry)
                retry = min(2 * retry, _LAST_RETRY_SECONDS)
                continue
            except RunRefusedError:
                self._end()  # fenced: the link hears of it too
            except RequestRefusedError as error:
                self._end(refusal=f"A checkpoint could not be brought to the server: {error}")
            except OSError as error:
                self._end(fault=f"A checkpoint could not be read: {error}")
            retry = _FIRST_RETRY_SECONDS
            upload.archive.unlink(missing_ok=True)
            with self._condition:
                self._queue.popleft()

    def _next(self) -> _Upload | None:
        """The oldest upload, once its metrics are there; None when closed."""
        with self._condition:
            self._condition.wait_for(lambda: self._closed or (self._queue and self._queue[0].after_seq <= self._spool.acked))
            return None if self._closed else self._queue[0]

    def _drop_hopeless(self) -> None:
        while self._last_seq is not None and self._queue and self._queue[-1].after_seq > self._last_seq:
            self._queue.pop().archive.unlink(missing_ok=True)

    def _end(self, *, refusal: str | None = None, fault: str | None = None) -> None:
        with self._condition:
            self._refusal, self._fault = refusal, fault
            self._closed = True

"""What a worker does where the machine or the server's store fails it: it waits, or says what is wrong."""

import hashlib
import sys
import threading
from collections.abc import Iterator
from http import HTTPStatus
from pathlib import Path

import pytest
from websockets.datastructures import Headers
from websockets.http11 import Request, Response
from websockets.sync.server import Server, ServerConnection, serve

from tests.workers.test_link import until
from workers.config import TrainingConfig
from workers.protocol import Batch, CheckpointReference, Claim, Final, Orders
from workers.runtime import attempt, slot
from workers.runtime.attempt import Attempt
from workers.runtime.client import ServerClient
from workers.runtime.settings import WorkerSettings
from workers.runtime.slot import Slot

STORED = b"the archive as it was uploaded"


class Service:
    """Hands out a damaged checkpoint or none, and keeps the last word of the attempt that asked for it."""

    def __init__(self) -> None:
        self.status = HTTPStatus.OK
        self.downloads = 0
        self.stop = False
        self.final: Final | None = None
        self._server: Server = serve(self._handle, "127.0.0.1", 0, process_request=self._answer)
        threading.Thread(target=self._server.serve_forever, daemon=True).start()
        self.url = f"http://127.0.0.1:{self._server.socket.getsockname()[1]}"

    def close(self) -> None:
        self._server.shutdown()

    def _answer(self, _: ServerConnection, request: Request) -> Response | None:
        if "/checkpoints/" not in request.path:
            return None
        self.downloads += 1
        damaged = STORED[:-1]
        head = Headers({"Content-Length": str(len(damaged)), "Connection": "close"})
        return Response(self.status, self.status.phrase, head, damaged)

    def _handle(self, link: ServerConnection) -> None:
        link.send(Orders(ack=0, stop=self.stop).model_dump_json())
        for message in link:
            self.final = Batch.model_validate_json(message).final or self.final
            link.send(Orders(ack=0, stop=self.stop, over=self.final is not None).model_dump_json())


class NoTrainer:
    """Stands where a trainer would: none of these attempts comes to train."""

    def close(self) -> None: ...


@pytest.fixture
def service() -> Iterator[Service]:
    service = Service()
    yield service
    service.close()


def settings_for(url: str, directory: Path) -> WorkerSettings:
    return WorkerSettings.model_validate(
        {"server_url": url, "broker_url": "memory://", "worker_token": "secret", "work_dir": directory}
    )


@pytest.fixture
def resumed(service: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Attempt]:
    """An attempt that is to go on from the service's checkpoint."""
    monkeypatch.setattr(attempt, "_RETRY_SECONDS", 0.05)
    claim = Claim(
        attempt=2,
        seed=0,
        training=TrainingConfig(),
        last_seq=0,
        checkpoint=CheckpointReference(id="c", step=81_920, sha256=hashlib.sha256(STORED).hexdigest()),
        lease_seconds=15.0,
    )
    with ServerClient(service.url, "secret") as client:
        yield Attempt(settings_for(service.url, tmp_path), client, "r", claim, tmp_path / "attempt", lambda: False)


def last_word(resumed: Attempt, service: Service) -> Final:
    """What the attempt tells the server in the end, which must come soon."""
    threading.Thread(target=resumed.run, args=(NoTrainer(),), daemon=True).start()
    until(lambda: service.final is not None)
    assert service.final is not None
    return service.final


def test_a_checkpoint_that_stays_damaged_fails_the_run_with_that_reason(resumed: Attempt, service: Service) -> None:
    final = last_word(resumed, service)
    assert final.outcome == "failed"
    assert "checkpoint of step 81,920 is not what was stored there" in (final.error or "")
    # It may have been damaged on its way: it was asked for again.
    assert service.downloads == 3


def test_who_waits_for_a_store_that_does_not_answer_listens_to_stop(resumed: Attempt, service: Service) -> None:
    service.status, service.stop = HTTPStatus.SERVICE_UNAVAILABLE, True
    assert last_word(resumed, service).outcome == "stopped"


def test_a_slot_gets_over_a_machine_that_can_start_no_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(slot, "_FIRST_RETRY_SECONDS", 0.05)
    monkeypatch.setattr(sys, "executable", str(tmp_path / "no-python"))
    place = Slot(settings_for("http://127.0.0.1:9", tmp_path), 0, lambda: False)
    try:
        until(lambda: "no trainer can be started" in caplog.text)
        monkeypatch.undo()
        taken = threading.Event()

        def take() -> None:
            place.take_trainer().close()
            taken.set()

        threading.Thread(target=take, daemon=True).start()
        assert taken.wait(10.0)
    finally:
        place.close()

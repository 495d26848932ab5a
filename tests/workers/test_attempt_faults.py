"""What a worker does where the machine or the server's store fails it: it waits, or says what is wrong."""

import hashlib
import os
import resource
import signal
import stat
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import closing
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import pytest
from websockets.datastructures import Headers
from websockets.http11 import Request, Response
from websockets.sync.server import Server, ServerConnection, serve

from tests.workers.test_link import until
from workers.config import TrainingConfig
from workers.errors import UnfitError
from workers.protocol import Batch, CheckpointReference, Claim, ClaimRequest, Final, Orders
from workers.runtime import attempt, fitness, slot, tasks
from workers.runtime.attempt import Attempt
from workers.runtime.client import ServerClient
from workers.runtime.fitness import Fitness, make_private
from workers.runtime.nursery_keeper import NurseryKeeper
from workers.runtime.settings import WorkerSettings
from workers.runtime.sight import ServerSight
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
        if "/checkpoints/" not in request.path and not request.path.endswith("/start"):
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


def settings_for(url: str, directory: Path, **more: object) -> WorkerSettings:
    return WorkerSettings.model_validate(
        {"server_url": url, "broker_url": "memory://", "worker_token": "secret", "work_dir": directory, **more}
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


@pytest.fixture
def begun(service: Service, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Attempt]:
    """An attempt that is to begin with a policy that the service has."""
    monkeypatch.setattr(attempt, "_RETRY_SECONDS", 0.05)
    start = hashlib.sha256(STORED).hexdigest()
    claim = Claim(attempt=1, seed=0, training=TrainingConfig(), last_seq=0, checkpoint=None, start=start, lease_seconds=15.0)
    with ServerClient(service.url, "secret") as client:
        yield Attempt(settings_for(service.url, tmp_path), client, "r", claim, tmp_path / "attempt", lambda: False)


def last_word(resumed: Attempt, service: Service) -> Final:
    """What the attempt tells the server in the end, which must come soon."""
    threading.Thread(target=resumed.run, args=(NoTrainer(),), daemon=True).start()
    until(lambda: service.final is not None)
    assert service.final is not None
    return service.final


def test_a_checkpoint_that_stays_damaged_is_said_to_be(resumed: Attempt, service: Service) -> None:
    final = last_word(resumed, service)
    assert final.outcome == "damaged"
    assert "checkpoint of step 81\u202f920 is not what was stored there" in (final.error or "")
    # It may have been damaged on its way: it was asked for again.
    assert service.downloads == 3


def test_a_checkpoint_that_is_gone_is_asked_for_once(resumed: Attempt, service: Service) -> None:
    service.status = HTTPStatus.NOT_FOUND
    final = last_word(resumed, service)
    assert final.outcome == "damaged"
    assert "checkpoint of step 81\u202f920 is gone" in (final.error or "")
    assert service.downloads == 1


@pytest.mark.parametrize(
    ("status", "words"), [(HTTPStatus.OK, "is not what was stored there"), (HTTPStatus.NOT_FOUND, "is gone")]
)
def test_where_the_policy_to_start_from_cannot_be_had_the_run_fails_and_says_so(
    begun: Attempt, service: Service, status: HTTPStatus, words: str
) -> None:
    """There is no older one to fall back to, and fresh weights are not what was asked for."""
    service.status = status
    final = last_word(begun, service)
    assert final.outcome == "failed"
    assert f"the policy to start from {words}" in (final.error or "")


def test_who_waits_for_a_store_that_does_not_answer_listens_to_stop(resumed: Attempt, service: Service) -> None:
    service.status, service.stop = HTTPStatus.SERVICE_UNAVAILABLE, True
    assert last_word(resumed, service).outcome == "stopped"


class Place:
    """A slot on a machine whose state a test decides."""

    def __init__(self, directory: Path, door: int, **settings: object) -> None:
        self.slot = Slot(settings_for("http://127.0.0.1:9", directory, **settings), 0, lambda: False, door)

    def taken(self) -> bool:
        """Whether a trainer could be had; it is put back."""
        try:
            self.slot.give_back(self.slot.take_trainer())
        except UnfitError:
            return False
        return True


@pytest.fixture
def places(nursery_door: int) -> Iterator[Callable[..., Place]]:
    opened: list[Place] = []

    def open_place(directory: Path, door: int = nursery_door, **settings: object) -> Place:
        opened.append(Place(directory, door, **settings))
        return opened[-1]

    yield open_place
    for place in opened:
        place.slot.close()


def test_a_slot_gets_over_a_machine_that_can_start_no_process(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, places: Callable[..., Place]
) -> None:
    monkeypatch.setattr(slot, "_FIRST_RETRY_SECONDS", 0.05)
    monkeypatch.setattr(sys, "executable", str(tmp_path / "no-python"))
    with closing(NurseryKeeper()) as keeper:
        keeper.keep_running()
        place = places(tmp_path, keeper.door)
        # No run is claimed meanwhile: who waits for a trainer with a run in hand keeps it from others.
        with pytest.raises(UnfitError, match=r"no trainer is ready\. No process can be started"):
            place.slot.take_trainer()
        assert "No process can be started" in (place.slot.trouble or "")
        monkeypatch.undo()
        until(place.taken, 60.0)
        until(lambda: place.slot.trouble is None)


def test_a_slot_whose_trainers_die_while_they_start_takes_no_run_and_says_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, places: Callable[..., Place]
) -> None:
    dying = tmp_path / "python"
    dying.write_text("#!/bin/sh\necho no such library\nexit 3\n")
    dying.chmod(0o755)
    monkeypatch.setattr(sys, "executable", str(dying))
    with closing(NurseryKeeper()) as keeper:
        keeper.keep_running()
        place = places(tmp_path, keeper.door)
        with pytest.raises(UnfitError, match=r"ended with status 3\. It printed last:\nno such library"):
            place.slot.take_trainer()


@pytest.fixture
def many_files() -> Iterator[None]:
    """As many open files as a descriptor of one more is beyond what `select` can wait for."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, min(hard, 4096)), hard))
    descriptors = [os.open(os.devnull, os.O_RDONLY)]
    while descriptors[-1] < 1100:
        descriptors.append(os.dup(descriptors[0]))
    yield
    for descriptor in descriptors:
        os.close(descriptor)
    resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


@pytest.mark.usefixtures("many_files")
def test_a_worker_with_many_open_files_hears_why_no_trainer_starts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, places: Callable[..., Place]
) -> None:
    monkeypatch.setattr(sys, "executable", str(tmp_path / "no-python"))
    with closing(NurseryKeeper()) as keeper:
        assert keeper.door > 1024
        keeper.keep_running()
        place = places(tmp_path, keeper.door)
        with pytest.raises(UnfitError, match="No process can be started"):
            place.slot.take_trainer()


def test_a_worker_that_is_told_to_end_does_not_say_that_it_takes_up_no_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture, nursery_door: int
) -> None:
    place = Slot(settings_for("http://127.0.0.1:9", tmp_path), 0, lambda: True, nursery_door)
    monkeypatch.setattr(tasks, "_slot", place)
    before = signal.getsignal(signal.SIGTERM)
    try:
        tasks._train("r" * 32, 0)
    finally:
        signal.signal(signal.SIGTERM, before)
        place.close()
    assert "takes up no run" not in caplog.text


def test_that_the_server_is_away_is_said_once_for_all_threads(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level("INFO", "workers")
    sight = ServerSight("http://this.server")
    for _ in range(6):
        sight.lost(ConnectionError("nobody there"))
    sight.found()
    sight.found()
    # Threads of other tests may still look for a server of theirs.
    assert [message for message in caplog.messages if "this.server" in message] == [
        "Waiting for the server at http://this.server: nobody there",
        "The server at http://this.server answers again.",
    ]


def test_a_worker_without_room_takes_no_run_and_says_how_much_is_missing(
    tmp_path: Path, places: Callable[..., Place]
) -> None:
    place = places(tmp_path, min_free_bytes=2**60)
    with pytest.raises(
        UnfitError,
        match="MiB free, less than 1\u202f099\u202f511\u202f627\u202f776",
    ):
        place.slot.take_trainer()
    assert "MAPLESS_WORK_DIR" in (place.slot.trouble or "")


def test_a_worker_whose_folder_is_gone_takes_no_run(tmp_path: Path, places: Callable[..., Place]) -> None:
    place = places(tmp_path / "unmounted")
    with pytest.raises(UnfitError, match="can't be written to"):
        place.slot.take_trainer()
    (tmp_path / "unmounted").mkdir()
    until(place.taken, 30.0)


def test_from_fault_to_fault_a_worker_rests_longer_until_an_attempt_goes_well(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    monkeypatch.setattr(fitness, "_FIRST_REST_SECONDS", 0.5)
    machine = Fitness(tmp_path, 0)
    rests: list[float] = []

    def rest() -> None:
        started = time.monotonic()
        machine.rest("the disk is full", lambda: False)
        rests.append(time.monotonic() - started)

    for _ in range(3):
        rest()
    machine.well()
    rest()
    assert rests[0] < rests[1] < rests[2] > rests[3]
    assert "takes up no run for 2 s: the disk is full" in caplog.text
    machine.rest("the disk is full", lambda: True)  # a worker that is to end does not rest first
    assert machine.trouble is None


def test_other_users_can_neither_read_nor_exchange_what_a_run_keeps(tmp_path: Path) -> None:
    mine = tmp_path / "cache" / "work"
    make_private(mine)
    assert stat.S_IMODE(mine.stat().st_mode) == 0o700
    shared = tmp_path / "shared"
    shared.mkdir()
    shared.chmod(0o777)
    with pytest.raises(UnfitError, match="Other users of this machine can exchange"):
        make_private(shared)
    shared.chmod(0o1777)  # as the system's temporary folder: what is in it stays its owner's
    make_private(shared)


def test_an_attempts_folder_is_its_owners_alone(resumed: Attempt, tmp_path: Path) -> None:
    assert stat.S_IMODE((tmp_path / "attempt").stat().st_mode) == 0o700
    resumed.run(NoTrainer())  # type: ignore[arg-type] # none comes to train


def test_a_claim_whose_answer_got_lost_is_asked_for_again_as_the_same(tmp_path: Path, nursery_door: int) -> None:
    asked: list[ClaimRequest] = []
    granted = Claim(
        attempt=1, seed=0, training=TrainingConfig(), last_seq=0, checkpoint=None, lease_seconds=15.0
    ).model_dump_json()

    class Answers(BaseHTTPRequestHandler):
        def do_POST(self) -> None:
            body = self.rfile.read(int(self.headers["Content-Length"]))
            if self.path.endswith("/claim"):
                asked.append(ClaimRequest.model_validate_json(body))
                if len(asked) < 3:
                    self.close_connection = True  # the run is granted, and nobody hears of it
                    return
            self.send_response(200)
            self.send_header("Content-Length", str(len(granted)))
            self.end_headers()
            self.wfile.write(granted.encode())

        def log_message(self, *_: object) -> None: ...

    with ThreadingHTTPServer(("127.0.0.1", 0), Answers) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        place = Slot(settings_for(f"http://127.0.0.1:{server.server_address[1]}", tmp_path), 0, lambda: False, nursery_door)
        try:
            claim = tasks._claim(place, "r", 0)
        finally:
            place.close()
            server.shutdown()
    assert claim is not None
    assert len(asked) == 3
    assert len({request.claim_id for request in asked}) == 1
    assert asked[0].claim_id is not None

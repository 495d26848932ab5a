"""The link brings everything to a server that comes and goes, in order, and hears what the server wants."""

import logging
import threading
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed
from websockets.sync.server import Server, ServerConnection, serve

from workers.protocol import CLOSE_FENCED, CLOSE_NOT_UNDERSTOOD, Batch, Final, Orders, Refusal
from workers.reporting import WatchRequest
from workers.runtime.link import Link
from workers.runtime.spool import Spool

LEASE = 0.6


class Peer:
    """A server's end of the link: stores what comes, and answers as it is told to."""

    def __init__(self) -> None:
        self.stored: list[int] = []
        self.frames: list[bytes] = []
        self.batches: list[Batch] = []
        self.paths: list[str] = []
        self.connection: ServerConnection | None = None
        self.deaf = threading.Event()
        self.seconds_per_frame = 0.0
        self.fence = threading.Event()
        self.unable = threading.Event()
        self.unstorable: int | None = None
        self.puzzled = False
        self._server: Server | None = None
        self.port = 0

    @property
    def ack(self) -> int:
        return max(self.stored, default=0)

    def start(self) -> None:
        self._server = serve(self._handle, "127.0.0.1", self.port)
        self.port = self._server.socket.getsockname()[1]
        threading.Thread(target=self._server.serve_forever, daemon=True).start()

    def stop(self) -> None:
        assert self._server is not None
        if self.connection is not None:
            self.connection.socket.close()
        self._server.shutdown()

    def _handle(self, connection: ServerConnection) -> None:
        self.connection = connection
        assert connection.request is not None
        self.paths.append(connection.request.path)
        if self.fence.is_set():
            connection.close(CLOSE_FENCED)
            return
        if self.unable.is_set():
            connection.close(1013)
            return
        connection.send(Orders(ack=self.ack).model_dump_json())
        try:
            for message in connection:
                if isinstance(message, bytes):
                    self.frames.append(message)
                    time.sleep(self.seconds_per_frame)
                    continue
                batch = Batch.model_validate_json(message)
                self.batches.append(batch)
                if self.puzzled and batch.items:
                    connection.close(CLOSE_NOT_UNDERSTOOD)
                    return
                if self.unstorable is not None and any(item.seq >= self.unstorable for item in batch.items):
                    self.stored += [item.seq for item in batch.items if self.ack < item.seq < self.unstorable]
                    refusal = Refusal(seq=self.unstorable, reason="its name is too long")
                    connection.send(Orders(ack=self.ack, refused=refusal).model_dump_json())
                    continue
                if self.deaf.is_set():
                    # Received, perhaps even stored, but the answer is lost.
                    connection.socket.close()
                    return
                self.stored += [item.seq for item in batch.items if item.seq > self.ack]
                connection.send(Orders(ack=self.ack, over=batch.final is not None).model_dump_json())
        except (ConnectionClosed, OSError):
            return


@pytest.fixture
def peer() -> Iterator[Peer]:
    peer = Peer()
    peer.start()
    yield peer
    peer.stop()


class Worker:
    """The worker's end."""

    def __init__(self, directory: Path, port: int) -> None:
        self.orders: list[Orders] = []
        self.spool = Spool(directory / "spool", last_seq=0)
        self.broken: list[str] = []
        self.link = Link(
            f"http://127.0.0.1:{port}", "secret", "run1", 3, self.spool, LEASE, self.orders.append, self.broken.append
        )

    def report(self, count: int) -> None:
        for _ in range(count):
            self.spool.metrics(self.spool.last_seq + 1, 0.0, {"a": 1.0})
            self.link.notify()


@pytest.fixture
def worker(tmp_path: Path, peer: Peer) -> Iterator[Worker]:
    worker = Worker(tmp_path, peer.port)
    yield worker
    worker.link.close()
    worker.spool.close()


def until(condition: Callable[[], bool], seconds: float = 10.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.01)


def test_everything_arrives_in_order_and_the_final_message_comes_last(peer: Peer, worker: Worker) -> None:
    worker.report(1_300)
    worker.link.finish(Final(outcome="completed"))
    assert worker.link.wait(10)
    assert peer.stored == list(range(1, 1_301))
    assert [batch.final is not None for batch in peer.batches] == [False] * (len(peer.batches) - 1) + [True]
    assert peer.batches[-1].items == ()
    assert worker.spool.acked == 1_300
    assert set(peer.paths) == {"/api/worker/runs/run1/link?attempt=3"}


def test_a_server_restart_loses_nothing_and_doubles_nothing(peer: Peer, worker: Worker) -> None:
    worker.report(10)
    until(lambda: worker.spool.acked == 10)
    peer.stop()
    worker.report(10)
    time.sleep(0.3)
    peer.start()
    worker.report(10)
    until(lambda: worker.spool.acked == 30)
    assert peer.stored == list(range(1, 31))


def test_what_was_not_acknowledged_is_sent_again(peer: Peer, worker: Worker) -> None:
    peer.deaf.set()
    worker.report(5)
    until(lambda: len(peer.batches) >= 2)
    assert worker.spool.acked == 0
    peer.deaf.clear()
    until(lambda: worker.spool.acked == 5)
    assert peer.stored == [1, 2, 3, 4, 5]


def test_the_lease_is_renewed_while_the_trainer_says_nothing(peer: Peer, worker: Worker) -> None:
    until(lambda: len(peer.batches) >= 3, seconds=5)
    assert all(batch == Batch() for batch in peer.batches)


def test_a_fenced_link_ends_and_says_so(peer: Peer, worker: Worker) -> None:
    until(lambda: peer.connection is not None)
    assert peer.connection is not None
    peer.connection.close(CLOSE_FENCED)
    assert worker.link.wait(5)
    assert worker.link.fenced()


def test_a_link_that_is_fenced_on_arrival_ends_too(tmp_path: Path, peer: Peer) -> None:
    peer.fence.set()
    worker = Worker(tmp_path, peer.port)
    assert worker.link.wait(5)
    assert worker.link.fenced()
    worker.link.close()
    worker.spool.close()


def test_orders_reach_the_worker_whole(peer: Peer, worker: Worker) -> None:
    until(lambda: peer.connection is not None and worker.orders != [])
    wish = Orders(ack=0, stop=True, watch=WatchRequest(mode="training", robots=3))
    assert peer.connection is not None
    peer.connection.send(wish.model_dump_json())
    until(lambda: wish in worker.orders)


def test_frames_overtake_and_the_oldest_are_dropped_while_there_is_no_server(peer: Peer, worker: Worker) -> None:
    until(lambda: worker.orders != [])
    worker.link.frame(b"first")
    until(lambda: peer.frames == [b"first"])
    peer.stop()
    for number in range(100):
        worker.link.frame(b"%d" % number)
    peer.start()

    def fresh_frame_arrives() -> bool:
        worker.link.frame(b"fresh")
        return b"fresh" in peer.frames

    until(fresh_frame_arrives)
    assert len(peer.frames) < 50


def test_closing_ends_the_thread_whether_or_not_there_is_a_server(tmp_path: Path, peer: Peer) -> None:
    peer.stop()
    worker = Worker(tmp_path, peer.port)
    worker.report(3)
    time.sleep(0.1)
    started = time.monotonic()
    worker.link.close()
    assert time.monotonic() - started < 2
    assert worker.link.done
    worker.spool.close()
    peer.start()


def test_frames_on_a_slow_line_do_not_keep_metrics_waiting(peer: Peer, worker: Worker) -> None:
    until(lambda: len(worker.orders) > 0)
    peer.seconds_per_frame = 0.02
    stop = threading.Event()

    def watch() -> None:
        while not stop.wait(0.005):
            worker.link.frame(bytes(500_000))

    # They come faster than the line carries them, so that there is always a next one.
    watcher = threading.Thread(target=watch)
    watcher.start()
    try:
        until(lambda: len(peer.frames) > 20)
        worker.report(20)
        until(lambda: worker.spool.acked == 20, seconds=5)
    finally:
        stop.set()
        watcher.join()


@pytest.mark.parametrize("damage", [b"x" * 40, b""], ids=["overwritten", "truncated"])
def test_what_follows_a_damaged_line_is_given_up_and_the_attempt_is_lost_whatever_its_trainer_says(
    tmp_path: Path, peer: Peer, damage: bytes
) -> None:
    peer.stop()
    worker = Worker(tmp_path, peer.port)
    worker.report(3)
    lines = (tmp_path / "spool").read_bytes().splitlines(keepends=True)
    (tmp_path / "spool").write_bytes(lines[0] + damage)
    peer.start()
    until(lambda: worker.broken != [])
    assert peer.stored == [1]
    assert "after item 1 cannot be read back" in worker.broken[0]
    # The lease is kept meanwhile, by messages without items.
    beats = len(peer.batches)
    until(lambda: len(peer.batches) > beats + 1)
    worker.link.finish(Final(outcome="completed"))
    assert worker.link.wait(10)
    assert peer.batches[-1].final == Final(outcome="lost", error=worker.broken[0])
    assert peer.stored == [1]
    assert len(worker.broken) == 1
    worker.link.close()
    worker.spool.close()


def test_what_the_server_can_never_store_ends_the_attempt_with_its_reason(peer: Peer, worker: Worker) -> None:
    peer.unstorable = 3
    worker.report(5)
    until(lambda: worker.broken != [])
    assert worker.broken == ["the server can't store item 3: its name is too long"]
    worker.link.finish(Final(outcome="stopped"))
    assert worker.link.wait(10)
    assert peer.stored == [1, 2]
    assert peer.batches[-1].final == Final(outcome="lost", error=worker.broken[0])


def test_what_the_server_never_understands_ends_the_attempt_instead_of_being_sent_for_ever(
    peer: Peer, worker: Worker
) -> None:
    until(lambda: worker.orders != [])
    peer.puzzled = True
    worker.report(1)
    until(lambda: worker.broken != [])
    worker.link.finish(Final(outcome="completed"))
    assert worker.link.wait(10)
    assert peer.batches[-1].final is not None
    assert peer.batches[-1].final.outcome == "lost"


def test_a_server_that_opens_links_and_cannot_serve_them_is_asked_less_and_less_often(
    peer: Peer, worker: Worker, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO, "workers")
    worker.report(1)
    until(lambda: worker.spool.acked == 1)
    begun = len(peer.paths)
    peer.unable.set()
    assert peer.connection is not None
    peer.connection.close(1013)
    time.sleep(3.0)
    assert len(peer.paths) - begun <= 4
    (lost,) = caplog.records
    assert "no link to the server" in lost.getMessage()
    peer.unable.clear()
    worker.report(1)
    until(lambda: worker.spool.acked == 2)
    assert "linked to the server again" in caplog.records[-1].getMessage()
    assert len(caplog.records) == 2

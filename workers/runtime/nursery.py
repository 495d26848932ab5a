"""The process that trainers and jobs are forked from, as a slot or a place for jobs sees it: asked for them, closed."""

import itertools
import os
import signal
import socket
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future
from multiprocessing.connection import Connection

import msgspec

from workers.runtime.forked_process import ForkedProcess
from workers.runtime.nursery_protocol import (
    MAX_PACKET_BYTES,
    Ended,
    Fork,
    Forked,
    Hello,
    Kill,
    News,
    NotForked,
    Ready,
    Refused,
    What,
    Wish,
)
from workers.runtime.trainer_handle import TrainerHandle

# A fork takes hundredths of a second; one that takes this long has met a machine on which nothing goes.
_FORK_SECONDS = 60.0
_ENDED = "The process that trainers and jobs are forked from has ended: the worker's log says how."


class Nursery:
    """A connection to the worker's nursery (`workers.runtime.nursery_keeper`); what is forked for it ends with it.

    Args:
        door: descriptor of the socket through which one comes to it.

    Raises:
        OSError: this process can open no connection now.
    """

    def __init__(self, door: int) -> None:
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        try:
            with theirs, socket.socket(fileno=os.dup(door)) as through:
                socket.send_fds(through, [_packet(Hello())], [theirs.fileno()])
        except BaseException:
            self._socket.close()
            raise
        self.pid: int | None = None
        """The nursery's process id, once it is ready."""
        self._cause = _ENDED
        self._numbers = itertools.count()
        self._lock = threading.Lock()
        self._begun: dict[int, Future[int]] = {}
        self._ended: dict[int, Future[int]] = {}
        self._gone = False
        self._answered = threading.Event()
        self._news_thread = threading.Thread(target=self._hear, name="news of the nursery", daemon=True)
        self._news_thread.start()

    @property
    def alive(self) -> bool:
        """Whether it still runs, or may yet."""
        return not self._gone

    @property
    def ready(self) -> bool:
        """Whether it has imported everything."""
        return self.pid is not None

    def until_ready(self, seconds: float) -> None:
        """Wait for its imports.

        Raises:
            OSError: it has ended, or is not ready within that time.
        """
        self._answered.wait(seconds)
        if not self.ready or self._gone:
            raise OSError(self._cause if self._gone else "what processes are forked from was not ready in time")

    def trainer(self) -> TrainerHandle:
        """A trainer that waits for its job.

        Raises:
            OSError: the machine can begin none now, or the nursery has ended.
        """
        ours: list[int] = []
        theirs: list[int] = []
        try:
            # Orders go to it, what it prints and reports comes from it.
            for goes in (True, False, False):
                read, write = os.pipe()
                ours.append(write if goes else read)
                theirs.append(read if goes else write)
            process = self._forked("trainer", theirs)
        except OSError:
            _close(ours)
            raise
        finally:
            _close(theirs)
        return TrainerHandle(process, *ours)

    def job(self, theirs: "Connection[object, object]") -> ForkedProcess:
        """A process that waits for the order of a job at this end of a pipe, and prints where this one does.

        Raises:
            OSError: the machine can begin none now, or the nursery has ended.
        """
        return self._forked("job", [theirs.fileno(), 1, 2])

    def close(self) -> None:
        """End what was forked for it."""
        self._socket.shutdown(socket.SHUT_RDWR)
        self._news_thread.join()
        self._socket.close()

    def cause_of_death(self) -> str:
        """How it ended, where that is known here."""
        return self._cause

    def _forked(self, what: What, descriptors: Sequence[int]) -> ForkedProcess:
        number = next(self._numbers)
        begun, ended = Future[int](), Future[int]()
        with self._lock:
            if self._gone:
                raise OSError(self._cause)
            self._begun[number], self._ended[number] = begun, ended
        kill: Callable[[], None] = lambda: self._wish(Kill(number))  # noqa: E731 - given away, and used below
        try:
            socket.send_fds(self._socket, [_packet(Fork(number, what))], descriptors)
            pid = begun.result(_FORK_SECONDS)
        except (OSError, TimeoutError) as error:
            kill()
            raise OSError(str(error) or "the machine has begun no process in time") from error
        return ForkedProcess(pid, ended, kill)

    def _wish(self, wish: Wish) -> None:
        try:
            self._socket.send(_packet(wish))
        except OSError:
            return  # it has ended, and what it has forked with it

    def _hear(self) -> None:
        decoder = msgspec.msgpack.Decoder(News)
        while packet := self._packet():
            match decoder.decode(packet):
                case Ready(pid):
                    self.pid = pid
                    self._answered.set()
                case Refused(cause):
                    self._cause = cause
                case Forked(number, pid):
                    self._begun.pop(number).set_result(pid)
                case NotForked(number, error):
                    self._ended.pop(number)
                    self._begun.pop(number).set_exception(OSError(error))
                case Ended(number, status):
                    self._ended.pop(number).set_result(status)
        with self._lock:
            self._gone = True
        self._answered.set()
        for begun in self._begun.values():
            begun.set_exception(OSError(self._cause))
        for ended in self._ended.values():
            # Linux has ended them with their parent, or that has ended them with this connection.
            ended.set_result(-signal.SIGKILL)

    def _packet(self) -> bytes:
        try:
            return self._socket.recv(MAX_PACKET_BYTES)
        except OSError:
            return b""


def _packet(message: Wish | Hello) -> bytes:
    return msgspec.msgpack.encode(message)


def _close(descriptors: Sequence[int]) -> None:
    for descriptor in descriptors:
        os.close(descriptor)

"""The process that a slot's trainers are forked from, as the slot sees it: started, asked for trainers, closed."""

import itertools
import logging
import os
import signal
import socket
import subprocess
import sys
import threading
from concurrent.futures import Future
from pathlib import Path

import msgspec

from workers.processes import how_it_ended
from workers.runtime.nursery_protocol import (
    MAX_PACKET_BYTES,
    Ended,
    Fork,
    Forked,
    Kill,
    News,
    NotForked,
    Ready,
    Wish,
)
from workers.runtime.printed import Printed
from workers.runtime.trainer_handle import TrainerHandle

logger = logging.getLogger(__name__)

_ROOT = Path(__file__).resolve().parents[2]
# One thread a process: seeds train side by side, one a core, and small networks gain nothing from more.
_ENVIRONMENT = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"}
# A fork takes hundredths of a second; one that takes this long has met a machine on which nothing goes.
_FORK_SECONDS = 60.0


class Nursery:
    """A process that imports what trainers need, seconds of it, once, and begins trainers in a fraction of one.

    Start it from a thread that lives as long as the worker: Linux ends the process when the thread that started it ends.
    Its trainers end with it.

    Raises:
        OSError: the machine can start no process now.
    """

    def __init__(self) -> None:
        self._socket, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        path = os.pathsep.join(filter(None, (str(_ROOT), os.environ.get("PYTHONPATH"))))
        try:
            self._process = subprocess.Popen(
                [sys.executable, "-m", "workers.runtime.nursery_process", str(theirs.fileno()), str(os.getpid())],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT,
                pass_fds=(theirs.fileno(),),
                start_new_session=True,
                env={**os.environ, **_ENVIRONMENT, "PYTHONPATH": path},
            )
        except BaseException:
            self._socket.close()
            raise
        finally:
            theirs.close()
        assert self._process.stdout is not None
        self._printed = Printed(self._process.stdout, logger, f"trainers' nursery {self._process.pid}")
        self._numbers = itertools.count()
        self._lock = threading.Lock()
        self._begun: dict[int, Future[int]] = {}
        self._ended: dict[int, Future[int]] = {}
        self._gone = False
        self._ready = threading.Event()
        self._news_thread = threading.Thread(target=self._hear, name="news of trainers", daemon=True)
        self._news_thread.start()

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def alive(self) -> bool:
        """Whether it still runs."""
        return self._process.poll() is None

    @property
    def ready(self) -> bool:
        """Whether it has imported everything."""
        return self._ready.is_set()

    def trainer(self) -> TrainerHandle:
        """A trainer that waits for its job.

        Raises:
            OSError: the machine can begin none now, or this process has ended.
        """
        number = next(self._numbers)
        begun, ended = Future[int](), Future[int]()
        with self._lock:
            if self._gone:
                raise OSError("the process that trainers are forked from has ended")
            self._begun[number], self._ended[number] = begun, ended
        ours: list[int] = []
        theirs: list[int] = []
        try:
            # Orders go to it, what it prints and reports comes from it.
            for goes in (True, False, False):
                read, write = os.pipe()
                ours.append(write if goes else read)
                theirs.append(read if goes else write)
            socket.send_fds(self._socket, [_packet(Fork(number))], theirs)
            pid = begun.result(_FORK_SECONDS)
        except (OSError, TimeoutError) as error:
            for descriptor in ours:
                os.close(descriptor)
            self._wish(Kill(number))
            raise OSError(str(error) or "the machine has begun no trainer in time") from error
        finally:
            for descriptor in theirs:
                os.close(descriptor)
        return TrainerHandle(pid, ended, lambda: self._wish(Kill(number)), *ours)

    def close(self) -> None:
        """End it, and its trainers with it."""
        if self.alive:
            os.killpg(self._process.pid, signal.SIGKILL)
        self._process.wait()
        self._news_thread.join()
        self._printed.close()
        self._socket.close()

    def cause_of_death(self) -> str:
        """How it ended and what it printed last; call it after `close`."""
        return self._printed.explains(f"The trainer process {how_it_ended(self._process.returncode)}.")

    def _wish(self, wish: Wish) -> None:
        try:
            self._socket.send(_packet(wish))
        except OSError:
            return  # it has ended, and its trainers with it

    def _hear(self) -> None:
        decoder = msgspec.msgpack.Decoder(News)
        while packet := self._packet():
            match decoder.decode(packet):
                case Ready():
                    self._ready.set()
                case Forked(number, pid):
                    self._begun.pop(number).set_result(pid)
                case NotForked(number, error):
                    self._ended.pop(number)
                    self._begun.pop(number).set_exception(OSError(error))
                case Ended(number, status):
                    self._ended.pop(number).set_result(status)
        with self._lock:
            self._gone = True
        for begun in self._begun.values():
            begun.set_exception(OSError("the process that trainers are forked from has ended"))
        for ended in self._ended.values():
            # Linux has ended them with their parent.
            ended.set_result(-signal.SIGKILL)

    def _packet(self) -> bytes:
        try:
            return self._socket.recv(MAX_PACKET_BYTES)
        except OSError:
            return b""


def _packet(message: Wish) -> bytes:
    return msgspec.msgpack.encode(message)

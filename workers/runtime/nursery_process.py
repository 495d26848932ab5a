"""`python -m workers.runtime.nursery_process FD PARENT`: imports, once, all that trainers need, and forks them when asked.

Imports take seconds, a fork takes milliseconds, and the pages that nobody writes are there once. It runs in one thread: what
other threads hold a fork would leave locked. It ends with the process that started it (PARENT), and trainers end with it.
"""

import contextlib
import gc
import os
import selectors
import signal
import socket
import sys
import traceback
from typing import NoReturn

import msgspec

from workers.processes import die_with_parent
from workers.runtime.nursery_protocol import (
    DESCRIPTORS,
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


class _Nursery:
    def __init__(self, control: socket.socket) -> None:
        self._control = control
        self._numbers: dict[int, int] = {}
        self._encoder = msgspec.msgpack.Encoder()
        self._decoder = msgspec.msgpack.Decoder(Wish)
        # Written to by the interpreter where a trainer has ended.
        self._woken, self._waker = os.pipe()
        os.set_blocking(self._woken, False)
        os.set_blocking(self._waker, False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        signal.set_wakeup_fd(self._waker)

    def serve(self) -> None:
        """Fork trainers and tell of their ends, until the slot is gone."""
        self._say(Ready())
        with selectors.DefaultSelector() as selector:
            for source in (self._control, self._woken):
                selector.register(source, selectors.EVENT_READ)
            while True:
                for key, _ in selector.select():
                    if key.fileobj == self._woken:
                        self._bury()
                    elif not self._obey():
                        return

    def _obey(self) -> bool:
        """Do what the slot wishes; whether it is still there."""
        packet, descriptors, _, _ = socket.recv_fds(self._control, MAX_PACKET_BYTES, DESCRIPTORS)
        if not packet:
            return False
        match self._decoder.decode(packet):
            case Fork(number):
                self._fork(number, *descriptors)
            case Kill(number):
                self._kill(number)
        return True

    def _fork(self, number: int, orders: int, output: int, reports: int) -> None:
        sys.stdout.flush()
        sys.stderr.flush()
        parent = os.getpid()
        try:
            pid = os.fork()
        except OSError as error:
            self._say(NotForked(number, str(error)))
            return
        finally:
            if os.getpid() == parent:
                for descriptor in (orders, output, reports):
                    os.close(descriptor)
        if pid == 0:
            self._become_trainer(parent, orders, output, reports)
        self._numbers[pid] = number
        self._say(Forked(number, pid))

    def _become_trainer(self, parent: int, orders: int, output: int, reports: int) -> NoReturn:
        status = 1
        try:
            os.setsid()
            die_with_parent(parent)
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            self._control.close()
            os.close(self._woken)
            os.close(self._waker)
            os.dup2(output, sys.stdout.fileno())
            os.dup2(output, sys.stderr.fileno())
            os.close(output)
            from workers.runtime.trainer_process import train_as_told

            train_as_told(orders, reports)
            status = 0
        except BaseException:
            traceback.print_exc()
        finally:
            with contextlib.suppress(OSError, ValueError):
                sys.stdout.flush()
                sys.stderr.flush()
            # Everything is said. The thread that listens holds the orders, over which an orderly exit would stumble.
            os._exit(status)

    def _kill(self, number: int) -> None:
        # Those in the table have not been waited for, so that the number of their process is nobody else's.
        for pid, its_number in self._numbers.items():
            if its_number == number:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(pid, signal.SIGKILL)
                with contextlib.suppress(ProcessLookupError, PermissionError):
                    os.killpg(pid, signal.SIGKILL)

    def _bury(self) -> None:
        with contextlib.suppress(BlockingIOError):
            os.read(self._woken, MAX_PACKET_BYTES)
        for pid in list(self._numbers):
            ended, status = os.waitpid(pid, os.WNOHANG)
            if ended:
                self._say(Ended(self._numbers.pop(pid), os.waitstatus_to_exitcode(status)))

    def _say(self, news: News) -> None:
        # Where the slot is gone, the next look at what it wishes says so.
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):
            self._control.send(self._encoder.encode(news))


def main(descriptor: int, parent: int) -> None:
    """Import, then fork what is asked for."""
    die_with_parent(parent)
    # Ctrl-C reaches the whole terminal, a batch system's SIGTERM all of a job; ending in order is the worker's decision.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)

    import workers.live.viewer
    import workers.runtime.trainer_process
    import workers.training.trainer  # noqa: F401 - each is needed by a trainer
    from workers.precompile import warm_up

    warm_up()
    # What is there now stays: a collector that looked through it would write to every page of it.
    gc.collect()
    gc.freeze()
    with socket.socket(fileno=descriptor) as control:
        _Nursery(control).serve()


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))

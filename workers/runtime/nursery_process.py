"""`python -m workers.runtime.nursery_process DOOR PARENT`: imports, once, all that trainers and jobs need, and forks them.

Imports take seconds, a fork takes milliseconds, and the pages that nobody writes are there once, however many train. It runs
in one thread: what other threads hold a fork would leave locked. It ends with the process that started it (PARENT), what it
has forked ends with it, and what it has forked for a client ends with that client's connection.
"""

import contextlib
import errno
import gc
import os
import selectors
import signal
import socket
import sys
import traceback
from typing import NoReturn

import msgspec

from workers.processes import die_with_parent, name_this_process
from workers.runtime.nursery_protocol import (
    DESCRIPTORS,
    MAX_PACKET_BYTES,
    Ended,
    Fork,
    Forked,
    Hello,
    Kill,
    News,
    NotForked,
    Ready,
    What,
    Wish,
)


class _Client:
    """Somebody for whom processes are forked.

    Attributes:
        connection: to it.
        processes: its numbers for them, by id; those that have not been waited for, so that their ids are nobody else's.
    """

    def __init__(self, connection: socket.socket) -> None:
        self.connection = connection
        self.processes: dict[int, int] = {}
        self._encoder = msgspec.msgpack.Encoder()

    def say(self, news: News) -> None:
        """Tell it; where it is gone, the next look at what it wishes says so."""
        with contextlib.suppress(BrokenPipeError, ConnectionResetError):
            self.connection.send(self._encoder.encode(news))

    def kill(self, pid: int) -> None:
        """End one of its processes, and whatever that has started."""
        with contextlib.suppress(ProcessLookupError):
            os.kill(pid, signal.SIGKILL)
        with contextlib.suppress(ProcessLookupError, PermissionError):
            os.killpg(pid, signal.SIGKILL)


class _Nursery:
    def __init__(self, door: socket.socket) -> None:
        self._door = door
        self._clients: dict[int, _Client] = {}
        # Of those that have left, until their ends have been seen.
        self._left: list[_Client] = []
        self._hellos = msgspec.msgpack.Decoder(Hello)
        self._wishes = msgspec.msgpack.Decoder(Wish)
        self._selector = selectors.DefaultSelector()
        # Written to by the interpreter where a process has ended.
        self._woken, self._waker = os.pipe()
        os.set_blocking(self._woken, False)
        os.set_blocking(self._waker, False)
        signal.signal(signal.SIGCHLD, lambda *_: None)
        signal.set_wakeup_fd(self._waker)

    def serve(self) -> None:
        """Fork what is wished for and tell of ends, until nobody is left who could come through the door."""
        self._selector.register(self._door, selectors.EVENT_READ)
        self._selector.register(self._woken, selectors.EVENT_READ)
        while True:
            for key, _ in self._selector.select():
                if key.fileobj == self._woken:
                    self._bury()
                elif key.fileobj is self._door:
                    if not self._welcome():
                        return
                else:
                    self._obey(self._clients[key.fd])

    def _welcome(self) -> bool:
        """Let somebody in; whether there is anybody left who could come."""
        packet, descriptors, _, _ = socket.recv_fds(self._door, MAX_PACKET_BYTES, 1)
        if not packet:
            return False
        self._hellos.decode(packet)
        if not descriptors:
            # This process has as many files as it may: who has come is not heard.
            return True
        client = _Client(socket.socket(fileno=descriptors[0]))
        self._clients[descriptors[0]] = client
        self._selector.register(client.connection, selectors.EVENT_READ)
        client.say(Ready(os.getpid()))
        return True

    def _obey(self, client: _Client) -> None:
        try:
            packet, descriptors, _, _ = socket.recv_fds(client.connection, MAX_PACKET_BYTES, DESCRIPTORS)
        except ConnectionResetError:
            packet = b""
        if not packet:
            self._see_off(client)
            return
        match self._wishes.decode(packet):
            case Fork(number, what):
                self._fork(client, number, what, descriptors)
            case Kill(number):
                for pid, its_number in client.processes.items():
                    if its_number == number:
                        client.kill(pid)

    def _see_off(self, client: _Client) -> None:
        self._selector.unregister(client.connection)
        del self._clients[client.connection.fileno()]
        client.connection.close()
        for pid in client.processes:
            client.kill(pid)
        self._left.append(client)

    def _fork(self, client: _Client, number: int, what: What, descriptors: list[int]) -> None:
        if len(descriptors) < DESCRIPTORS:
            for descriptor in descriptors:
                os.close(descriptor)
            client.say(NotForked(number, os.strerror(errno.EMFILE)))
            return
        sys.stdout.flush()
        sys.stderr.flush()
        parent = os.getpid()
        try:
            pid = os.fork()
        except OSError as error:
            client.say(NotForked(number, str(error)))
            return
        finally:
            if os.getpid() == parent:
                for descriptor in descriptors:
                    os.close(descriptor)
        if pid == 0:
            self._become(what, parent, *descriptors)
        client.processes[pid] = number
        client.say(Forked(number, pid))

    def _become(self, what: What, parent: int, first: int, second: int, third: int) -> NoReturn:
        status = 1
        try:
            if what == "trainer":
                os.setsid()
            else:
                os.setpgid(0, 0)
            die_with_parent(parent)
            name_this_process(what)
            self._forget_everybody()
            if what == "trainer":
                _output_goes_to(second, second)
                from workers.runtime.trainer_process import train_as_told

                train_as_told(first, third)
            else:
                _output_goes_to(second, third)
                from workers.runtime.jobs.process import do_as_told

                do_as_told(first)
            status = 0
        except BaseException:
            traceback.print_exc()
        finally:
            with contextlib.suppress(OSError, ValueError):
                sys.stdout.flush()
                sys.stderr.flush()
            # Everything is said. A thread that listens may hold what an orderly exit would stumble over.
            os._exit(status)

    def _forget_everybody(self) -> None:
        signal.set_wakeup_fd(-1)
        signal.signal(signal.SIGCHLD, signal.SIG_DFL)
        self._selector.close()
        self._door.close()
        for client in self._clients.values():
            client.connection.close()
        os.close(self._woken)
        os.close(self._waker)

    def _bury(self) -> None:
        with contextlib.suppress(BlockingIOError):
            os.read(self._woken, MAX_PACKET_BYTES)
        for client in (*self._clients.values(), *self._left):
            for pid in list(client.processes):
                ended, status = os.waitpid(pid, os.WNOHANG)
                if ended:
                    number = client.processes.pop(pid)
                    if client not in self._left:
                        client.say(Ended(number, os.waitstatus_to_exitcode(status)))
        self._left = [client for client in self._left if client.processes]


def _output_goes_to(output: int, errors: int) -> None:
    os.dup2(output, sys.stdout.fileno())
    os.dup2(errors, sys.stderr.fileno())
    for descriptor in {output, errors}:
        os.close(descriptor)


def main(door: int, parent: int) -> None:
    """Import, then fork what is asked for."""
    die_with_parent(parent)
    name_this_process("nursery")
    # Ctrl-C reaches the whole terminal, a batch system's SIGTERM all of a job; ending in order is the worker's decision.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)

    import workers.live.viewer
    import workers.runtime.jobs.ready
    import workers.runtime.trainer_process
    import workers.training.trainer  # noqa: F401 - each is needed by a trainer
    from workers.precompile import warm_up

    warm_up()
    # What is there now stays: a collector that looked through it would write to every page of it.
    gc.collect()
    gc.freeze()
    with socket.socket(fileno=door) as through:
        _Nursery(through).serve()


if __name__ == "__main__":
    main(int(sys.argv[1]), int(sys.argv[2]))

"""The nursery as a worker's first process has it: started, started again where it dies, and its door."""

import contextlib
import os
import select
import socket
import subprocess
import sys
from collections.abc import Iterator

import msgspec

from workers.processes import python_path
from workers.runtime.companion import Companion
from workers.runtime.nursery_protocol import MAX_CAUSE_CHARACTERS, MAX_PACKET_BYTES, Refused

DOOR = "MAPLESS_NURSERY_DOOR"
"""Environment variable: the door's descriptor, in the worker's processes that have it from the first one."""

# One thread a process: seeds train side by side, one a core, and small networks gain nothing from more.
_ENVIRONMENT = {"OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "PYTHONUNBUFFERED": "1"}


class NurseryKeeper:
    """The process that a worker's trainers and jobs are forked from (`workers.runtime.nursery_process`).

    Make it on the process's first thread: Linux ends the nursery when the thread that started it ends.
    """

    def __init__(self) -> None:
        self._door, self._inside = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
        self._companion = Companion("trainers' nursery", self._start, self._refuse)

    @property
    def door(self) -> int:
        """Descriptor through which one comes to it (`workers.runtime.nursery.Nursery`)."""
        return self._door.fileno()

    def keep_running(self) -> None:
        """Start it again wherever it dies; once this process has forked what it forks at its start."""
        self._companion.keep_running()

    def close(self) -> None:
        """End it, and all that it has forked."""
        self._companion.close()
        self._door.close()
        self._inside.close()

    def _start(self) -> "subprocess.Popen[bytes]":
        environment = {name: value for name, value in os.environ.items() if name != DOOR}
        return subprocess.Popen(
            [sys.executable, "-m", "workers.runtime.nursery_process", str(self._inside.fileno()), str(os.getpid())],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            pass_fds=(self._inside.fileno(),),
            # What is typed at a terminal is not for it. No session of its own: Linux shares cores among sessions, so that no
            # job would make way for others, as it says it does.
            process_group=0,
            env={**environment, **_ENVIRONMENT, "PYTHONPATH": python_path()},
        )

    def _refuse(self, cause: str) -> None:
        """Tell those who have come meanwhile, so that nobody waits for one that does not begin."""
        refusal = msgspec.msgpack.encode(Refused(cause[:MAX_CAUSE_CHARACTERS]))
        # All first: who is refused comes again.
        for descriptor in list(self._waiting()):
            with socket.socket(fileno=descriptor) as connection, contextlib.suppress(OSError):  # it may have left
                connection.send(refusal)

    def _waiting(self) -> Iterator[int]:
        # Not `select.select`, which refuses descriptors from 1,024 on.
        waiting = select.poll()
        waiting.register(self._inside, select.POLLIN)
        while waiting.poll(0):
            yield from socket.recv_fds(self._inside, MAX_PACKET_BYTES, 1)[1]


def door() -> int:
    """The door of the worker that this process belongs to.

    Raises:
        KeyError: it belongs to none.
    """
    return int(os.environ[DOOR])

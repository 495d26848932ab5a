"""Keeps archives from being removed while a backup is made, which has to copy what its snapshot of the database names.

A lock on a file in the data directory: the backup is another process, and its end, whatever it is, ends the lock.
"""

import fcntl
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

_NAME = "backup.lock"


@contextmanager
def held(data_dir: Path) -> Iterator[None]:
    """Nothing is removed for as long as the block lasts; what is just being removed is waited for."""
    with (data_dir / _NAME).open("wb") as lock:
        fcntl.flock(lock, fcntl.LOCK_SH)
        yield


@contextmanager
def removing(data_dir: Path) -> Iterator[bool]:
    """Whether archives may be removed within the block; never waits."""
    with (data_dir / _NAME).open("wb") as lock:
        try:
            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            yield False
        else:
            yield True

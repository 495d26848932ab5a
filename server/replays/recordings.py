"""Evaluations driven once more: made on demand in a process of their own, one at a time, and kept for a while."""

import tempfile
from pathlib import Path
from threading import Lock

from server.errors import ReplayFailedError, ReplayTimeoutError
from server.processes import ProcessFailedError, ProcessTimeoutError, run_module
from server.replays.simulator import simulator
from server.replays.subject import Subject
from workers.replays.recording import Recording

# Imports take most of the few seconds; a machine that is busy training needs longer.
_TIMEOUT = 120.0
_SUFFIX = ".npz"


class RecordingStore:
    """A directory of recordings that never grows beyond its bound, apart from the newest of them.

    Args:
        directory: may be removed at any time; it is made where it is missing.
        max_bytes: the recordings that were looked at longest ago go first.
        simulator: names what drives now; recordings of another one are not shown any more, and go in their time.
    """

    def __init__(self, directory: Path, max_bytes: int, simulator: str | None = None) -> None:
        self._directory = directory
        self._max_bytes = max_bytes
        self._simulator = simulator
        self._making = Lock()

    def get(self, subject: Subject) -> Recording:
        """What a policy did on its suite; made now if it is not there.

        Raises:
            ReplayFailedError: its archive is refused, or the suite is no longer what it was.
            ReplayTimeoutError: it took too long.
        """
        path = self._path(subject)
        recording = _load(path)
        if recording is None:
            with self._making:
                # Who waited here may find it made.
                recording = _load(path) or self._make(subject, path)
        if recording.evaluation.suite_hash != subject.recorded.suite_hash:
            raise ReplayFailedError(
                f"The suite {subject.recorded.suite} has changed since this evaluation: its episodes can't be driven again."
            )
        return recording

    def _path(self, subject: Subject) -> Path:
        by = self._simulator or simulator()
        return self._directory / f"{subject.sha256[:32]}-{subject.recorded.suite_hash[:16]}-{by}{_SUFFIX}"

    def _make(self, subject: Subject, path: Path) -> Recording:
        self._directory.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(prefix="mapless-replay-") as scratch:
            archive, out = Path(scratch) / "checkpoint.zip", Path(scratch) / path.name
            subject.save(archive)
            suite = () if subject.suite is None else ("--suite", subject.suite)
            try:
                run_module("workers.replays", str(archive), "--out", str(out), *suite, timeout=_TIMEOUT)
                recording = Recording.load(out)
            except ProcessTimeoutError as error:
                raise ReplayTimeoutError(
                    f"Driving the evaluation again took longer than {_TIMEOUT:.0f} s: the machine is busy; try again later."
                ) from error
            except (ProcessFailedError, OSError, ValueError) as error:
                raise ReplayFailedError(f"The episodes could not be driven again: {error}") from error
            torn = path.with_suffix(".part")
            torn.write_bytes(out.read_bytes())
            torn.replace(path)
        self._forget_old(path)
        return recording

    def _forget_old(self, newest: Path) -> None:
        files = sorted(self._directory.glob(f"*{_SUFFIX}"), key=lambda file: file.stat().st_mtime, reverse=True)
        total = newest.stat().st_size
        for file in files:
            if file != newest:
                total += file.stat().st_size
                if total > self._max_bytes:
                    file.unlink()


def _load(path: Path) -> Recording | None:
    """A recording that is kept, marked as looked at; None where there is none that can be read."""
    try:
        recording = Recording.load(path)
        path.touch()
    except (OSError, ValueError):
        return None
    return recording

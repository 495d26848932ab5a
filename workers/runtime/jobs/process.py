"""What a job's process does: the job, and what it says of it over a pipe to the place that started it.

Processes are forked from the worker's nursery, which has imported all that they need (`workers.runtime.jobs.ready`), so that
the first frame of a view comes in a fraction of a second. Each does one job and ends; a crash takes nothing else along.
"""

import contextlib
import os
import signal
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from multiprocessing.connection import Connection
from pathlib import Path
from typing import cast

from sim.errors import SimError
from workers.errors import WorkerError
from workers.frames import Frame
from workers.job_protocol import (
    JOB_SPEC,
    BagJob,
    BaselineName,
    EvaluateJob,
    ExportJob,
    FilmJob,
    JobOrders,
    PlayJob,
    ReplayJob,
    ViewJob,
)
from workers.play_protocol import PlaySeen
from workers.reporting import EvaluationResult, EventLevel, WatchRequest

ARCHIVE = "checkpoint.zip"
"""In the job's folder: the policy's archive, where it has one."""
RESULT = "result"
"""In the job's folder: what comes out of it."""

RECORDING = "recording"
"""Of an evaluation: what its robots did, where that is not too much."""

BAG = "bag"
"""In the job's folder: the robot's recording that it reads."""

_PROGRESS_SECONDS = 0.5
# Of what nobody waits for: beside trainers that want a core each it gets a tenth of one.
_AHEAD_NICENESS = 10


def recording_name(number: int) -> str:
    """In the folder of a film's job: what its policy of that number did."""
    return f"{RECORDING}{number}"


@dataclass(frozen=True)
class Progressed:
    """Share of the work that is done, 0 to 1."""

    share: float


@dataclass(frozen=True)
class Failed:
    """It would fail again; the reason, for people."""

    reason: str


@dataclass(frozen=True)
class Done:
    """All is done, and the result, where there is one, is complete on disk."""


Said = Progressed | Failed | Done | PlaySeen | bytes
"""What a job's process says; bytes are an encoded frame of a view or a playground."""


@dataclass(frozen=True)
class Task:
    """What a job's process is to do; the first that it is told.

    Attributes:
        spec: a `JobSpec` as JSON.
        directory: the job's folder.
        ahead: nobody waits for it.
    """

    spec: str
    directory: str
    ahead: bool


def do_as_told(pipe: int) -> None:
    """Do the job that comes through this descriptor of a pipe; what comes after it are the orders of whoever watches."""
    connection: Connection[Said, Task] = Connection(pipe)
    with connection:
        try:
            task = connection.recv()
        except EOFError:
            return
        _see_through(task, cast("Connection[Said, JobOrders]", connection))


def _see_through(task: Task, connection: "Connection[Said, JobOrders]") -> None:
    if task.ahead:
        os.nice(_AHEAD_NICENESS)
    signal.signal(signal.SIGTERM, signal.SIG_DFL)
    last: Said
    try:
        _do(task.spec, Path(task.directory), connection)
    except (WorkerError, SimError, OSError, ValueError, KeyError) as error:
        last = Failed(str(error.args[0]) if error.args else type(error).__name__)
    else:
        last = Done()
    # The place may have stopped listening: nobody wants the job any more.
    with contextlib.suppress(BrokenPipeError):
        connection.send(last)


def _do(text: str, directory: Path, connection: "Connection[Said, JobOrders]") -> None:
    spec = JOB_SPEC.validate_json(text)
    archive, result = directory / ARCHIVE, directory / RESULT
    match spec:
        case ViewJob():
            _drive(archive, connection)
        case PlayJob():
            _play(archive, spec, connection)
        case ReplayJob():
            from workers.replays.record import record

            record(_archive_of(spec, archive), spec.policy, spec.suite, _teller(connection)).save(result)
        case FilmJob():
            from workers.replays.films import make_film

            recordings = [directory / recording_name(number) for number in range(len(spec.film.policies))]
            make_film(spec.film, recordings, result, _teller(connection))
        case BagJob():
            from workers.bags.job import read_recording

            told = read_recording(spec, directory / BAG, archive, directory, _teller(connection))
            result.write_text(told.model_dump_json(), encoding="utf-8")
        case ExportJob():
            from workers.export.bundle import bundle, export_checkpoint

            result.write_bytes(bundle(export_checkpoint(archive)))
        case EvaluateJob():
            from workers.replays.record import measure_and_record

            measurement, recording = measure_and_record(_archive_of(spec, archive), spec, _teller(connection))
            result.write_text(measurement.model_dump_json(), encoding="utf-8")
            if recording is not None:
                recording.save(directory / RECORDING)


def _teller(connection: "Connection[Said, JobOrders]") -> Callable[[float], None]:
    """Tells the place how far it is, now and then."""
    told = time.monotonic()

    def progress(share: float) -> None:
        nonlocal told
        if time.monotonic() - told > _PROGRESS_SECONDS:
            told = time.monotonic()
            connection.send(Progressed(share))

    return progress


def _archive_of(spec: EvaluateJob | ReplayJob, archive: Path) -> Path | None:
    return None if isinstance(spec.policy, BaselineName) else archive


class _Screen:
    """A reporter that sends frames over a pipe."""

    def __init__(self, connection: "Connection[Said, JobOrders]") -> None:
        self._connection = connection
        self._lock = threading.Lock()
        self.watch: WatchRequest | None = None

    def metrics(self, step: int, values: Mapping[str, float]) -> None:
        """There are none."""

    def event(self, step: int, level: EventLevel, message: str) -> None:
        """Says why the view has stopped."""
        with self._lock:
            self._connection.send(Failed(message))

    def checkpoint(self, step: int, archive: Path, evaluation: EvaluationResult | None) -> None:
        """There are none."""

    def frames(self, frames: Sequence[Frame]) -> None:
        """See `Reporter.frames`."""
        with self._lock:
            for frame in frames:
                self._connection.send(frame.encode())

    @property
    def stop_requested(self) -> bool:
        """Never."""
        return False


def _drive(archive: Path, connection: "Connection[Said, JobOrders]") -> None:
    """Drive for whoever watches, until nobody is left to say what to show."""
    from sim.arenas import with_maps_of
    from workers.checkpoints import read_policy
    from workers.live.viewer import LiveViewer

    manifest, policy = read_policy(archive)
    screen = _Screen(connection)
    viewer = LiveViewer(with_maps_of(manifest.training.task, manifest.seed), screen)
    try:
        while True:
            wish = connection.recv().watch
            # There are no training robots any more.
            screen.watch = None if wish is None else wish.model_copy(update={"mode": "policy"})
            viewer.on_weights(lambda: policy, manifest.step)
    except EOFError:
        return
    finally:
        viewer.close()


class _Audience:
    """Hears of a playground at the other end of a pipe."""

    def __init__(self, connection: "Connection[Said, JobOrders]") -> None:
        self._connection = connection

    def frame(self, frame: bytes) -> None:
        """See `workers.live.playing.Audience`."""
        self._connection.send(frame)

    def seen(self, seen: PlaySeen) -> None:
        """See `workers.live.playing.Audience`."""
        self._connection.send(seen)


def _play(archive: Path, job: PlayJob, connection: "Connection[Said, JobOrders]") -> None:
    """Drive as whoever plays says, until nobody is left to."""
    from workers.live.playing import open_playground, play

    play(open_playground(archive, job), connection, _Audience(connection))

"""What a Celery task and its trainer process say to one another over pipes: length-prefixed MessagePack.

task                             trainer process
  | --- Job ------------------------> |      once
  | --- Control --------------------> |      whenever stop or watch change
  | <-- MetricsReport, EventReport, CheckpointReport, FrameReport ---
  | <-- Ended ----------------------- |      once, last
"""

import struct
from typing import IO, Generic, TypeAlias, TypeVar

import msgspec

from workers.reporting import EventLevel

_LENGTH = struct.Struct("<I")
# Far above anything that a trainer says; a length beyond it means that the two ends are out of step.
_MAX_MESSAGE_BYTES = 64 * 2**20

T = TypeVar("T")


class Job(msgspec.Struct, frozen=True, tag="job"):
    """Train this: a `TrainingConfig` as JSON. `resume` is the archive to go on from, `start` the one to begin with."""

    training: str
    seed: int
    directory: str
    resume: str | None
    start: str | None = None


class Control(msgspec.Struct, frozen=True, tag="control"):
    """What the trainer should know now; `watch` is a `WatchRequest` as JSON."""

    stop: bool
    watch: str | None


class MetricsReport(msgspec.Struct, frozen=True, tag="metrics"):
    """Numbers at an environment step, taken at `at` (seconds since the epoch)."""

    step: int
    at: float
    values: dict[str, float]


class EventReport(msgspec.Struct, frozen=True, tag="event"):
    """One line for the run's event log."""

    step: int
    level: EventLevel
    message: str


class CheckpointReport(msgspec.Struct, frozen=True, tag="checkpoint"):
    """An archive that is complete on disk; `evaluation` is an `EvaluationResult` as JSON."""

    step: int
    archive: str
    evaluation: str | None


class FrameReport(msgspec.Struct, frozen=True, tag="frame"):
    """An encoded `workers.frames.Frame`."""

    data: bytes


class Ended(msgspec.Struct, frozen=True, tag="ended"):
    """The training is over: `completed` or `stopped`, or with an error.

    `failed`: it would come again. `damaged`: the archive to resume from is not whole. `unfit`: this machine is not, its disk
    is full say.
    """

    outcome: str
    error: str | None = None


Report: TypeAlias = MetricsReport | EventReport | CheckpointReport | FrameReport | Ended
Order: TypeAlias = Job | Control


class Sender:
    """Writes messages to a binary stream, one whole message at a time. Not thread-safe."""

    def __init__(self, stream: IO[bytes]) -> None:
        self._stream = stream
        self._encoder = msgspec.msgpack.Encoder()

    def send(self, message: Report | Order) -> None:
        """Write a message and flush.

        Raises:
            BrokenPipeError: the other end is gone.
        """
        data = self._encoder.encode(message)
        self._stream.write(_LENGTH.pack(len(data)) + data)
        self._stream.flush()


class Receiver(Generic[T]):
    """Reads messages of one direction from a binary stream.

    Args:
        stream: a buffered stream.
        decoder: knows the messages that may come.
    """

    def __init__(self, stream: IO[bytes], decoder: "msgspec.msgpack.Decoder[T]") -> None:
        self._stream = stream
        self._decoder = decoder

    def receive(self) -> T | None:
        """The next message; None at the end of the stream, also where that cuts a message short."""
        header = self._stream.read(_LENGTH.size)
        if len(header) < _LENGTH.size:
            return None
        (length,) = _LENGTH.unpack(header)
        if length > _MAX_MESSAGE_BYTES:
            raise ValueError(f"a message of {length} bytes: something else was written to the pipe")
        data = self._stream.read(length)
        return self._decoder.decode(data) if len(data) == length else None


def reports(stream: IO[bytes]) -> Receiver[Report]:
    """The task's end of the trainer's reports."""
    return Receiver(stream, msgspec.msgpack.Decoder(Report))


def orders(stream: IO[bytes]) -> Receiver[Order]:
    """The trainer's end of the task's orders."""
    return Receiver(stream, msgspec.msgpack.Decoder(Order))

"""What a worker and the server say to one another: bodies of HTTP requests, and JSON messages on the link of a run.

The worker claims a run, opens its link, and then tells everything that the training reports as *items*: numbered from the
claim's `last_seq` on, without a gap, sent again until the server has acknowledged that they are in the database. An item
that comes twice is the same item. Binary messages on the link are frames (`workers.frames`), neither numbered nor kept.

What the database could not hold, no message holds: the types below say so, and the worker builds its items with them, so
that a fault shows where it is made. Should such an item reach the server all the same (a damaged spool, another version),
it stores what stands before that item, and names it in `Orders.refused`; of a checkpoint's upload it says so with status
422. Either is refused however often it comes: the worker ends the attempt instead of sending it again.
"""

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field, StringConstraints, TypeAdapter

from sim.config import Frozen
from sim.extending.discovery import MAX_EXTENSIONS, installed
from workers.config import TrainingConfig
from workers.reporting import EvaluationResult, EventLevel, WatchRequest

CLOSE_FENCED = 4409
"""WebSocket close code: this attempt is over for the server (a newer one runs, its lease ran out, the run ended)."""

CLOSE_NOT_UNDERSTOOD = 1003
"""WebSocket close code: what came is no message of this protocol, and would be none if it came again."""

HEARTBEAT_SECONDS = 5.0
"""A worker tells this often that it is there, busy or not."""

MAX_BATCH_ITEMS = 500
"""Items in one message, at most: half a megabyte of JSON."""
MAX_MESSAGE_BYTES = 4 * 2**20
"""A message on the link, at most: a frame of 64 robots with 360 rays has 100 kB."""
MAX_ITEM_VALUES = 256
"""Series in one item of metrics, at most."""

MAX_INTEGER = 2**63 - 1
"""Of steps and numbers of items: what both databases hold."""
MAX_TEXT = 10_000
"""Characters of an event's message, or of an error."""
MAX_LOG_LINE = 2_000
"""Characters of a printed line."""
MAX_LOG_LINES = 500
"""Printed lines in one message, at most: some hundred kilobytes."""


def _storable(text: object) -> object:
    """Text for people: what no database holds is shown as a replacement character, and no reason to refuse the rest."""
    if not isinstance(text, str):
        return text
    return text.encode("utf-8", "replace").decode().replace("\0", "\N{REPLACEMENT CHARACTER}")


Step = Annotated[int, Field(ge=0, le=MAX_INTEGER)]
"""An environment step."""
Seq = Annotated[int, Field(ge=1, le=MAX_INTEGER)]
"""The number of an item."""
EpochSeconds = Annotated[float, Field(ge=0.0, le=1e11)]
"""A moment, up to the year 5138."""
SeriesName = Annotated[str, StringConstraints(min_length=1, max_length=64, pattern=r"^[^\x00-\x1f\x7f]+$")]
"""The name of a series of metrics."""
WorkerName = Annotated[str, StringConstraints(min_length=1, max_length=120, pattern=r"^[^\x00-\x1f\x7f]+$")]
"""The name of a worker."""
Text = Annotated[str, BeforeValidator(_storable), Field(max_length=MAX_TEXT)]
"""A line for a person to read."""

Queue = Literal["cpu", "gpu"]
"""The Celery queue that a worker listens to."""

FinalOutcome = Literal["completed", "stopped", "failed", "released", "lost", "damaged"]
"""How an attempt ended.

completed: all steps are done. stopped: as asked to, with a checkpoint. failed: an error that would come again.
released: the worker shuts down, and the run waits for the next one. lost: the trainer died; another attempt may do better.
damaged: the checkpoint that it should have gone on from cannot be read; an older one may be whole.
"""


def device_of(queue: Queue) -> Literal["cpu", "cuda"]:
    """What a worker of this queue trains on, where the training leaves that open."""
    return "cuda" if queue == "gpu" else "cpu"


def queues_of(training: TrainingConfig, began_on: str | None = None) -> tuple[Queue, ...]:
    """The queues whose workers can run this training.

    Args:
        training: the training.
        began_on: the device that "auto" became when it was first claimed: its random numbers go on on that one only.
    """
    device = began_on if training.device == "auto" else training.device
    if device is None:
        return "cpu", "gpu"
    return ("gpu",) if device == "cuda" else ("cpu",)


class ExtensionState(Frozen):
    """An extension that was found where a worker, or the service, runs.

    Attributes:
        name: of the extension.
        version: of the extension; None where it is refused.
        refused: why it is not used; None where it is.
    """

    name: str = Field(max_length=100)
    version: str | None = Field(None, max_length=40)
    refused: Text | None = None


Extensions = Annotated[tuple[ExtensionState, ...], Field(max_length=2 * MAX_EXTENSIONS)]
"""All that were found."""


def found_extensions() -> Extensions:
    """The extensions of this environment."""
    found = installed()
    there = [ExtensionState(name=one.name, version=one.version) for one in found.extensions]
    refused = [ExtensionState(name=one.name[:100], refused=one.reason[:MAX_TEXT]) for one in found.refused[:MAX_EXTENSIONS]]
    return (*there, *refused)


class ClaimRequest(Frozen):
    """A worker wants to run a training.

    Attributes:
        worker: its name.
        published_attempt: the attempt that the message which woke it was published for.
        claim_id: chosen by the worker, new for each run that it takes up: asked again under the same id, because the answer
            got lost, the server grants the same attempt once more. None claims anew each time.
        queue: that it works for, which says on what it trains.
        extensions: that it has.
        any_run: the run that it names is the one that it was woken for; it takes whichever comes first.
    """

    worker: WorkerName
    published_attempt: int = Field(ge=0)
    any_run: bool = False
    claim_id: str | None = Field(None, pattern="^[0-9a-f]{32}$")
    queue: Queue = "cpu"
    extensions: Extensions = ()


class CheckpointReference(Frozen):
    """A registered checkpoint: its archive is at `GET /api/worker/checkpoints/{id}`."""

    id: str
    step: int
    sha256: str


class Claim(Frozen):
    """The run is the worker's for as long as it keeps the lease.

    Attributes:
        run_id: which run it is; None where it is the one that was asked for.
        attempt: the fencing token of everything that follows.
        training: with the device that it is trained on, never "auto".
        last_seq: the number of the last item that the server has; the next one has the next number.
        checkpoint: what to go on from; None for a fresh start.
        start: SHA-256 of the archive whose policy to begin with, at `GET /api/worker/runs/{id}/start`; None where it begins
            with fresh weights, or goes on from a checkpoint.
        lease_seconds: a worker not heard of for this long loses the run.
    """

    run_id: str | None = None
    attempt: int
    seed: int
    training: TrainingConfig
    last_seq: int
    checkpoint: CheckpointReference | None
    start: str | None = None
    lease_seconds: float


Bytes = Annotated[int, Field(ge=0, le=MAX_INTEGER)]
"""Of memory."""


class Gpu(Frozen):
    """A graphics card; `busy` is its share of the last moments, 0 to 1."""

    name: str = Field(max_length=80)
    memory_bytes: Bytes
    used_bytes: Bytes
    busy: float = Field(ge=0.0, le=1.0)


class Machine(Frozen):
    """What a worker runs on.

    Attributes:
        host: its name.
        cores: logical processors.
        load: processes that want one, a minute's mean.
        memory_bytes: that it has; None where it does not tell.
        memory_used_bytes: that no other program could have now; None likewise.
        gpu: None where there is none, or the worker does not train on it.
    """

    host: str = Field(max_length=120)
    cores: int = Field(ge=1, le=100_000)
    load: float = Field(ge=0.0, le=1e6)
    memory_bytes: Bytes | None = None
    memory_used_bytes: Bytes | None = None
    gpu: Gpu | None = None


class Heartbeat(Frozen):
    """A worker is there, busy or not.

    Attributes:
        trouble: why it takes up no run now; None while it does.
        first: since it was started; what was asked of an earlier worker of its name is not asked of it.
        extensions: that it has.
        machine: that it runs on.
    """

    worker: WorkerName
    queue: Queue
    trouble: str | None = Field(None, max_length=10_000)
    first: bool = False
    extensions: Extensions = ()
    machine: Machine | None = None


class HeartbeatAnswer(Frozen):
    """What the server wants of a worker.

    Attributes:
        drain: finish the runs under way, take up no more, and end.
    """

    drain: bool = False


class MetricItem(Frozen):
    """Numbers at an environment step; None stands for one that is not finite, which JSON cannot say."""

    kind: Literal["metrics"] = "metrics"
    seq: Seq
    step: Step
    at: EpochSeconds
    values: dict[SeriesName, float | None] = Field(max_length=MAX_ITEM_VALUES)


class EventItem(Frozen):
    """One line for the run's event log."""

    kind: Literal["event"] = "event"
    seq: Seq
    step: Step
    at: EpochSeconds
    level: EventLevel
    message: Text


Item = Annotated[MetricItem | EventItem, Field(discriminator="kind")]
ITEM: TypeAdapter[MetricItem | EventItem] = TypeAdapter(Item)


class Final(Frozen):
    """The attempt is over, and everything it had to say has been said."""

    outcome: FinalOutcome
    error: Text | None = None


class Batch(Frozen):
    """Worker to server. Every message renews the lease, an empty one does nothing else."""

    items: tuple[Item, ...] = Field((), max_length=MAX_BATCH_ITEMS)
    final: Final | None = None


class Refusal(Frozen):
    """An item that can never be stored: the same item would be refused again, and with it everything behind it.

    Attributes:
        seq: the item's number.
        reason: what is wrong with it, for the run's log.
    """

    seq: Seq
    reason: Text


class Orders(Frozen):
    """Server to worker: how things stand, whole in every message.

    Attributes:
        ack: the number of the last item that is in the database.
        refused: the first item that can never be; None while all is well. The link stays open for the final message.
        stop: write a checkpoint and end.
        watch: what somebody wants to see; None while nobody watches.
        over: the final message is in the database.
    """

    ack: int
    refused: Refusal | None = None
    stop: bool = False
    watch: WatchRequest | None = None
    over: bool = False


class LogLine(Frozen):
    """A line that a trainer has printed, and when."""

    at: EpochSeconds
    text: Annotated[str, BeforeValidator(_storable), Field(max_length=MAX_LOG_LINE)]


class LogBatch(Frozen):
    """Lines for a run's log; sent again until the server has them.

    Attributes:
        first: number of the first one, from 1, among all that the attempt has printed. What is missing was dropped.
        lines: one after another.
    """

    first: int = Field(ge=1, le=MAX_INTEGER)
    lines: tuple[LogLine, ...] = Field(max_length=MAX_LOG_LINES)


class CheckpointUpload(Frozen):
    """The first line of a checkpoint's upload, as JSON; the archive's bytes follow after the line feed.

    Attributes:
        after_seq: the checkpoint is not registered before this item is in the database.
        sha256: of the archive.
        evaluation: of exactly these weights.
    """

    after_seq: int = Field(ge=0, le=MAX_INTEGER)
    sha256: str = Field(pattern="^[0-9a-f]{64}$")
    evaluation: EvaluationResult | None = None

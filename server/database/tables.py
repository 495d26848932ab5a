"""The tables. Times are seconds since the epoch, UTC; the server is the only process that opens the database."""

import time
from typing import Any, Literal

from sqlalchemy import JSON, BigInteger, Boolean, Float, ForeignKey, Index, Integer, LargeBinary, String, Text
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column, relationship

from workers.protocol import Queue
from workers.reporting import EventLevel

RunState = Literal["queued", "running", "stopping", "stopped", "completed", "failed"]


class Base(DeclarativeBase):
    """Declarative base of every table."""


class Experiment(Base):
    """One configuration x several seeds, launched together."""

    __tablename__ = "experiments"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    name: Mapped[str] = mapped_column(String(120))
    training: Mapped[dict[str, Any]] = mapped_column(JSON)
    created_at: Mapped[float] = mapped_column(Float, default=time.time, index=True)
    # Of the paper's reproduction: experiments launched together share the first, the second names the table's row.
    campaign: Mapped[str | None] = mapped_column(String(16), index=True)
    campaign_row: Mapped[str | None] = mapped_column(String(64))

    runs: Mapped[list["Run"]] = relationship(
        back_populates="experiment", cascade="all, delete-orphan", passive_deletes=True, order_by="Run.seed"
    )


class Run(Base):
    """One seed's training. (state, attempt) is what a worker's claim compares and sets.

    `attempt` is the fencing token: it grows by one with every claim, and a message of an older attempt is refused.
    """

    __tablename__ = "runs"
    __table_args__ = (Index("runs_by_state", "state"),)

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    experiment_id: Mapped[str] = mapped_column(ForeignKey("experiments.id", ondelete="CASCADE"), index=True)
    seed: Mapped[int] = mapped_column(BigInteger)
    state: Mapped[RunState] = mapped_column(String(12), default="queued")
    attempt: Mapped[int] = mapped_column(Integer, default=0)
    worker: Mapped[str | None] = mapped_column(String(120))
    # Chosen by the worker that has it: asked again under the same one, its claim is the same.
    claim_id: Mapped[str | None] = mapped_column(String(32))
    # Where the training's device is "auto": the one that it began on, and goes on on.
    device: Mapped[str | None] = mapped_column(String(8))
    # Attempts lost since the last new checkpoint, and how many of them by each worker.
    losses: Mapped[int] = mapped_column(Integer, default=0)
    lost_by: Mapped[dict[str, int] | None] = mapped_column(JSON)
    step: Mapped[int] = mapped_column(BigInteger, default=0)
    last_seq: Mapped[int] = mapped_column(BigInteger, default=0)
    error: Mapped[str | None] = mapped_column(Text)
    created_at: Mapped[float] = mapped_column(Float, default=time.time)
    queued_at: Mapped[float] = mapped_column(Float, default=time.time)
    started_at: Mapped[float | None] = mapped_column(Float)
    finished_at: Mapped[float | None] = mapped_column(Float)

    experiment: Mapped[Experiment] = relationship(back_populates="runs")


class RunEvent(Base):
    """One line of a run's event log."""

    __tablename__ = "run_events"

    id: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id", ondelete="CASCADE"), index=True)
    at: Mapped[float] = mapped_column(Float, default=time.time)
    step: Mapped[int] = mapped_column(BigInteger, default=0)
    level: Mapped[EventLevel] = mapped_column(String(8))
    message: Mapped[str] = mapped_column(Text)


class MetricRow(Base):
    """A numbered message of metrics as it came, until it is compacted into chunks."""

    __tablename__ = "metric_rows"

    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id", ondelete="CASCADE"), primary_key=True)
    seq: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    step: Mapped[int] = mapped_column(BigInteger)
    wall_time: Mapped[float] = mapped_column(Float)
    values: Mapped[dict[str, float | None]] = mapped_column(JSON)


class MetricChunk(Base):
    """Compacted points of one series: zlib over int64 step deltas, float64 wall times and float32 values."""

    __tablename__ = "metric_chunks"

    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id", ondelete="CASCADE"), primary_key=True)
    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    first_step: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    last_step: Mapped[int] = mapped_column(BigInteger)
    count: Mapped[int] = mapped_column(Integer)
    points: Mapped[bytes] = mapped_column(LargeBinary)


class MetricSummary(Base):
    """What a long series looks like: `Buckets` of its first points, and the newest one that they do not hold.

    `last_step` is that of the last point that it knows; what follows is in chunks and rows. Where the newest point was
    cut off, `last_step` is that of the last of the `buckets`; `data` may hold more of them, which were cut off too.
    """

    __tablename__ = "metric_summaries"

    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id", ondelete="CASCADE"), primary_key=True)
    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    buckets: Mapped[int] = mapped_column(Integer)
    last_step: Mapped[int] = mapped_column(BigInteger)
    newest: Mapped[float | None] = mapped_column(Float)
    data: Mapped[bytes] = mapped_column(LargeBinary)


class LatestMetric(Base):
    """The newest value of each series, for lists."""

    __tablename__ = "latest_metrics"

    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id", ondelete="CASCADE"), primary_key=True)
    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    step: Mapped[int] = mapped_column(BigInteger)
    value: Mapped[float] = mapped_column(Float)


class Checkpoint(Base):
    """A policy at a step of a run, with the state to resume it; its archive lies in the file store under its id."""

    __tablename__ = "checkpoints"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id", ondelete="CASCADE"), index=True)
    step: Mapped[int] = mapped_column(BigInteger)
    size: Mapped[int] = mapped_column(BigInteger)
    sha256: Mapped[str] = mapped_column(String(64))
    created_at: Mapped[float] = mapped_column(Float, default=time.time)
    # When its archive was found damaged or gone: no run goes on from it any more. Null while it is whole.
    damaged_at: Mapped[float | None] = mapped_column(Float)


class LooseArchive(Base):
    """An archive of this database in the file store that no checkpoint names (any more): on its way in, or out."""

    __tablename__ = "loose_archives"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    since: Mapped[float] = mapped_column(Float)
    doomed: Mapped[bool] = mapped_column(Boolean)


class Evaluation(Base):
    """A checkpoint on a suite; `episodes` is zlib-compressed JSON, one object per episode in the suite's order."""

    __tablename__ = "evaluations"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    checkpoint_id: Mapped[str] = mapped_column(ForeignKey("checkpoints.id", ondelete="CASCADE"), index=True)
    suite: Mapped[str] = mapped_column(String(64))
    suite_hash: Mapped[str] = mapped_column(String(64))
    created_at: Mapped[float] = mapped_column(Float, default=time.time)
    episode_count: Mapped[int] = mapped_column(Integer)
    arrivals: Mapped[int] = mapped_column(Integer)
    # Of the episodes that arrived; null where none did.
    steps_mean: Mapped[float | None] = mapped_column(Float)
    reward_mean: Mapped[float] = mapped_column(Float)
    episodes: Mapped[bytes] = mapped_column(LargeBinary)


class Worker(Base):
    """A worker process that has been heard of."""

    __tablename__ = "workers"

    name: Mapped[str] = mapped_column(String(120), primary_key=True)
    queue: Mapped[Queue] = mapped_column(String(8))
    last_seen: Mapped[float] = mapped_column(Float)
    # Why it takes up no run, in its own words; null while it does.
    trouble: Mapped[str | None] = mapped_column(Text)
    # When it was asked to finish its runs and take up no more; null unless it was.
    drained_at: Mapped[float | None] = mapped_column(Float)

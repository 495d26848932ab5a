"""The tables. Times are seconds since the epoch, UTC; the server is the only process that opens the database."""

import time
from typing import Any, Literal

from sqlalchemy import (
    JSON,
    BigInteger,
    Boolean,
    Float,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    String,
    Text,
    UniqueConstraint,
    text,
)
from sqlalchemy.orm import DeclarativeBase, Mapped, mapped_column, relationship

from workers.job_protocol import JobKind
from workers.protocol import Queue
from workers.reporting import EventLevel

RunState = Literal["queued", "running", "stopping", "stopped", "completed", "failed"]
Role = Literal["viewer", "editor", "admin"]
TokenScope = Literal["read", "launch", "admin"]
JobState = Literal["queued", "running", "done", "failed", "cancelled"]
StudyState = Literal["running", "judging", "done", "stopped"]
TrialState = Literal["running", "complete", "pruned", "failed", "stopped"]
AlertEvent = Literal["ended", "failed", "diagnosis", "success", "stuck", "disk"]
AlertChannel = Literal["browser", "webhook", "mail"]
AlertFormat = Literal["json", "slack", "discord", "teams"]
AlertState = Literal["waiting", "sending", "sent", "failed", "unclear", "withheld"]


class Base(DeclarativeBase):
    """Declarative base of every table."""


# Of the project that every database begins with: what is launched into none is its.
DEFAULT_PROJECT = "default"


class Project(Base):
    """What belongs together: experiments, and the people who may see them."""

    __tablename__ = "projects"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    name: Mapped[str] = mapped_column(String(80), unique=True)
    created_at: Mapped[float] = mapped_column(Float, default=time.time)


class Experiment(Base):
    """One configuration x several seeds, launched together."""

    __tablename__ = "experiments"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    project_id: Mapped[str] = mapped_column(ForeignKey("projects.id"), index=True, default=DEFAULT_PROJECT)
    name: Mapped[str] = mapped_column(String(120))
    training: Mapped[dict[str, Any]] = mapped_column(JSON)
    created_at: Mapped[float] = mapped_column(Float, default=time.time, index=True)
    # Of the paper's reproduction: experiments launched together share the first, the second names the table's row.
    campaign: Mapped[str | None] = mapped_column(String(16), index=True)
    campaign_row: Mapped[str | None] = mapped_column(String(64))
    # Of the study that it is a trial of.
    study_id: Mapped[str | None] = mapped_column(ForeignKey("studies.id", ondelete="SET NULL"), index=True)
    # Markdown.
    notes: Mapped[str | None] = mapped_column(Text)
    starred_at: Mapped[float | None] = mapped_column(Float)
    archived_at: Mapped[float | None] = mapped_column(Float)
    # In the trash since then; what lies there for long is removed.
    deleted_at: Mapped[float | None] = mapped_column(Float, index=True)
    # The form of the settings under which `ExperimentKey` has them; another one than this version's, and they are due.
    indexed_as: Mapped[str | None] = mapped_column(String(12), index=True)
    # Id of the account in whose name it was launched; null for the installation's own token. No foreign key: it may go.
    launched_by: Mapped[str | None] = mapped_column(String(16))
    # How many of its runs may be under way at a time; null for what the installation's settings say.
    parallel_runs: Mapped[int | None] = mapped_column(Integer)
    # Of its checkpoints, and of those that a rule has taken; kept by `server.checkpoints.sums`.
    checkpoint_count: Mapped[int] = mapped_column(Integer, default=0, server_default="0")
    checkpoint_bytes: Mapped[int] = mapped_column(BigInteger, default=0, server_default="0")
    going_count: Mapped[int] = mapped_column(Integer, default=0, server_default="0")
    going_bytes: Mapped[int] = mapped_column(BigInteger, default=0, server_default="0")
    # Which of its checkpoints stay (`server.storage.rule`); null for what the installation's settings say.
    keep_rule: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    # How fine the curves of its runs stay; null for what the installation's settings say.
    curve_rule: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))

    runs: Mapped[list["Run"]] = relationship(
        back_populates="experiment", cascade="all, delete-orphan", passive_deletes=True, order_by="Run.seed"
    )


START_KEY = "start_from.name"
"""The key of what an experiment began with: a checkpoint's id, or a shipped policy's name."""


class Study(Base):
    """A training over ranges of settings, tried one after another.

    (state, asked) is what whoever asks for the next trial compares and sets: two servers never ask for the same one.
    """

    __tablename__ = "studies"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    project_id: Mapped[str] = mapped_column(ForeignKey("projects.id"), index=True)
    name: Mapped[str] = mapped_column(String(120))
    # What is searched and how (`server.studies.schemas.StudySpec`).
    spec: Mapped[dict[str, Any]] = mapped_column(JSON)
    state: Mapped[StudyState] = mapped_column(String(12), default="running", index=True)
    # As of an experiment: its trials are launched in that name.
    launched_by: Mapped[str | None] = mapped_column(String(16))
    # Trials that it may have, and those that it has had.
    budget: Mapped[int] = mapped_column(Integer)
    asked: Mapped[int] = mapped_column(Integer, default=0)
    created_at: Mapped[float] = mapped_column(Float, default=time.time, index=True)
    finished_at: Mapped[float | None] = mapped_column(Float)
    # That its complete trials were measured on.
    suite_hash: Mapped[str | None] = mapped_column(String(64))
    # Share of each setting, by its path; null before there is anything to say.
    importances: Mapped[dict[str, float] | None] = mapped_column(JSON(none_as_null=True))
    # How sure they are: `trials` that they are of, `spans` of each by its path; null before they were looked at.
    importance_intervals: Mapped[dict[str, Any] | None] = mapped_column(JSON(none_as_null=True))
    # The trial whose settings were trained anew with fresh seeds, and that training; no foreign key: it may be deleted.
    judged_trial: Mapped[int | None] = mapped_column(Integer)
    judgement_id: Mapped[str | None] = mapped_column(String(16))


class StudyTrial(Base):
    """One choice of a study's settings, trained with every tuning seed."""

    __tablename__ = "study_trials"

    study_id: Mapped[str] = mapped_column(ForeignKey("studies.id", ondelete="CASCADE"), primary_key=True)
    # From 0.
    number: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=False)
    # No foreign key: it may be deleted. Null where the settings make no training.
    experiment_id: Mapped[str | None] = mapped_column(String(16))
    state: Mapped[TrialState] = mapped_column(String(12), default="running")
    # Value of each searched setting, by its path.
    values: Mapped[dict[str, Any]] = mapped_column(JSON)
    # Success rates at every evaluation, by seed (`server.studies.rules.SeedRungs`).
    rungs: Mapped[dict[str, list[float | None]]] = mapped_column(JSON)
    # Of a complete one.
    success: Mapped[float | None] = mapped_column(Float)
    seconds_to_target: Mapped[float | None] = mapped_column(Float)
    score: Mapped[float | None] = mapped_column(Float)
    # Seconds that its runs were trained for, together.
    cost: Mapped[float | None] = mapped_column(Float)
    # Why it was stopped early, or failed.
    reason: Mapped[str | None] = mapped_column(Text)
    created_at: Mapped[float] = mapped_column(Float, default=time.time)
    finished_at: Mapped[float | None] = mapped_column(Float)


class ExperimentKey(Base):
    """One value of an experiment's settings under its dotted name ("algorithm.gamma"), to filter, sort and group by.

    A number is in `number`, everything else in `text`, cut to its length.
    """

    __tablename__ = "experiment_keys"
    __table_args__ = (Index("experiment_keys_by_key", "key"),)

    experiment_id: Mapped[str] = mapped_column(ForeignKey("experiments.id", ondelete="CASCADE"), primary_key=True)
    key: Mapped[str] = mapped_column(String(160), primary_key=True)
    number: Mapped[float | None] = mapped_column(Float)
    text: Mapped[str | None] = mapped_column(String(200))


class ExperimentTag(Base):
    """A word that people have put on an experiment."""

    __tablename__ = "experiment_tags"

    experiment_id: Mapped[str] = mapped_column(ForeignKey("experiments.id", ondelete="CASCADE"), primary_key=True)
    tag: Mapped[str] = mapped_column(String(40), primary_key=True, index=True)


class SavedView(Base):
    """A view of the table of trainings under a name: the query of its address."""

    __tablename__ = "saved_views"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    name: Mapped[str] = mapped_column(String(80), unique=True)
    address: Mapped[str] = mapped_column(Text)
    created_at: Mapped[float] = mapped_column(Float, default=time.time)


class Run(Base):
    """One seed's training. (state, attempt) is what a worker's claim compares and sets.

    `attempt` is the fencing token: it grows by one with every claim, and a message of an older attempt is refused.
    """

    __tablename__ = "runs"
    __table_args__ = (
        Index("runs_by_state", "state"),
        Index("runs_by_end", "finished_at"),
        Index("runs_by_thinning", "thins_at"),
    )

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    experiment_id: Mapped[str] = mapped_column(ForeignKey("experiments.id", ondelete="CASCADE"), index=True)
    seed: Mapped[int] = mapped_column(BigInteger)
    state: Mapped[RunState] = mapped_column(String(12), default="queued")
    attempt: Mapped[int] = mapped_column(Integer, default=0)
    worker: Mapped[str | None] = mapped_column(String(120))
    # Chosen by the worker that has it: asked again under the same one, its claim is the same.
    claim_id: Mapped[str | None] = mapped_column(String(32))
    # Id of the workers' token that it was claimed with; null for the installation's own.
    claimed_with: Mapped[str | None] = mapped_column(String(16))
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
    # The highest is claimed first, of equal ones who has waited longest.
    priority: Mapped[int] = mapped_column(Integer, default=0, server_default="0")
    started_at: Mapped[float | None] = mapped_column(Float)
    finished_at: Mapped[float | None] = mapped_column(Float)
    # Of its last evaluated checkpoint, for lists of many.
    final_step: Mapped[int | None] = mapped_column(BigInteger)
    final_suite: Mapped[str | None] = mapped_column(String(64))
    final_arrivals: Mapped[int | None] = mapped_column(Integer)
    final_episodes: Mapped[int | None] = mapped_column(Integer)
    # When its curves are thinned, because a rule says so; null while they stay as they are.
    thins_at: Mapped[float | None] = mapped_column(Float)
    # No curve of it that could be thinned has more points; null where nobody has looked since it ended.
    thin_enough: Mapped[int | None] = mapped_column(Integer)
    # When they were thinned last; from how many points to how many, all series of `ThinnedSeries` together.
    thinned_at: Mapped[float | None] = mapped_column(Float)
    thinned_from: Mapped[int | None] = mapped_column(BigInteger)
    thinned_to: Mapped[int | None] = mapped_column(BigInteger)

    experiment: Mapped[Experiment] = relationship(back_populates="runs")


class Share(Base):
    """When somebody was last given a worker for a run, as the number of the turn; nobody's name is the empty one."""

    __tablename__ = "shares"

    person: Mapped[str] = mapped_column(String(16), primary_key=True)
    turn: Mapped[int] = mapped_column(BigInteger)


class RunEvent(Base):
    """One line of a run's event log."""

    __tablename__ = "run_events"

    id: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id", ondelete="CASCADE"), index=True)
    at: Mapped[float] = mapped_column(Float, default=time.time)
    step: Mapped[int] = mapped_column(BigInteger, default=0)
    level: Mapped[EventLevel] = mapped_column(String(8))
    message: Mapped[str] = mapped_column(Text)


class RunLogChunk(Base):
    """Lines that a run's trainer printed one after another: zlib over JSON, a pair of time and text each.

    `first` is the number of the first one among all that the attempt has printed, from 1; `size` counts bytes of text.
    """

    __tablename__ = "run_log_chunks"

    id: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=True)
    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id", ondelete="CASCADE"), index=True)
    attempt: Mapped[int] = mapped_column(Integer)
    first: Mapped[int] = mapped_column(BigInteger)
    count: Mapped[int] = mapped_column(Integer)
    size: Mapped[int] = mapped_column(Integer)
    lines: Mapped[bytes] = mapped_column(LargeBinary)


class MetricRow(Base):
    """A numbered message of metrics as it came, until it is compacted into chunks."""

    __tablename__ = "metric_rows"

    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id", ondelete="CASCADE"), primary_key=True)
    seq: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    step: Mapped[int] = mapped_column(BigInteger)
    wall_time: Mapped[float] = mapped_column(Float)
    values: Mapped[dict[str, float | None]] = mapped_column(JSON)


class MetricAxis(Base):
    """Steps and wall times of points, which the chunks of a run's series that were reported together have in common.

    `id` is a digest of what they are, so that equal ones are found to be one (`server.metrics.points`).
    """

    __tablename__ = "metric_axes"

    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id", ondelete="CASCADE"), primary_key=True)
    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    data: Mapped[bytes] = mapped_column(LargeBinary)


class MetricChunk(Base):
    """Compacted points of one series: their values, which lie where `axis` says.

    Those from before there were axes have none: they are zlib over int64 step deltas, float64 wall times and float32 values.
    """

    __tablename__ = "metric_chunks"
    __table_args__ = (Index("metric_chunks_by_axis", "run_id", "axis"),)

    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id", ondelete="CASCADE"), primary_key=True)
    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    first_step: Mapped[int] = mapped_column(BigInteger, primary_key=True, autoincrement=False)
    last_step: Mapped[int] = mapped_column(BigInteger)
    count: Mapped[int] = mapped_column(Integer)
    points: Mapped[bytes] = mapped_column(LargeBinary)
    axis: Mapped[str | None] = mapped_column(String(16))


class MetricSummary(Base):
    """What a long series looks like: `Buckets` of its first points, and the newest one that they do not hold.

    `last_step` is that of the last point that it knows; what follows is in chunks and rows. Where the newest point was
    cut off, `last_step` is that of the last of the `buckets`, and `newest` says nothing any more; `data` may hold more
    buckets, which were cut off too.
    """

    __tablename__ = "metric_summaries"

    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id", ondelete="CASCADE"), primary_key=True)
    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    buckets: Mapped[int] = mapped_column(Integer)
    last_step: Mapped[int] = mapped_column(BigInteger)
    newest: Mapped[float | None] = mapped_column(Float)
    data: Mapped[bytes] = mapped_column(LargeBinary)


class ThinnedSeries(Base):
    """What is left of a series' first points, up to `last_step`: `Buckets`, of which the chunks hold the means.

    `points` counts what they stand for, `buckets` how many they are.
    """

    __tablename__ = "thinned_series"

    run_id: Mapped[str] = mapped_column(ForeignKey("runs.id", ondelete="CASCADE"), primary_key=True)
    name: Mapped[str] = mapped_column(String(64), primary_key=True)
    points: Mapped[int] = mapped_column(BigInteger)
    buckets: Mapped[int] = mapped_column(Integer)
    last_step: Mapped[int] = mapped_column(BigInteger)
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
    # When it goes, because a rule took it; null while it stays.
    goes_at: Mapped[float | None] = mapped_column(Float, index=True)


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
    # What it said of the extensions that were found where it runs (`workers.protocol.ExtensionState`).
    extensions: Mapped[list[dict[str, str | None]] | None] = mapped_column(JSON)
    # What it said of its machine (`workers.protocol.Machine`).
    machine: Mapped[dict[str, Any] | None] = mapped_column(JSON)
    # Seconds in which it had a run, by the number of the six hours since the epoch; of a week.
    activity: Mapped[dict[str, float] | None] = mapped_column(JSON)
    # The run that it took up last, which may have been deleted.
    last_run_id: Mapped[str | None] = mapped_column(String(16))


class User(Base):
    """A person with an account; `issuer` and `subject` are of who signs in with a provider of identities."""

    __tablename__ = "users"
    __table_args__ = (UniqueConstraint("issuer", "subject"),)

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    # In lower case: what is typed to sign in.
    name: Mapped[str] = mapped_column(String(80), unique=True)
    email: Mapped[str | None] = mapped_column(String(254), unique=True)
    password_hash: Mapped[str | None] = mapped_column(Text)
    issuer: Mapped[str | None] = mapped_column(String(255))
    subject: Mapped[str | None] = mapped_column(String(255))
    # Of the whole installation: every project, people, and the log of what was done.
    admin: Mapped[bool] = mapped_column(Boolean, default=False)
    disabled_at: Mapped[float | None] = mapped_column(Float)
    created_at: Mapped[float] = mapped_column(Float, default=time.time)


class Membership(Base):
    """What a person may do in a project."""

    __tablename__ = "memberships"

    project_id: Mapped[str] = mapped_column(ForeignKey("projects.id", ondelete="CASCADE"), primary_key=True)
    user_id: Mapped[str] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), primary_key=True, index=True)
    role: Mapped[Role] = mapped_column(String(8))


class Invitation(Base):
    """A link that makes an account, adds a project to one, or sets its password; once, and not for ever.

    Secrets of this table and those below are kept as their SHA-256: they are too long to be guessed.
    """

    __tablename__ = "invitations"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    hash: Mapped[str] = mapped_column(String(64), unique=True)
    # Whose password is set; null where somebody joins.
    user_id: Mapped[str | None] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"))
    project_id: Mapped[str | None] = mapped_column(ForeignKey("projects.id", ondelete="CASCADE"))
    role: Mapped[Role | None] = mapped_column(String(8))
    admin: Mapped[bool] = mapped_column(Boolean, default=False)
    note: Mapped[str] = mapped_column(String(120), default="")
    invited_by: Mapped[str] = mapped_column(String(120))
    created_at: Mapped[float] = mapped_column(Float, default=time.time)
    expires_at: Mapped[float] = mapped_column(Float)
    used_at: Mapped[float | None] = mapped_column(Float)


class LoginSession(Base):
    """A browser that somebody signed in with."""

    __tablename__ = "sessions"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    user_id: Mapped[str] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), index=True)
    hash: Mapped[str] = mapped_column(String(64), unique=True)
    # Of the secret before: requests that were under way when it changed bring it.
    previous_hash: Mapped[str | None] = mapped_column(String(64), index=True)
    rotated_at: Mapped[float] = mapped_column(Float, default=time.time)
    created_at: Mapped[float] = mapped_column(Float, default=time.time)
    seen_at: Mapped[float] = mapped_column(Float, default=time.time)
    expires_at: Mapped[float] = mapped_column(Float)
    address: Mapped[str] = mapped_column(String(64))
    browser: Mapped[str] = mapped_column(String(200))


class ApiToken(Base):
    """A person's token for programs: at most what the person may, within `scope` and `projects` (null: all)."""

    __tablename__ = "api_tokens"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    user_id: Mapped[str] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), index=True)
    name: Mapped[str] = mapped_column(String(80))
    hash: Mapped[str] = mapped_column(String(64), unique=True)
    scope: Mapped[TokenScope] = mapped_column(String(8))
    projects: Mapped[list[str] | None] = mapped_column(JSON(none_as_null=True))
    created_at: Mapped[float] = mapped_column(Float, default=time.time)
    expires_at: Mapped[float | None] = mapped_column(Float)
    seen_at: Mapped[float | None] = mapped_column(Float)
    revoked_at: Mapped[float | None] = mapped_column(Float)


class WorkerToken(Base):
    """A token for the workers of one machine; its name stands in the log of every run that they take up."""

    __tablename__ = "worker_tokens"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    name: Mapped[str] = mapped_column(String(80))
    hash: Mapped[str] = mapped_column(String(64), unique=True)
    created_at: Mapped[float] = mapped_column(Float, default=time.time)
    seen_at: Mapped[float | None] = mapped_column(Float)
    revoked_at: Mapped[float | None] = mapped_column(Float)


class AuditEntry(Base):
    """Who did what: written with it in one transaction, and never changed (a trigger refuses it).

    Nothing of it hangs on another table: it outlives what it tells of.
    """

    __tablename__ = "audit_entries"

    id: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=True)
    at: Mapped[float] = mapped_column(Float, default=time.time, index=True)
    actor: Mapped[str] = mapped_column(String(120), index=True)
    user_id: Mapped[str | None] = mapped_column(String(16))
    address: Mapped[str] = mapped_column(String(64))
    action: Mapped[str] = mapped_column(String(40), index=True)
    target: Mapped[str | None] = mapped_column(String(64))
    name: Mapped[str | None] = mapped_column(String(254))
    project_id: Mapped[str | None] = mapped_column(String(16), index=True)
    details: Mapped[str | None] = mapped_column(Text)


class Job(Base):
    """Something that somebody asked for beside trainings. (state, attempt) is what a worker's claim compares and sets.

    `key` says what comes out of it: what is asked for twice is one job for as long as it is open.
    """

    __tablename__ = "jobs"
    __table_args__ = (
        Index("jobs_by_state", "state", "priority", "created_at"),
        Index(
            "open_jobs_by_key",
            "key",
            unique=True,
            sqlite_where=text("state IN ('queued', 'running')"),
            postgresql_where=text("state IN ('queued', 'running')"),
        ),
    )

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    kind: Mapped[JobKind] = mapped_column(String(12))
    key: Mapped[str] = mapped_column(String(120))
    title: Mapped[str] = mapped_column(String(200))
    spec: Mapped[dict[str, Any]] = mapped_column(JSON)
    # Of the policy's archive; null where the job needs none.
    sha256: Mapped[str | None] = mapped_column(String(64))
    state: Mapped[JobState] = mapped_column(String(12), default="queued")
    priority: Mapped[int] = mapped_column(Integer)
    attempt: Mapped[int] = mapped_column(Integer, default=0)
    worker: Mapped[str | None] = mapped_column(String(120))
    claim_id: Mapped[str | None] = mapped_column(String(32))
    # Attempts lost, and how many of them by each worker.
    losses: Mapped[int] = mapped_column(Integer, default=0)
    lost_by: Mapped[dict[str, int] | None] = mapped_column(JSON)
    error: Mapped[str | None] = mapped_column(Text)
    created_at: Mapped[float] = mapped_column(Float, default=time.time)
    started_at: Mapped[float | None] = mapped_column(Float)
    finished_at: Mapped[float | None] = mapped_column(Float)


class UploadedPolicy(Base):
    """An ONNX file of somebody's, to be measured."""

    __tablename__ = "uploaded_policies"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    project_id: Mapped[str] = mapped_column(ForeignKey("projects.id"), index=True)
    name: Mapped[str] = mapped_column(String(120))
    # Robot, LiDAR and observation that it is for.
    task: Mapped[dict[str, Any]] = mapped_column(JSON)
    sha256: Mapped[str] = mapped_column(String(64))
    size: Mapped[int] = mapped_column(Integer)
    created_at: Mapped[float] = mapped_column(Float, default=time.time, index=True)
    graph: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)


class Bag(Base):
    """What a robot recorded, as somebody uploaded it: MCAP, rosbag2's SQLite, or an archive of these."""

    __tablename__ = "bags"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    project_id: Mapped[str] = mapped_column(ForeignKey("projects.id"), index=True)
    name: Mapped[str] = mapped_column(String(120))
    sha256: Mapped[str] = mapped_column(String(64))
    size: Mapped[int] = mapped_column(Integer)
    created_at: Mapped[float] = mapped_column(Float, default=time.time, index=True)
    content: Mapped[bytes] = mapped_column(LargeBinary, deferred=True)


class OwnSuite(Base):
    """Scenarios that people put together: `sha256` and `name` of arenas that bring a start and a target."""

    __tablename__ = "own_suites"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    name: Mapped[str] = mapped_column(String(80), unique=True)
    scenarios: Mapped[list[dict[str, str]]] = mapped_column(JSON)
    created_at: Mapped[float] = mapped_column(Float, default=time.time)


class PolicyEvaluation(Base):
    """A policy or a baseline on a suite that somebody asked for; without figures until its job is done."""

    __tablename__ = "policy_evaluations"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    # No foreign key: jobs are forgotten after a while.
    job_id: Mapped[str] = mapped_column(String(16), index=True)
    key: Mapped[str] = mapped_column(String(120), index=True)
    title: Mapped[str] = mapped_column(String(200))
    policy: Mapped[dict[str, Any]] = mapped_column(JSON)
    choice: Mapped[dict[str, Any]] = mapped_column(JSON)
    # Of its policy, where it is a run's or was uploaded; no foreign keys: what was measured stays.
    checkpoint_id: Mapped[str | None] = mapped_column(String(16), index=True)
    upload_id: Mapped[str | None] = mapped_column(String(16), index=True)
    created_at: Mapped[float] = mapped_column(Float, default=time.time, index=True)
    # Why there will be no figures.
    error: Mapped[str | None] = mapped_column(Text)
    # Null until the job is done.
    suite: Mapped[str | None] = mapped_column(String(64))
    suite_hash: Mapped[str | None] = mapped_column(String(64), index=True)
    figures: Mapped[dict[str, Any] | None] = mapped_column(JSON)
    # What was driven with: robot, LiDAR and limits.
    task: Mapped[dict[str, Any] | None] = mapped_column(JSON, deferred=True)
    # Zlib-compressed JSON, as of `Evaluation`; and of where the robots drove (`workers.job_protocol.Measurement`).
    episodes: Mapped[bytes | None] = mapped_column(LargeBinary, deferred=True)
    ways: Mapped[bytes | None] = mapped_column(LargeBinary, deferred=True)


class AlertRule(Base):
    """Of what somebody wants to hear, and how."""

    __tablename__ = "alert_rules"

    id: Mapped[str] = mapped_column(String(16), primary_key=True)
    # Whose it is; null for who holds the token of the installation.
    user_id: Mapped[str | None] = mapped_column(ForeignKey("users.id", ondelete="CASCADE"), index=True)
    # Null for every project that its person may see.
    project_id: Mapped[str | None] = mapped_column(ForeignKey("projects.id", ondelete="CASCADE"))
    event: Mapped[AlertEvent] = mapped_column(String(12))
    # Success rate, minutes in the queue, or GiB that are free; null for the other events.
    threshold: Mapped[float | None] = mapped_column(Float)
    channel: Mapped[AlertChannel] = mapped_column(String(8))
    # A URL or an address; null for the browser.
    target: Mapped[str | None] = mapped_column(Text)
    format: Mapped[AlertFormat] = mapped_column(String(8))
    # Signs what a webhook is sent: it is kept as it is, for a signature takes it whole.
    secret: Mapped[str | None] = mapped_column(String(64))
    enabled: Mapped[bool] = mapped_column(Boolean, default=True)
    created_at: Mapped[float] = mapped_column(Float, default=time.time)


class Alert(Base):
    """What a rule has had to say. `key` names the rule and what happened: nothing is said twice.

    Who sends one says so first (`sending`), until `next_at`; where that has passed, it ended in between, and whether the
    message arrived is unclear. Of one that waits, `next_at` is when it is due.
    """

    __tablename__ = "alerts"
    __table_args__ = (Index("alerts_by_state", "state", "next_at"), Index("alerts_by_rule", "rule_id", "created_at"))

    id: Mapped[int] = mapped_column(Integer, primary_key=True, autoincrement=True)
    rule_id: Mapped[str] = mapped_column(ForeignKey("alert_rules.id", ondelete="CASCADE"))
    key: Mapped[str] = mapped_column(String(120), unique=True)
    created_at: Mapped[float] = mapped_column(Float, default=time.time, index=True)
    title: Mapped[str] = mapped_column(String(200))
    text: Mapped[str] = mapped_column(Text)
    project_id: Mapped[str | None] = mapped_column(String(16))
    experiment_id: Mapped[str | None] = mapped_column(String(16))
    run_id: Mapped[str | None] = mapped_column(String(16))
    state: Mapped[AlertState] = mapped_column(String(8))
    tries: Mapped[int] = mapped_column(Integer, default=0)
    next_at: Mapped[float | None] = mapped_column(Float)
    sent_at: Mapped[float | None] = mapped_column(Float)
    # What went wrong, in a sentence; null where nothing did.
    outcome: Mapped[str | None] = mapped_column(Text)

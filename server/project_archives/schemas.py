"""What stands in a project's archive, and what came of one that was brought in.

manifest.json                     ArchiveManifest
arenas/SHA256.json                an imported arena that its trainings or evaluations use (ArenaFile)
policies/POLICY.json              ArchivedPolicy
policies/POLICY.onnx              the file of a policy that was uploaded
recordings/RECORDING.json         ArchivedRecording
recordings/RECORDING.bag          the file that a robot recorded
studies/STUDY.json                ArchivedStudy
EXPERIMENT/experiment.json        ArchivedExperiment
EXPERIMENT/RUN/run.json           ArchivedRun
EXPERIMENT/RUN/CHECKPOINT.zip     the archive of a checkpoint
EXPERIMENT/RUN/CHECKPOINT.json    its evaluation, where it has one
EXPERIMENT/RUN/NUMBER.points      a line of JSON (ArchivedPoints), then the points as the database keeps them
EXPERIMENT/RUN/NUMBER.thinned     a line of JSON (ArchivedPoints), then the buckets of a series of which points are means
EXPERIMENT/RUN/NUMBER.log         lines that its trainer printed (ArchivedLog)
EXPERIMENT/RUN/end                behind all of a run
evaluations/EVALUATION.json       ArchivedAskedEvaluation
"""

from typing import Annotated, Any, Literal

from pydantic import Field, StringConstraints

from server.bags.schemas import MAX_BAG_BYTES
from server.database.tables import RunState, StudyState, TrialState
from server.evaluations.schemas import EvaluationFigures
from server.evaluations.ways import KeptWays
from server.schemas import Schema
from server.uploads.schemas import MAX_FILE_BYTES
from sim.config import TaskConfig
from workers.job_protocol import AnyPolicy, SuiteChoice
from workers.reporting import EvaluationResult, EventLevel

Id = Annotated[str, StringConstraints(pattern=r"^[0-9a-z]{1,16}$")]
Text = Annotated[str, StringConstraints(pattern=r"^[^\x00]*$", max_length=100_000)]
ShortLine = Annotated[str, StringConstraints(pattern=r"^[^\x00-\x1f\x7f]+$", max_length=120)]
Time = Annotated[float, Field(ge=0.0, le=1e11)]
Sha256 = Annotated[str, StringConstraints(pattern=r"^[0-9a-f]{64}$")]
Step = Annotated[int, Field(ge=0, lt=2**62)]


class ArchiveManifest(Schema):
    """What an archive is.

    Those of the first format have neither studies nor logs, of the second nothing of `Kind`, of the third no thinned curves,
    of the fourth no evaluations of what is everybody's, of the fifth no recordings of robots.
    """

    format: Literal[1, 2, 3, 4, 5, 6] = 6
    version: ShortLine
    project: ShortLine


class ArchivedExperiment(Schema):
    """An experiment without its runs."""

    id: Id
    name: ShortLine
    training: dict[str, Any]
    created_at: Time
    notes: Text | None
    starred_at: Time | None
    archived_at: Time | None
    tags: list[Annotated[ShortLine, StringConstraints(max_length=40)]] = Field(max_length=100)
    campaign: Id | None = None
    campaign_row: Annotated[ShortLine, StringConstraints(max_length=64)] | None = None
    study_id: Id | None = None


class ArchivedTrial(Schema):
    """One choice of a study's settings."""

    number: int = Field(ge=0, lt=2**31)
    experiment_id: Id | None
    state: TrialState
    values: dict[str, Any]
    rungs: dict[str, list[float | None]]
    success: float | None
    seconds_to_target: float | None
    score: float | None
    cost: float | None
    reason: Text | None
    created_at: Time
    finished_at: Time | None


class ArchivedStudy(Schema):
    """A study with its trials."""

    id: Id
    name: ShortLine
    spec: dict[str, Any]
    state: StudyState
    budget: int = Field(ge=0, lt=2**31)
    asked: int = Field(ge=0, lt=2**31)
    created_at: Time
    finished_at: Time | None
    suite_hash: Annotated[ShortLine, StringConstraints(max_length=64)] | None
    importances: dict[str, float] | None
    judged_trial: int | None = Field(ge=0, lt=2**31)
    judgement_id: Id | None
    trials: list[ArchivedTrial] = Field(max_length=100_000)


class ArchivedLog(Schema):
    """Lines that one attempt of a run printed one after another, each with its time; `first` counts from 1."""

    attempt: int = Field(ge=0, lt=2**31)
    first: int = Field(ge=1, lt=2**62)
    lines: list[tuple[float, Text]] = Field(min_length=1, max_length=100_000)


class ArchivedEvent(Schema):
    """A line of a run's events."""

    at: Time
    step: Step
    level: EventLevel
    message: Text


class ArchivedCheckpoint(Schema):
    """A checkpoint without its archive."""

    id: Id
    step: Step
    created_at: Time
    size: int = Field(ge=1)
    sha256: Sha256


class ArchivedRun(Schema):
    """A run without its points, and without its checkpoints' archives and evaluations."""

    id: Id
    seed: int = Field(ge=0, lt=2**63)
    state: RunState
    attempt: int = Field(ge=0, lt=2**31)
    step: Step
    last_seq: Step
    error: Text | None
    created_at: Time
    started_at: Time | None
    finished_at: Time | None
    thinned_at: Time | None = None
    events: list[ArchivedEvent] = Field(max_length=100_000)
    checkpoints: list[ArchivedCheckpoint] = Field(max_length=100_000)


class ArchivedEvaluation(Schema):
    """What a checkpoint achieved, episode by episode."""

    created_at: Time
    result: EvaluationResult


class ArchivedPoints(Schema):
    """A piece of one series, or the buckets of one."""

    name: Annotated[ShortLine, StringConstraints(max_length=64)]
    count: int = Field(ge=1, le=2**18)


class ArchivedPolicy(Schema):
    """An uploaded policy without its file."""

    id: Id
    name: ShortLine
    task: TaskConfig
    sha256: Sha256
    size: int = Field(ge=1, le=MAX_FILE_BYTES)
    created_at: Time


class ArchivedRecording(Schema):
    """What a robot recorded, without its file; it is read anew where it comes to, with the same outcome."""

    id: Id
    name: ShortLine
    sha256: Sha256
    size: int = Field(ge=1, le=MAX_BAG_BYTES)
    created_at: Time


class ArchivedAskedEvaluation(Schema):
    """An evaluation that was asked for, and measured, or given up for a reason.

    Of the project's checkpoints and uploaded policies, or of a shipped policy or a baseline.
    """

    id: Id
    title: Annotated[ShortLine, StringConstraints(max_length=200)]
    policy: AnyPolicy
    choice: SuiteChoice
    created_at: Time
    error: Text | None
    figures: EvaluationFigures | None
    task: TaskConfig | None
    result: EvaluationResult | None
    ways: KeptWays | None


class ImportedRun(Schema):
    """What came of a run."""

    id: str
    experiment_id: str
    outcome: Literal["imported", "there", "refused"] = Field(
        description="`there`: it had been imported before, and is left as it is."
    )
    why: str | None = Field(description="Why it was refused.")


Kind = Literal["arena", "policy", "recording", "evaluation"]


class ImportedThing(Schema):
    """What came of something beside the runs."""

    kind: Kind
    id: str = Field(description="Its id; of an arena its hash.")
    outcome: Literal["imported", "there", "refused"]
    why: str | None = Field(description="Why it was refused.")


class ProjectImport(Schema):
    """What came of an archive."""

    project_id: str
    runs: list[ImportedRun] = Field(max_length=10_000)
    checkpoints: int = Field(description="That came with the imported runs.")
    others: list[ImportedThing] = Field(
        [], description="Arenas, uploaded policies, robots' recordings, and evaluations that were asked for."
    )

"""What a job worker and the server say to one another: bodies of HTTP requests (pydantic only).

A *job* is what somebody asks for beside trainings: a view of a finished policy, a replay, a film, an export, an evaluation,
the reading of a robot's recording. It is claimed, leased and fenced as a run is (`workers.protocol`); what comes out is
one file, checked by size and SHA-256.

worker                                            server
  | POST  /jobs/claim            JobClaimRequest ---> |  waits for a job to come; 204 where none did
  | GET   /jobs/{id}/archive                     ---> |  the policy's archive, where the job has one
  | GET   /jobs/{id}/recordings/{n}              ---> |  of a film: what its n-th policy did
  | GET   /jobs/{id}/bag                         ---> |  the robot's recording, where the job reads one
  | POST  /jobs/{id}/report      JobReport       ---> |  renews the lease; 409 where the job is no longer wanted
  | POST  /jobs/{id}/frames      frames          ---> |  of a view, each after its length; answered as a report
  | POST  /jobs/{id}/seen        PlaySeen        ---> |  of a playground; answered as a report
  | PUT   /jobs/{id}/result      the file's bytes ---> |
  | PUT   /jobs/{id}/recording   the file's bytes ---> |  of an evaluation: so that nobody waits for its replays
  | POST  /jobs/{id}/end         JobEnd          ---> |
"""

from typing import Annotated, Literal, Self

from pydantic import Field, TypeAdapter, model_validator

from sim.config import AnyArenaConfig, ArenaFile, Frozen, TaskConfig
from sim.kernels.room import MAX_TERMS
from workers.bags.results import TopicChoice
from workers.film_protocol import Film
from workers.play_protocol import PlayOrders
from workers.protocol import Extensions, Text, WorkerName
from workers.reporting import EvaluationResult, Figure, WatchRequest

JobKind = Literal["view", "play", "replay", "film", "bag", "export", "evaluate"]
"""What may be asked for; those that somebody waits for come first."""

KINDS: tuple[JobKind, ...] = ("view", "play", "replay", "film", "bag", "export", "evaluate")
"""In the order in which they are taken up: who looks never waits behind what goes on unwatched."""

Identifier = Annotated[str, Field(min_length=1, max_length=64, pattern=r"^[a-z0-9-]+$")]
FRAME_LENGTH_BYTES = 4
"""Of the number before each frame, little-endian."""
MAX_FRAMES_BYTES = 4 * 2**20
"""Of the frames in one request."""


MAX_WAY_POINTS = 64
"""Of the line that shows where a robot drove."""
Point = tuple[Figure, Figure]
"""x and y, metres."""


class CheckpointPolicy(Frozen):
    """The policy of a checkpoint."""

    source: Literal["checkpoint"] = "checkpoint"
    id: Identifier


class ShippedPolicyName(Frozen):
    """A policy that ships."""

    source: Literal["shipped"] = "shipped"
    name: Identifier


class BaselineName(Frozen):
    """A controller that needs no training, by the name that it has in tables (`sim.baselines.named.TABLED`).

    It drives the robot of `task`; without one the robot that the suite's rules ask for, or the default one.
    """

    source: Literal["baseline"] = "baseline"
    name: Literal[
        "random",
        "go-to-goal",
        "dynamic window",
        "VFH+",
        "MPPI",
        "mapping, A* and dynamic window",
        "ORCA, told where people are",
    ]
    task: TaskConfig | None = None


class UploadedPolicy(Frozen):
    """An ONNX file that somebody has uploaded.

    Attributes:
        id: of the upload.
        task: that it is for; the server puts it in, whatever a request says.
    """

    source: Literal["uploaded"] = "uploaded"
    id: Identifier
    task: TaskConfig | None = None


ArchivedPolicy = Annotated[CheckpointPolicy | ShippedPolicyName, Field(discriminator="source")]
PlayedPolicy = Annotated[CheckpointPolicy | ShippedPolicyName | UploadedPolicy, Field(discriminator="source")]
AnyPolicy = Annotated[CheckpointPolicy | ShippedPolicyName | BaselineName | UploadedPolicy, Field(discriminator="source")]


class NamedSuite(Frozen):
    """A suite by its name: a frozen one, or that of the policy's own task."""

    by: Literal["name"] = "name"
    name: str = Field(min_length=1, max_length=64, pattern=r"^[^\x00-\x1f\x7f]+$")


class ArenaSuite(Frozen):
    """The suite that is drawn for an arena: a family at a difficulty, an imported one, a built-in one."""

    by: Literal["arena"] = "arena"
    arena: AnyArenaConfig


class OwnSuite(Frozen):
    """The suite of the policy's own task."""

    by: Literal["own"] = "own"


MAX_SCENARIOS = 100
"""Of a suite that people put together."""


class ScenarioSuite(Frozen):
    """A suite that people put together: the start and target of each of its arenas.

    Attributes:
        id: of the suite; all else the server puts in, whatever a request says.
        name: that it has.
        arenas: their hashes, as they were when the suite was asked for.
        documents: these arenas, for the worker alone.
    """

    by: Literal["scenarios"] = "scenarios"
    id: Identifier
    name: str = Field("", max_length=40)
    arenas: tuple[str, ...] = Field((), max_length=MAX_SCENARIOS)
    documents: tuple[ArenaFile, ...] = Field((), max_length=MAX_SCENARIOS)

    @property
    def title(self) -> str:
        """What its scores stand under; with how many scenarios, since more may come."""
        return f"{self.name} ({len(self.arenas)})"


OWN_SUITE = OwnSuite()

SuiteChoice = Annotated[NamedSuite | ArenaSuite | ScenarioSuite | OwnSuite, Field(discriminator="by")]


class ViewJob(Frozen):
    """Drive by a policy, for whoever watches."""

    kind: Literal["view"] = "view"
    policy: ArchivedPolicy


class PlayJob(Frozen):
    """Drive by a policy in an arena that people change meanwhile.

    Attributes:
        policy: which one.
        arena: as it was at first; orders say how it is now.
    """

    kind: Literal["play"] = "play"
    policy: PlayedPolicy
    arena: ArenaFile


class ReplayJob(Frozen):
    """Drive an evaluation again, and record what every robot did (`workers.replays.recording`)."""

    kind: Literal["replay"] = "replay"
    policy: AnyPolicy
    suite: SuiteChoice = OWN_SUITE


class FilmJob(Frozen):
    """Make a film of recordings that are kept (`workers.replays.films`)."""

    kind: Literal["film"] = "film"
    film: Film


class ExportJob(Frozen):
    """The deployment bundle, compared with torch."""

    kind: Literal["export"] = "export"
    policy: ArchivedPolicy


class BagJob(Frozen):
    """Read a robot's recording; the file is a `BagReading`, or with a policy a `BagBeside`, as JSON.

    Attributes:
        bag: its id.
        bag_sha256: of its file.
        topics: that are read.
        policy: that is held beside what the robot did; None to read the recording alone.
        title: of the policy.
    """

    kind: Literal["bag"] = "bag"
    bag: Identifier
    bag_sha256: str
    topics: TopicChoice = TopicChoice()
    policy: PlayedPolicy | None = None
    title: str = ""


class EvaluateJob(Frozen):
    """A policy on a suite; the file is a `Measurement` as JSON."""

    kind: Literal["evaluate"] = "evaluate"
    policy: AnyPolicy
    suite: SuiteChoice = OWN_SUITE


WatchedJob = ViewJob | PlayJob
"""What lasts for as long as somebody looks, and brings no file."""
JobSpec = Annotated[ViewJob | PlayJob | ReplayJob | FilmJob | BagJob | ExportJob | EvaluateJob, Field(discriminator="kind")]
JOB_SPEC: TypeAdapter[ViewJob | PlayJob | ReplayJob | FilmJob | BagJob | ExportJob | EvaluateJob] = TypeAdapter(JobSpec)


SLOW_BASELINES: frozenset[str] = frozenset({"MPPI", "mapping, A* and dynamic window"})
"""They plan anew at every step: minutes for what takes others seconds."""


def is_long(spec: JobSpec) -> bool:
    """Whether a job goes on for minutes: it keeps no place that what takes seconds could have."""
    return isinstance(spec, EvaluateJob) and isinstance(spec.policy, BaselineName) and spec.policy.name in SLOW_BASELINES


class Measurement(Frozen):
    """What comes out of an evaluation that was asked for.

    Attributes:
        result: how every episode ended.
        task: robot, LiDAR and limits that were driven with; the arenas are the suite's.
        arenas: the suite's, to draw.
        arena_indices: (S,) the arena of each episode.
        targets: (S,) x and y of each, metres.
        ways: (S,) where each robot drove: up to `MAX_WAY_POINTS` points x, y from its start to its end, metres.
        jerks: (S,) mean size of the jerk along each robot's heading, m/s3; 0 for episodes of fewer than three steps.
        terms: names of the reward's terms; none from workers of before they were told apart.
        returns: (S, terms) each term summed over each episode; empty where no term is named.
    """

    result: EvaluationResult
    task: TaskConfig
    arenas: tuple[ArenaFile, ...] = Field(min_length=1)
    arena_indices: tuple[int, ...]
    targets: tuple[Point, ...]
    ways: tuple[tuple[Point, ...], ...]
    jerks: tuple[Figure, ...]
    terms: tuple[Annotated[str, Field(min_length=1, max_length=200)], ...] = Field((), max_length=MAX_TERMS)
    returns: tuple[tuple[Figure, ...], ...] = ()

    @model_validator(mode="after")
    def _one_each(self) -> Self:
        lengths = {len(self.result.episodes), *map(len, (self.arena_indices, self.targets, self.ways, self.jerks))}
        if len(lengths) > 1:
            raise ValueError("every episode has one arena, one target, one way and one jerk")
        if not all(0 <= index < len(self.arenas) for index in self.arena_indices):
            raise ValueError("an episode's arena is not among the arenas")
        if any(len(way) > MAX_WAY_POINTS for way in self.ways):
            raise ValueError(f"a way has at most {MAX_WAY_POINTS} points")
        if len(self.returns) != (len(self.result.episodes) if self.terms else 0):
            raise ValueError("every episode has its returns by term where terms are named")
        if any(len(row) != len(self.terms) for row in self.returns):
            raise ValueError("every term has its return in every episode")
        return self


class JobClaimRequest(Frozen):
    """A worker has a place for a job.

    Attributes:
        worker: its name.
        claim_id: chosen by the worker, new for each job that it takes up: asked again under the same id, because the answer
            got lost, the server grants the same attempt once more.
        kinds: that this place takes.
        long: whether it takes what goes on for minutes (`is_long`).
        extensions: that the worker has.
        wait_seconds: for a job to come.
    """

    worker: WorkerName
    claim_id: str = Field(pattern="^[0-9a-f]{32}$")
    kinds: tuple[JobKind, ...] = Field(min_length=1, max_length=len(KINDS))
    long: bool = True
    extensions: Extensions = ()
    wait_seconds: float = Field(10.0, ge=0.0, le=30.0)


class JobClaim(Frozen):
    """The job is the worker's for as long as it keeps the lease.

    Attributes:
        id: of the job.
        attempt: the fencing token of everything that follows.
        spec: what to do, imported arenas with their geometry.
        sha256: of the policy's archive; None where it has none.
        lease_seconds: a worker not heard of for this long loses the job.
        ahead: nobody waits for it: it leaves the processors to what somebody waits for.
    """

    id: str
    attempt: int
    spec: JobSpec
    sha256: str | None
    lease_seconds: float
    ahead: bool = False


class JobReport(Frozen):
    """A sign of life.

    Attributes:
        progress: share of the work that is done, 0 to 1.
    """

    progress: float = Field(0.0, ge=0.0, le=1.0)


class JobOrders(Frozen):
    """What the server wants of whoever has the job.

    Attributes:
        watch: of a view, what somebody wants to see; None while nobody looks.
        play: of a playground, all of it; None where the worker has heard of that revision.
    """

    watch: WatchRequest | None = None
    play: PlayOrders | None = None


class JobEnd(Frozen):
    """The worker's last word.

    Attributes:
        outcome: done; failed: it would fail again; lost: another attempt may do better; released: the worker ends.
        error: what went wrong, for people.
    """

    outcome: Literal["done", "failed", "lost", "released"]
    error: Text | None = None

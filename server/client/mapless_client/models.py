"""What the server answers, as far as a program needs it. What a newer server says besides is left out.

Times are seconds since the epoch, rates 0 to 1; intervals are those of 95 %.
"""

from typing import Any, Literal, TypeAlias

from pydantic import BaseModel, ConfigDict

RunState: TypeAlias = Literal["queued", "running", "stopping", "stopped", "completed", "failed"]
ENDED: frozenset[RunState] = frozenset({"stopped", "completed", "failed"})
Json: TypeAlias = dict[str, Any]


class Model(BaseModel):
    """Base of all answers."""

    model_config = ConfigDict(frozen=True, extra="ignore")


class Estimate(Model):
    """A measured number with its interval, over `unit`: all seeds that one could train, or one policy's episodes."""

    value: float
    low: float
    high: float
    unit: str
    seeds: int
    episodes: int
    per_seed: list[float]


class SeedMean(Model):
    """A mean over runs; its interval is None for one run."""

    value: float
    low: float | None
    high: float | None
    runs: int


class ListedExperiment(Model):
    """A training in the list. `runs` is how many it has, `progress` over all of them."""

    id: str
    project_id: str
    name: str
    created_at: float
    arena: str
    robot: str
    algorithm: str
    network: str
    state: RunState | Literal["mixed"]
    runs: int
    progress: float
    seconds_left: float | None
    success: Estimate | None
    tags: list[str]
    starred: bool
    archived: bool
    settings: dict[str, float | str]
    metrics: dict[str, SeedMean]


class Trial(Model):
    """One choice of a study's settings, by path; `reason` says why it was stopped early or failed."""

    number: int
    state: Literal["running", "complete", "pruned", "failed", "stopped"]
    values: dict[str, bool | int | float | str | list[int | float]]
    experiment_id: str | None
    progress: float
    success: float | None
    seconds_to_target: float | None
    cost: float | None
    reason: str | None


class Judgement(Model):
    """The best trial's settings, trained with seeds that the search never saw."""

    trial: int
    experiment_id: str
    success: Estimate | None


class Span(Model):
    """From where to where."""

    low: float
    high: float


class ImportanceIntervals(Model):
    """95 % intervals of a study's importances over its complete trials; `told` says of what, or why there are none."""

    unit: Literal["trials"]
    trials: int
    spans: dict[str, Span]
    told: str


class Study(Model):
    """A search over settings of a training. `trials` may be had, `asked` were; `best` is a trial's number."""

    id: str
    project_id: str
    name: str
    created_at: float
    state: Literal["running", "judging", "done", "stopped"]
    trials: int
    asked: int
    complete: int
    pruned: int
    failed: int
    progress: float
    seconds_left: float | None
    best: int | None
    best_success: float | None
    results: list[Trial]
    importances: dict[str, float] | None
    importance_intervals: ImportanceIntervals | None = None
    judgement: Judgement | None


class Thinned(Model):
    """What was done to the curves of a run that ended long ago: of `points` points `kept` buckets are left, `since` then."""

    since: float
    points: int
    kept: int


class Run(Model):
    """One seed's training. `step` counts environment steps; `error` says why it failed.

    `thinned` is None where every point of its curves is kept; a server of before does not tell.
    """

    id: str
    experiment_id: str
    seed: int
    state: RunState
    attempt: int
    step: int
    total_steps: int
    steps_per_second: float | None
    seconds_left: float | None
    success_rate: float | None
    eval_success_rate: float | None
    worker: str | None
    error: str | None
    created_at: float
    started_at: float | None
    finished_at: float | None
    thinned: Thinned | None = None

    @property
    def ended(self) -> bool:
        """Whether nothing more happens to it by itself."""
        return self.state in ENDED


class Experiment(Model):
    """One configuration x several seeds; `training` is the configuration as the launch form's JSON."""

    id: str
    project_id: str
    name: str
    created_at: float
    training: Json
    state: RunState | Literal["mixed"]
    runs: list[Run]
    success: Estimate | None

    @property
    def ended(self) -> bool:
        """Whether all of its runs have."""
        return all(run.ended for run in self.runs)


class Project(Model):
    """Trainings that belong together, and what the token may do in them."""

    id: str
    name: str
    created_at: float
    experiments: int
    role: str


class ImportedRun(Model):
    """What came of a run of an archive: `imported`, `there` (it was before), or `refused`, with why."""

    id: str
    experiment_id: str
    outcome: str
    why: str | None


class ImportedThing(Model):
    """What came of something beside the runs: an `arena`, a `policy`, a robot's `recording`, or an asked `evaluation`."""

    kind: str
    id: str
    outcome: str
    why: str | None


class ProjectImport(Model):
    """What came of an archive; `checkpoints` came with the runs that are new. A server of before told of no `others`."""

    project_id: str
    runs: list[ImportedRun]
    checkpoints: int
    others: list[ImportedThing] = []


class RunEvent(Model):
    """A line of a run's event log."""

    id: int
    at: float
    step: int
    level: str
    message: str


class Evaluation(Model):
    """A checkpoint on a suite. Only those of one `suite_hash` may be compared."""

    suite: str
    suite_hash: str
    episodes: int
    arrivals: int
    success: Estimate
    steps_mean: float | None
    reward_mean: float


class Checkpoint(Model):
    """A policy at a step of a run; `size` in bytes, `best` of its run."""

    id: str
    step: int
    size: int
    sha256: str
    created_at: float
    damaged: bool
    best: bool
    evaluation: Evaluation | None


class Evidence(Model):
    """A number behind a diagnosis: of a curve, None where it is not finite; and what a healthy run has."""

    metric: str
    value: float | None
    expected: str


class Diagnosis(Model):
    """Something that is wrong with a run, and what to try, the most promising first."""

    id: str
    severity: Literal["warning", "error"]
    title: str
    explanation: str
    evidence: list[Evidence]
    advice: list[str]
    step: int


class Diagnoses(Model):
    """What a run's curves say about it; `diagnoses` is empty for a healthy one."""

    run_id: str
    step: int
    diagnoses: list[Diagnosis]


class ComparedExperiment(Model):
    """A training's final figures, over the last evaluated checkpoint of each of its runs."""

    id: str
    name: str
    seeds: int
    episodes: int
    suite: str | None
    suite_hash: str | None
    success: Estimate | None
    steps_per_target: Estimate | None
    reward: Estimate | None


class Difference(Model):
    """A setting in which trainings differ: one value each, in their order."""

    path: str
    values: list[Any]


class PairedTest(Model):
    """Two trainings' policies on the same scenarios: speaks of these policies, not of further seeds."""

    test: str
    scenarios: int
    better: int
    worse: int
    p: float
    p_holm: float


class ComparisonVerdict(Model):
    """What may be said of a training beside another, the base; `difference` is other less base.

    `p_holm` and that of `paired` are Holm's, after as many comparisons as there are.
    """

    measure: str
    base: str
    other: str
    word: str
    difference: float | None
    low: float | None
    high: float | None
    margin: float
    p: float | None
    p_holm: float | None
    paired: PairedTest | None
    reason: str


class Improvement(Model):
    """How likely a seed of `other` scores higher than one of `base` in a scenario, with a 95 % interval over seeds."""

    base: str
    other: str
    value: float
    low: float
    high: float


class Comparison(Model):
    """Trainings side by side, in the order asked for."""

    experiments: list[ComparedExperiment]
    verdicts: list[ComparisonVerdict]
    comparisons: int
    improvements: list[Improvement]
    differences: list[Difference]
    warnings: list[str]


class Bag(Model):
    """A robot's recording that was uploaded; `size` in bytes."""

    id: str
    project_id: str
    name: str
    sha256: str
    size: int
    created_at: float


class Fitted(Model):
    """A quantity that a recording tells; None is what it can't tell, or a side without a bound."""

    key: str
    title: str
    unit: str
    value: float | None
    low: float | None
    high: float | None
    note: str


class Setting(Model):
    """A setting of a task, as a recording has it; `path` leads to it within the task."""

    path: list[str]
    title: str
    value: float | list[int]


class BagReading(Model):
    """What a recording tells of its robot; `seconds` is how long it lasts, `notes` what one should know of it."""

    seconds: float
    notes: list[str]
    fitted: list[Fitted]
    settings: list[Setting]

    def task(self) -> Json:
        """The settings as a launch takes them: `launch(name, {"task": reading.task()})`."""
        task: Json = {}
        for setting in self.settings:
            part = task
            for key in setting.path[:-1]:
                part = part.setdefault(key, {})
            part[setting.path[-1]] = setting.value
        return task

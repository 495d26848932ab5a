"""The training loop: collect, update, evaluate, report, save; the same for every algorithm."""

import math
import platform
import time
from collections.abc import Callable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Literal, NoReturn

import numpy as np
import torch
from numpy.typing import NDArray

from sim.actions import action_layout
from sim.arenas import with_maps_of
from sim.arrays import PolicyFunction
from sim.envs.vector import NavigationVectorEnv
from sim.observations import observation_layout
from sim.suites import suite_for
from workers.algorithms import build_algorithm
from workers.algorithms.base import Guided, Threaded, with_prefix, without_prefix
from workers.archive_size import refuse_too_large
from workers.checkpoints import (
    Checkpoint,
    read_checkpoint,
    read_manifest,
    read_policy,
    sha256_of,
    write_checkpoint,
)
from workers.config import TrainingConfig
from workers.errors import ArchiveMismatchError, NoDeviceError, NonFiniteError
from workers.live.viewing import TrainingViewer, Unwatched
from workers.manifest import STATE_ARRAYS, Effort, EvaluationSummary, Manifest, Number, Observation, TrainingCounters
from workers.misfit import misfit
from workers.networks.inputs import inputs_of
from workers.networks.layout import layout
from workers.policy import Policy, torch_policy
from workers.reporting import EvaluationResult, Reporter
from workers.start import StartFrom
from workers.training.drives import drive
from workers.training.effort import EffortMeter
from workers.training.evaluation import evaluate, evaluation_metrics
from workers.training.metrics import TrainingMetrics
from workers.training.threads import ThreadCount
from workers.wording import counted

TrainingOutcome = Literal["completed", "stopped"]

# Five reports a second are smooth to the eye and cost nothing.
REPORT_INTERVAL = 0.2
"""Least wall time between two reports of metrics, in seconds."""

# A failure is repeated within seconds.
_REMEMBER_INTERVAL = 5.0


def train(
    config: TrainingConfig,
    seed: int,
    reporter: Reporter,
    directory: Path,
    resume: Path | None = None,
    start: Path | None = None,
    *,
    viewer: TrainingViewer | None = None,
    report_interval: float = REPORT_INTERVAL,
) -> TrainingOutcome:
    """Trains until the configured steps are done, or until the reporter asks to stop.

    Sets torch to one thread: several trainings share a machine better than several threads share a small matrix.

    Args:
        config: what to train.
        seed: of weights, exploration and environment, each a stream of its own (`sim.streams`).
        reporter: where metrics, events, checkpoints and frames go, and who may ask to stop.
        directory: for checkpoint archives, 'step-<n>.zip'.
        resume: an archive of the same training, to continue bit for bit where it was written.
        start: the archive of `config.start_from`, needed where that is set and nothing is resumed.
        viewer: what makes frames; None is a training that nobody can watch.
        report_interval: least wall time between two reports of metrics, in seconds.

    Returns:
        'completed', or 'stopped' when it was asked to; either way the last checkpoint holds the last weights.

    Raises:
        NonFiniteError: the weights are no longer finite numbers.
        MemoryTooLargeError: its replay memory would not fit into a checkpoint.
        NetworkError: the module of its network is not one that can be trained, saved and resumed.
        NoDeviceError: this machine does not have the device that it asks for.
        ArchiveError: `resume` is damaged, or belongs to another training; `start` is damaged, or does not fit.
    """
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)  # Adam's moments of dead units decay into numbers that the processor handles slowly
    viewer = viewer or Unwatched()
    try:
        training = Training(with_device(config, resume), seed, reporter, directory, viewer, report_interval)
        if resume is not None:
            training.resume(resume)
        elif config.start_from is not None:
            training.begin_with(config.start_from, start)
        return training.run()
    finally:
        viewer.close()
        torch.set_flush_denormal(False)


class Training:
    """The state of one training and the stages of its loop."""

    def __init__(
        self,
        config: TrainingConfig,
        seed: int,
        reporter: Reporter,
        directory: Path,
        viewer: TrainingViewer,
        report_interval: float,
    ) -> None:
        self.config, self.seed, self.reporter, self.directory, self.viewer = config, seed, reporter, directory, viewer
        self.report_interval = report_interval
        self.effort = EffortMeter(Effort())
        refuse_too_large(config)
        self.suite = suite_for(config.task)
        self.observation_layout, self.inputs = observation_layout(config.task), inputs_of(config.task)
        self.actions = action_layout(config.task.robot)
        device = torch.device(config.device)
        self.algorithm = build_algorithm(config.algorithm, self.inputs, seed, device, self.actions)
        self.threaded = self.algorithm if isinstance(self.algorithm, Threaded) else None
        self.threads = ThreadCount(config.threads)
        self.task = with_maps_of(config.task, seed)
        guided = self.algorithm if isinstance(self.algorithm, Guided) and self.algorithm.is_guided else None
        self.env = NavigationVectorEnv(self.task, self.algorithm.robots, seed=seed, copy=False, guides=guided is not None)
        if guided is not None:
            guided.guidance = self.env.guidance
        self.observations, _ = self.env.reset(seed=seed)
        self.metrics = TrainingMetrics(self.algorithm.robots, actions=self.actions)
        self.steps_per_update = self.algorithm.steps_per_update * self.algorithm.robots
        self.total_updates = math.ceil(config.steps / self.steps_per_update)
        self.step = self.updates = self.evaluations = 0
        self.reported = self.saved = -1
        self.remembered: Callable[[], Checkpoint] | None = None
        self.remembered_at = 0.0

    def run(self) -> TrainingOutcome:
        """The loop."""
        while self.updates < self.total_updates:
            if self.reporter.stop_requested:
                self.report(None)
                self.save(None)
                return "stopped"
            self.remember()
            self.collect()
            self.update()
            if self.evaluation_due:
                result = self.evaluate()
                self.report(result)
                if self.checkpoint_due:
                    self.save(result)
            elif self.reported < 0 or self.metrics.seconds >= self.report_interval:
                self.report(None)
        return "completed"

    def collect(self) -> None:
        """Steps of all robots with the exploring policy, remembered by the algorithm."""
        algorithm, env = self.algorithm, self.env
        inference = simulation = 0.0
        clock: Callable[[], float] = time.perf_counter
        for _ in range(algorithm.steps_per_update):
            started = clock()
            actions = algorithm.act(self.observations)
            acted = clock()
            self.observations, rewards, terminations, truncations, _ = env.step(actions)
            stepped = clock()
            algorithm.record(self.observations, rewards, terminations, truncations, env.final_observations)
            self.effort.ended(self.metrics.step(env, self.observations, actions, rewards))
            self.step += algorithm.robots
            self.viewer.on_step(env, self.step)
            simulation += stepped - acted
            inference += clock() - stepped + acted - started
        self.metrics.spend("simulation", simulation)
        self.metrics.spend("inference", inference)

    def update(self) -> None:
        """One update of the algorithm."""
        if self.threaded is not None:
            # The simulator's too, until the next update: a look that is taken while two threads compute sees the other one.
            self.threaded.threads = self.env.threads = self.threads.now()
        with self.metrics.phase("update"):
            diagnostics = self.algorithm.update(self.updates / self.total_updates)
            self.updates += 1
        self.metrics.update(diagnostics)
        if not self.algorithm.finite:
            self.fail()
        self.viewer.on_weights(lambda: self.policy(lambda policy: policy), self.step)

    def fail(self) -> NoReturn:
        """The weights are no longer numbers: says so, and saves the last state that was remembered before it.

        Resuming that checkpoint repeats the failure bit for bit: a training depends on state and configuration only.
        """
        self.metrics.update({"policy/finite": 0.0})
        self.report(None)
        assert self.remembered is not None
        remembered = self.remembered()
        step = remembered.counters.step
        if step != self.saved:
            archive = self.directory / f"step-{step}.zip"
            write_checkpoint(archive, remembered)
            self.reporter.checkpoint(step, archive, None)
        raise NonFiniteError(
            f"the weights became infinite or NaN in the update at step {self.step}: lower the learning rate or the gradient "
            f"clipping, check the reward's size; resuming the checkpoint of step {step} repeats it"
        )

    @property
    def evaluation_due(self) -> bool:
        """Whether an evaluation step was passed since the last one, or the training is at its end."""
        passed = self.step // self.config.evaluation.every_steps
        return passed > self.evaluations or self.updates == self.total_updates

    @property
    def checkpoint_due(self) -> bool:
        """Whether the evaluation just made keeps a checkpoint."""
        evaluation = self.config.evaluation
        interval = evaluation.every_steps * evaluation.evaluations_per_checkpoint
        return self.updates == self.total_updates or self.step // interval > max(self.saved, 0) // interval

    def evaluate(self) -> EvaluationResult:
        """The deterministic policy on the task's frozen suite."""
        with self.metrics.phase("evaluation"):
            self.evaluations = self.step // self.config.evaluation.every_steps
            return evaluate(self.policy(torch_policy), self.config.task, self.suite)

    def drive(self) -> dict[str, float]:
        """The finished policy as the paper's tables measure one, where the training asks for that."""
        config = self.config.evaluation
        if not config.drives or self.updates < self.total_updates:
            return {}
        with self.metrics.phase("evaluation"):
            return drive(self.policy(torch_policy), self.task, config.drives, config.drive_steps).metrics()

    def policy(self, runner: Callable[[Policy], PolicyFunction]) -> PolicyFunction:
        """A copy of the newest deterministic policy."""
        weights = self.algorithm.policy_weights()
        return runner(Policy(self.config.algorithm.network, weights, self.inputs, self.actions))

    def report(self, result: EvaluationResult | None) -> None:
        """Everything since the last report, and the evaluation of this step if there is one."""
        if self.metrics.empty:
            return
        arrival_distance = self.config.task.arrival_distance
        measured = {} if result is None else {**evaluation_metrics(result, arrival_distance), **self.drive()}
        values = self.metrics.flush()
        values.update(measured | self.effort.metrics())
        with self.metrics.phase("reporting"):
            self.reporter.metrics(self.step, values)
        self.reported = self.step

    def remember(self) -> None:
        """Keeps the whole state now and then, from which a failure can be repeated; a replay memory is not copied for it."""
        now = time.monotonic()
        if self.remembered is not None and now - self.remembered_at < _REMEMBER_INTERVAL:
            return
        manifest, weights, counters = self._manifest(None), self.algorithm.policy_weights(), self._counters()
        algorithm, environment = self.algorithm.snapshot(), self._environment_arrays()
        self.remembered = lambda: Checkpoint(
            manifest, weights, {**with_prefix("algorithm", algorithm()), **environment}, counters
        )
        self.remembered_at = now

    def checkpoint(self, result: EvaluationResult | None) -> Checkpoint:
        """A copy of the whole state; `result` belongs to exactly these weights."""
        arrays = {**with_prefix("algorithm", self.algorithm.state()), **self._environment_arrays()}
        return Checkpoint(self._manifest(result), self.algorithm.policy_weights(), arrays, self._counters())

    def save(self, result: EvaluationResult | None) -> None:
        """A checkpoint of this step, unless there is one."""
        if self.saved == self.step:
            return
        with self.metrics.phase("reporting"):
            archive = self.directory / f"step-{self.step}.zip"
            write_checkpoint(archive, self.checkpoint(result))
            self.reporter.checkpoint(self.step, archive, result)
        self.saved = self.step

    def resume(self, archive: Path) -> None:
        """Continues where the archive was written.

        Raises:
            ArchiveMismatchError: it belongs to another training.
        """
        checkpoint = read_checkpoint(archive)
        theirs, ours = checkpoint.manifest.training, self.config
        if (theirs.task, theirs.algorithm, checkpoint.manifest.seed) != (ours.task, ours.algorithm, self.seed):
            raise ArchiveMismatchError(
                f"{archive.name} is of a training with another task, algorithm or seed: resume it with its own configuration"
            )
        if (device := _trained_on(checkpoint)) != ours.device:
            raise ArchiveMismatchError(
                f"{archive.name} was trained on {device}, whose random numbers {ours.device} does not have: "
                f"resume it with the device {device}"
            )
        self.algorithm.load_state(without_prefix("algorithm", checkpoint.arrays))
        self.env.set_state(without_prefix("environment", checkpoint.arrays))
        self.observations = np.array(checkpoint.arrays["observations"], np.float32)
        counters = checkpoint.counters
        self.step, self.updates, self.evaluations = counters.step, counters.updates, counters.evaluations
        self.reported = self.saved = counters.step
        self.metrics = TrainingMetrics(self.algorithm.robots, self.step // self.algorithm.robots, self.actions)
        self.effort.resume(counters.effort)
        self.reporter.event(self.step, "info", f"Resumed at step {counted(self.step)}.")

    def begin_with(self, start: StartFrom, archive: Path | None) -> None:
        """Begins with the policy of another training, and keeps it as a checkpoint of step 0 of its own.

        The networks are taken over, the policy always, the critic and what it needs where the archive holds the state of an
        algorithm of the same name. Optimisers, exploration, schedules, memories and random streams begin as configured.

        Raises:
            ArchiveMismatchError: it is not the archive that was meant, or its policy does not fit.
            ArchiveError: it is damaged.
        """
        title = start.title or start.name
        if archive is None:
            raise ArchiveMismatchError(f"this training starts from {title}: bring its archive along")
        with archive.open("rb") as file:
            if start.sha256 not in (None, sha256_of(file)):
                raise ArchiveMismatchError(f"{archive.name} is not the archive of {title} that this training starts from")
        manifest, policy = read_policy(archive)
        if (problem := misfit(manifest.training, self.config)) is not None:
            raise ArchiveMismatchError(f"{title} does not fit this training: {problem}")
        state = None
        if STATE_ARRAYS in manifest.files and manifest.training.algorithm.name == self.config.algorithm.name:
            state = without_prefix("algorithm", read_checkpoint(archive).arrays)
        taken = " and ".join(("policy", *self.algorithm.begin_with(policy.weights, state)))
        self.reporter.event(0, "info", f"Starts from {title}: its {taken}.")
        result = self.evaluate()
        measured = evaluation_metrics(result, self.config.task.arrival_distance)
        self.reporter.metrics(0, measured | self.effort.metrics())
        self.save(result)

    def _counters(self) -> TrainingCounters:
        return TrainingCounters(
            step=self.step, updates=self.updates, evaluations=self.evaluations, effort=self.effort.read()
        )

    def _environment_arrays(self) -> dict[str, NDArray[np.generic]]:
        return {
            **with_prefix("environment", self.env.get_state()),
            "observations": self.observations.copy(),
        }

    def _manifest(self, result: EvaluationResult | None) -> Manifest:
        return Manifest(
            training=self.config,
            seed=self.seed,
            step=self.step,
            observation=Observation(
                name=self.observation_layout.name,
                version=self.observation_layout.version,
                numbers=tuple(
                    Number(index=index, name=number.name, meaning=number.formula, low=number.low, high=number.high)
                    for index, number in enumerate(self.observation_layout.numbers)
                ),
            ),
            action=tuple(
                Number(index=index, name=component.name, meaning=component.meaning, low=component.low, high=1.0)
                for index, component in enumerate(self.actions.components)
            ),
            network=layout(self.config.algorithm.network, self.inputs, self.actions),
            evaluation=_summary(result),
            versions=_versions(),
            files={},
        )


def _summary(result: EvaluationResult | None) -> EvaluationSummary | None:
    if result is None:
        return None
    return EvaluationSummary(
        suite=result.suite,
        suite_hash=result.suite_hash,
        episodes=len(result.episodes),
        arrivals=sum(episode.outcome == "arrival" for episode in result.episodes),
    )


def with_device(config: TrainingConfig, resume: Path | None) -> TrainingConfig:
    """The configuration with the device that is trained on: `auto` goes on where it began, and begins on CUDA where that is.

    Raises:
        NoDeviceError: this machine has no CUDA device, and the training needs one.
        ArchiveError: `resume` is damaged.
    """
    device = config.device
    if device == "auto" and resume is not None:
        device = read_manifest(resume).training.device
    if device == "auto":
        device = "cuda" if torch.cuda.is_available() else "cpu"
    if device == "cuda" and not torch.cuda.is_available():
        raise NoDeviceError("This machine has no CUDA device: train where there is one, or begin anew with the device cpu.")
    return config.model_copy(update={"device": device})


def _trained_on(checkpoint: Checkpoint) -> str:
    """The device that a checkpoint comes from; earlier versions wrote `auto`, but random states tell."""
    device = checkpoint.manifest.training.device
    if device != "auto":
        return device
    return "cpu" if checkpoint.arrays["algorithm/generator"].size == torch.Generator().get_state().numel() else "cuda"


def _versions() -> dict[str, str]:
    versions = {"python": platform.python_version()}
    for package in ("mapless", "torch", "numpy", "pymunk"):
        try:
            versions[package] = version(package)
        except PackageNotFoundError:  # run from a source tree that is not installed
            versions[package] = "unknown"
    return versions

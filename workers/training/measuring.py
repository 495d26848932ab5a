"""Measures any policy, learned or not, on any suite: how every episode ended, where it went, how smoothly."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from sim.arenas.document import to_document
from sim.arrays import Floats
from sim.baselines.named import TABLED, controller_of
from sim.config import TaskConfig
from sim.engine.rewards import term_names
from sim.engine.world import World
from sim.suites import EpisodeTable, Observer, Suite, run_controller, run_suite, suite_for, suite_named, suite_of
from workers.checkpoints import read_policy
from workers.job_protocol import (
    MAX_WAY_POINTS,
    AnyPolicy,
    ArenaSuite,
    BaselineName,
    EvaluateJob,
    Measurement,
    NamedSuite,
    ScenarioSuite,
    SuiteChoice,
    UploadedPolicy,
)
from workers.manifest import USUAL_GAMMA
from workers.onnx_policy import OnnxPolicy
from workers.policy import torch_policy
from workers.training.evaluation import to_result

Progress = Callable[[float], None]


@dataclass(frozen=True, eq=False)
class Driven:
    """A policy's episodes on a suite.

    Attributes:
        suite: of which.
        task: robot, LiDAR and limits that were driven with.
        table: how every episode ended.
        gamma: by which it was trained to discount a step; a usual one where that is not known.
    """

    suite: Suite
    task: TaskConfig
    table: EpisodeTable
    gamma: float = USUAL_GAMMA


def drive(
    archive: Path | None, policy: AnyPolicy, choice: SuiteChoice, observer: Callable[[Suite, TaskConfig], Observer]
) -> Driven:
    """Drives every scenario of a suite once.

    Args:
        archive: of the policy; None for a baseline.
        policy: which one.
        choice: of the suite.
        observer: makes the one that looks on.

    Raises:
        ArchiveError: the archive is not one that this release reads.
        ForeignPolicyError: an uploaded one can't be run, or is for another robot.
        SuiteError: there is no such suite, or the robot has no room in it.
    """
    if isinstance(policy, BaselineName):
        suite = choose_suite(choice, policy.task or TaskConfig())
        task = policy.task or suite.rules.task()
        table = run_controller(controller_of(TABLED[policy.name], task), task, suite, observer(suite, task))
        return Driven(suite, task, table)
    assert archive is not None
    if isinstance(policy, UploadedPolicy):
        assert policy.task is not None
        task, suite = policy.task, choose_suite(choice, policy.task)
        foreign = OnnxPolicy(archive.read_bytes(), task)
        return Driven(suite, task, run_suite(foreign, task, suite, observer(suite, task)))
    manifest, read = read_policy(archive)
    task = manifest.training.task
    suite = choose_suite(choice, task)
    # As the trainer has them, so that the same policy ends every scenario as it did there.
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    try:
        table = run_suite(torch_policy(read), task, suite, observer(suite, task))
        return Driven(suite, task, table, manifest.gamma)
    finally:
        torch.set_flush_denormal(False)


class Measuring:
    """Sums up what a drive comes to.

    Args:
        progress: told the share of the scenarios that have ended, 0 to 1.
    """

    def __init__(self, progress: Progress) -> None:
        self._progress = progress
        self._ways: _Ways | None = None
        self._returns: NDArray[np.float64] | None = None

    def observer(self, suite: Suite, task: TaskConfig) -> Observer:
        """Looks on; see `drive`."""
        ways = self._ways = _Ways(suite, task)
        returns = self._returns = np.zeros((len(suite), len(task.reward.terms)))
        told = DrivenShare(suite, task, self._progress)

        def look(under_way: NDArray[np.int64], world: World, actions: Floats) -> None:
            ways.look(under_way, world)
            returns[under_way] += world.robots.terms[under_way]
            told(under_way, world, actions)

        return look

    def measurement(self, driven: Driven) -> Measurement:
        """What came of the drive that was looked on at."""
        assert self._ways is not None
        assert self._returns is not None
        suite = driven.suite
        return Measurement(
            result=to_result(driven.table, suite),
            task=driven.task,
            arenas=tuple(to_document(arena) for arena in suite.arenas),
            arena_indices=tuple(suite.arena_indices.tolist()),
            targets=tuple((round(float(x), 3), round(float(y), 3)) for x, y in suite.targets),
            ways=tuple(self._ways.ways()),
            jerks=tuple(round(float(jerk), 4) for jerk in self._ways.jerks()),
            terms=term_names(driven.task.reward),
            returns=tuple(tuple(round(each, 4) for each in row) for row in self._returns.tolist()),
        )


def measure(archive: Path | None, job: EvaluateJob, progress: Progress) -> Measurement:
    """Drives every scenario of a suite once, and says what came of it.

    Args:
        archive: of the policy; None for a baseline.
        job: which policy, on which suite.
        progress: told the share of the scenarios that have ended, 0 to 1.

    Raises:
        ArchiveError: the archive is not one that this release reads.
        SuiteError: there is no such suite, or the robot has no room in it.
    """
    measuring = Measuring(progress)
    return measuring.measurement(drive(archive, job.policy, job.suite, measuring.observer))


def choose_suite(choice: SuiteChoice, task: TaskConfig) -> Suite:
    """The suite of a choice, for a task's robot.

    Raises:
        SuiteError: there is none of that name.
        ArenaError: the robot has no room in the arena.
        PlacementError: a scenario can't be driven.
    """
    if isinstance(choice, NamedSuite):
        return suite_named(choice.name, task)
    if isinstance(choice, ArenaSuite):
        return suite_for(task.model_copy(update={"arena": choice.arena}))
    if isinstance(choice, ScenarioSuite):
        # For the default robot, as frozen ones are: every policy meets the same scenarios.
        return suite_of(choice.title, choice.documents)
    return suite_for(task)


class _Ways:
    """Keeps where each robot drove, a point every so many steps, and sums up its jerk.

    Every robot keeps `MAX_WAY_POINTS` points at most: where there would be more, every second one goes, and from then on
    half as many are kept.
    """

    def __init__(self, suite: Suite, task: TaskConfig) -> None:
        count = len(suite)
        self._period = task.control_period
        self._steps = np.zeros(count, np.int64)
        self._points = [[(float(x), float(y))] for x, y in suite.starts[:, :2]]
        self._every = np.ones(count, np.int64)
        self._ends = suite.starts[:, :2].astype(np.float64)
        # Speeds of the last two steps, and how many are known.
        self._speeds = np.zeros((2, count))
        self._jerk = np.zeros(count)

    def look(self, under_way: NDArray[np.int64], world: World) -> None:
        """After a step, or before the first one."""
        self._ends[under_way] = world.robots.poses[under_way, :2]
        speeds = world.velocities(under_way)[:, 0].astype(np.float64)
        before, last = self._speeds[:, under_way]
        known = self._steps[under_way] >= 2
        self._jerk[under_way] += np.where(known, np.abs(speeds - 2.0 * last + before) / self._period**2, 0.0)
        self._speeds[:, under_way] = last, speeds
        for robot in under_way[self._steps[under_way] % self._every[under_way] == 0]:
            points = self._points[robot]
            if self._steps[robot]:
                points.append((float(self._ends[robot, 0]), float(self._ends[robot, 1])))
            if len(points) >= MAX_WAY_POINTS:
                del points[1::2]
                self._every[robot] *= 2
        self._steps[under_way] += 1

    def ways(self) -> list[tuple[tuple[float, float], ...]]:
        """(S,) lines, to a centimetre, each with its last point."""
        lines = []
        for points, end in zip(self._points, self._ends.tolist(), strict=True):
            kept = [(round(x, 2), round(y, 2)) for x, y in (*points, end)]
            lines.append(tuple(point for index, point in enumerate(kept) if index == 0 or point != kept[index - 1]))
        return lines

    def jerks(self) -> NDArray[np.float64]:
        """(S,) mean size of the second difference of the speed over the period squared, m/s3."""
        return self._jerk / np.maximum(1, self._steps - 2)


class DrivenShare:
    """An observer that tells how far it is: the more of scenarios ended and of the longest one's steps.

    Args:
        suite: that is driven.
        task: its limits.
        progress: told the share, 0 to 1.
    """

    def __init__(self, suite: Suite, task: TaskConfig, progress: Progress) -> None:
        self._scenarios = len(suite)
        self._steps = max(1, int(suite.rules.step_limits(task, suite.shortest_paths).max()))
        self._step = 0
        self._progress = progress

    def __call__(self, under_way: NDArray[np.int64], world: World, actions: Floats) -> None:
        """One step of all; see `sim.suites.Observer`."""
        self._step += 1
        self._progress(min(1.0, max(1.0 - len(under_way) / self._scenarios, self._step / self._steps)))

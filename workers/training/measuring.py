"""Measures any policy, learned or not, on any suite, and says how far it is."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from sim.actions import action_layout
from sim.baselines.dwa import dynamic_window
from sim.baselines.simple import go_to_goal, random_policy
from sim.config import TaskConfig
from sim.suites import EpisodeTable, Observer, Suite, run_controller, run_suite, suite_for, suite_named
from sim.world import World
from workers.checkpoints import read_policy
from workers.job_protocol import ArenaSuite, BaselineName, EvaluateJob, NamedSuite, SuiteChoice
from workers.policy import torch_policy
from workers.reporting import EvaluationResult
from workers.training.evaluation import to_result

Progress = Callable[[float], None]


def measure(archive: Path | None, job: EvaluateJob, progress: Progress) -> EvaluationResult:
    """Drives every scenario of a suite once.

    Args:
        archive: of the policy; None for a baseline.
        job: which policy, on which suite.
        progress: told the share of the scenarios that have ended, 0 to 1.

    Raises:
        ArchiveError: the archive is not one that this release reads.
        SuiteError: there is no such suite, or the robot has no room in it.
    """
    if isinstance(job.policy, BaselineName):
        task = job.policy.task
        suite = choose_suite(job.suite, task)
        table = _drive_baseline(job.policy, suite, _Progress(len(suite), task, progress))
        return to_result(table, suite)
    assert archive is not None
    manifest, policy = read_policy(archive)
    task = manifest.training.task
    suite = choose_suite(job.suite, task)
    # As the trainer has them, so that the same policy ends every scenario as it did there.
    torch.set_num_threads(1)
    torch.set_flush_denormal(True)
    try:
        act = torch_policy(policy)
        return to_result(run_suite(act, task, suite, _Progress(len(suite), task, progress)), suite)
    finally:
        torch.set_flush_denormal(False)


def choose_suite(choice: SuiteChoice, task: TaskConfig) -> Suite:
    """The suite of a choice, for a task's robot.

    Raises:
        SuiteError: there is none of that name.
        ArenaError: the robot has no room in the arena.
    """
    if isinstance(choice, NamedSuite):
        return suite_named(choice.name, task)
    if isinstance(choice, ArenaSuite):
        return suite_for(task.model_copy(update={"arena": choice.arena}))
    return suite_for(task)


def _drive_baseline(baseline: BaselineName, suite: Suite, observer: Observer) -> EpisodeTable:
    task = baseline.task
    match baseline.name:
        case "random":
            return run_suite(random_policy(actions=action_layout(task.robot)), task, suite, observer)
        case "go-to-goal":
            return run_suite(go_to_goal(task), task, suite, observer)
        case "dynamic window":
            return run_controller(dynamic_window(task), task, suite, observer)


class _Progress:
    """Looks on, and tells how far it is: the more of scenarios ended and of the longest one's steps."""

    def __init__(self, scenarios: int, task: TaskConfig, progress: Progress) -> None:
        self._scenarios = scenarios
        self._steps = max(1, task.step_limit)
        self._step = 0
        self._progress = progress

    def __call__(self, under_way: NDArray[np.int64], world: World) -> None:
        """One step of all; see `sim.suites.Observer`."""
        self._step += 1
        self._progress(min(1.0, max(1.0 - len(under_way) / self._scenarios, self._step / self._steps)))

"""Drives an evaluation once more and keeps every moment.

All scenarios are driven side by side, as they were when the result was recorded: a matrix product rounds by its number of
rows, so that an episode driven alone may end otherwise.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sim.actions import action_layout
from sim.arenas.document import to_document
from sim.arrays import Floats
from sim.config import TaskConfig
from sim.engine.world import World
from sim.kernels.records import MAX_ANGULAR, MAX_LINEAR
from sim.suites import Observer, Suite
from workers.errors import EpisodesTooLongError
from workers.job_protocol import OWN_SUITE, AnyPolicy, EvaluateJob, Measurement, SuiteChoice
from workers.replays.recording import Recording
from workers.training.evaluation import to_result
from workers.training.measuring import Driven, DrivenShare, Measuring, Progress, drive

MAX_MOMENT_NUMBERS = 2**27
"""Numbers of all moments together: a quarter of a gigabyte in memory, 200 episodes of 20,000 steps with 30 rays."""


class Moments:
    """An observer of a suite that keeps what is drawn and charted.

    Args:
        task: that is driven.
    """

    def __init__(self, task: TaskConfig) -> None:
        self._layout = action_layout(task.robot)
        self._numbers = 0
        self._mover_rows = self._mover_indices = np.empty(0, np.int64)
        self._scenarios: list[NDArray[np.int64]] = []
        self._poses: list[NDArray[np.float32]] = []
        self._ranges: list[NDArray[np.float16]] = []
        self._fields: list[NDArray[np.float32]] = []
        self._movers: list[NDArray[np.float32]] = []
        self._commands: list[NDArray[np.float32]] = []
        self._twists: list[NDArray[np.float32]] = []
        self._terms: list[NDArray[np.float32]] = []

    def __call__(self, under_way: NDArray[np.int64], world: World, actions: Floats) -> None:
        """One step of all; see `sim.suites.Observer`."""
        poses, ranges = world.robots.poses[under_way], world.robots.ranges[under_way].astype(np.float16)
        if not self._scenarios:
            self._mover_rows, self._mover_indices = _mover_rows(world)
        movers = world.movers.discs[self._mover_rows, :, :3]
        commands = self._in_units(actions[under_way], world.robots.drawn[under_way])
        twists, terms = world.twists()[under_way], world.robots.terms[under_way]
        self._numbers += sum(array.size for array in (poses, ranges, movers, commands, twists, terms))
        if self._numbers > MAX_MOMENT_NUMBERS:
            raise EpisodesTooLongError(
                "these episodes are too long, with too many rays, to be kept for a replay: lower the step limit"
            )
        self._scenarios.append(under_way.copy())
        self._poses.append(poses)
        self._ranges.append(ranges)
        self._fields.append(world.fields_of_view[under_way].astype(np.float32))
        self._movers.append(movers)
        self._commands.append(commands)
        self._twists.append(twists)
        self._terms.append(terms)

    def _in_units(self, actions: Floats, drawn: NDArray[np.float64]) -> NDArray[np.float32]:
        """Fractions of the limits that these robots have in this episode, as what they stand for."""
        limits = np.tile(np.array(self._layout.limits), (len(actions), 1))
        # What a robot draws is its top speeds; sideways it goes a share of the former, and a steering angle is the drive's.
        fastest = drawn[:, MAX_LINEAR] / self._layout.limits[0]
        for column, component in enumerate(self._layout.components):
            if component.name in ("linear", "lateral"):
                limits[:, column] *= fastest
            elif component.name == "angular":
                limits[:, column] = drawn[:, MAX_ANGULAR]
        asked: NDArray[np.float32] = (actions * limits).astype(np.float32)
        return asked

    def recording(self, driven: Driven) -> Recording:
        """All of it, one episode after another, once all have ended."""
        suite = driven.suite
        scenario = np.concatenate(self._scenarios)
        order = np.argsort(scenario, kind="stable")
        return Recording(
            evaluation=to_result(driven.table, suite),
            arenas=tuple(to_document(arena) for arena in suite.arenas),
            gamma=driven.gamma,
            arena_indices=suite.arena_indices,
            targets=suite.targets.astype(np.float32),
            offsets=np.concatenate([[0], np.cumsum(np.bincount(scenario, minlength=len(suite)))]),
            poses=np.concatenate(self._poses)[order],
            ranges=np.concatenate(self._ranges)[order],
            fields_of_view=np.concatenate(self._fields)[order],
            movers=np.stack(self._movers),
            mover_indices=self._mover_indices,
            commands=np.concatenate(self._commands)[order],
            twists=np.concatenate(self._twists)[order],
            terms=np.concatenate(self._terms)[order],
        )


def _mover_rows(world: World) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Rows (G,) of the movers' discs that differ, and (S,) which of them each scenario meets."""
    tiles = world.tiles().astype(np.int64)
    sees = any(mover.sees_robots for arena in world.arenas for mover in arena.movers)
    if not sees and world.task.together == 1:
        # Nobody gives way to a robot, or is one: all copies of an arena have the same movers in the same places.
        tiles %= len(world.arenas)
    rows, indices = np.unique(tiles, return_inverse=True)
    return rows, indices


def record(
    archive: Path | None, policy: AnyPolicy, choice: SuiteChoice = OWN_SUITE, progress: Progress = lambda _: None
) -> Recording:
    """Every episode of a policy on a suite.

    Args:
        archive: of the policy; None for a baseline.
        policy: which one.
        choice: of the suite.
        progress: told the share that is driven, 0 to 1.

    Raises:
        ArchiveError: it is not an archive that this release reads.
        SuiteError: there is no such suite.
        EpisodesTooLongError: it would not fit into memory.
    """
    kept: list[Moments] = []

    def observer(suite: Suite, task: TaskConfig) -> Observer:
        kept.append(Moments(task))
        told = DrivenShare(suite, task, progress)

        def look(under_way: NDArray[np.int64], world: World, actions: Floats) -> None:
            kept[0](under_way, world, actions)
            told(under_way, world, actions)

        return look

    driven = drive(archive, policy, choice, observer)
    return kept[0].recording(driven)


def measure_and_record(archive: Path | None, job: EvaluateJob, progress: Progress) -> tuple[Measurement, Recording | None]:
    """An evaluation together with what its robots did, so that nobody waits to look at an episode.

    Args:
        archive: of the policy; None for a baseline.
        job: which policy, on which suite.
        progress: told the share of the scenarios that have ended, 0 to 1.

    Returns:
        What came of it, and every episode; None where they would not fit into memory.

    Raises:
        ArchiveError: the archive is not one that this release reads.
        SuiteError: there is no such suite, or the robot has no room in it.
    """
    measuring = Measuring(progress)
    kept: list[Moments] = []

    def observer(suite: Suite, task: TaskConfig) -> Observer:
        kept.append(Moments(task))
        measured = measuring.observer(suite, task)

        def look(under_way: NDArray[np.int64], world: World, actions: Floats) -> None:
            measured(under_way, world, actions)
            for moments in kept:
                try:
                    moments(under_way, world, actions)
                except EpisodesTooLongError:
                    kept.clear()

        return look

    driven = drive(archive, job.policy, job.suite, observer)
    return measuring.measurement(driven), kept[0].recording(driven) if kept else None

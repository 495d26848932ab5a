"""Drives an evaluation once more and keeps every moment.

All scenarios are driven side by side, as they were when the result was recorded: a matrix product rounds by its number of
rows, so that an episode driven alone may end otherwise.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from sim.arenas.document import to_document
from sim.world import World
from workers.errors import EpisodesTooLongError
from workers.job_protocol import OWN_SUITE, AnyPolicy, SuiteChoice
from workers.replays.recording import Recording
from workers.training.evaluation import to_result
from workers.training.measuring import drive

MAX_MOMENT_NUMBERS = 2**27
"""Numbers of all moments together: a quarter of a gigabyte in memory, 200 episodes of 20,000 steps with 30 rays."""


class _Moments:
    """An observer of a suite that keeps what is drawn."""

    def __init__(self) -> None:
        self._numbers = 0
        self._scenarios: list[NDArray[np.int64]] = []
        self._poses: list[NDArray[np.float32]] = []
        self._ranges: list[NDArray[np.float16]] = []
        self._fields: list[NDArray[np.float32]] = []
        self._movers: list[NDArray[np.float32]] = []

    def __call__(self, under_way: NDArray[np.int64], world: World) -> None:
        """One step of all; see `sim.suites.Observer`."""
        poses, ranges = world.robots.poses[under_way], world.robots.ranges[under_way].astype(np.float16)
        # Every scenario of an arena meets the same movers, so those of its first copy do for all.
        movers = world.movers.discs[: len(world.arenas), :, :3].copy()
        self._numbers += poses.size + ranges.size + movers.size
        if self._numbers > MAX_MOMENT_NUMBERS:
            raise EpisodesTooLongError(
                "these episodes are too long, with too many rays, to be kept for a replay: lower the step limit"
            )
        self._scenarios.append(under_way.copy())
        self._poses.append(poses)
        self._ranges.append(ranges)
        self._fields.append(world.fields_of_view[under_way].astype(np.float32))
        self._movers.append(movers)

    def movers(self) -> NDArray[np.float32]:
        """(T, A, K, 3) x, y, radius in every arena at every moment."""
        return np.stack(self._movers)

    def by_scenario(
        self, scenarios: int
    ) -> tuple[NDArray[np.int64], NDArray[np.float32], NDArray[np.float16], NDArray[np.float32]]:
        """Offsets (S + 1,), poses (M, 3), ranges (M, rays) and fields of view (M,), one episode after another."""
        scenario = np.concatenate(self._scenarios)
        order = np.argsort(scenario, kind="stable")
        offsets = np.concatenate([[0], np.cumsum(np.bincount(scenario, minlength=scenarios))])
        poses, ranges = np.concatenate(self._poses)[order], np.concatenate(self._ranges)[order]
        return offsets, poses, ranges, np.concatenate(self._fields)[order]


def record(archive: Path | None, policy: AnyPolicy, choice: SuiteChoice = OWN_SUITE) -> Recording:
    """Every episode of a policy on a suite.

    Args:
        archive: of the policy; None for a baseline.
        policy: which one.
        choice: of the suite.

    Raises:
        ArchiveError: it is not an archive that this release reads.
        SuiteError: there is no such suite.
        EpisodesTooLongError: it would not fit into memory.
    """
    moments = _Moments()
    driven = drive(archive, policy, choice, lambda *_: moments)
    suite = driven.suite
    offsets, poses, ranges, fields = moments.by_scenario(len(suite))
    return Recording(
        evaluation=to_result(driven.table, suite),
        arenas=tuple(to_document(arena) for arena in suite.arenas),
        arena_indices=suite.arena_indices,
        targets=suite.targets.astype(np.float32),
        offsets=offsets,
        poses=poses,
        ranges=ranges,
        fields_of_view=fields,
        movers=moments.movers(),
    )

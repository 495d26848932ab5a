"""Mapping while driving: A* (Hart, Nilsson and Raphael 1968) on an occupancy grid (Elfes 1989), driven by a dynamic window.

The baseline with a memory. It sees what the policy's scanner sees, with every ray, knows its own pose, and starts with an
empty map, in which what was never seen counts as free. The way is planned anew every few steps; a dynamic window with the
robot's own body drives to a point of it that lies some way ahead.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from sim.arenas import Arena, free_distance
from sim.arrays import Floats
from sim.baselines.kernels.mapping import SURE, distances, plan, trace
from sim.baselines.kernels.rollout import follow_all
from sim.baselines.scans import Body, Doubles, Drive, Scans, in_frames
from sim.config import TaskConfig
from sim.suites import Situation

CELL = 0.1
"""Edge of a cell, metres; half of it where the body is a rectangle that gaps are narrow for."""

PLAN_AGAIN = 4
"""Steps after which the way is planned anew."""

PLAN_KNOWN_AGAIN = 40
"""The same where the map is known from the beginning: the way changes with the robot's place alone."""

AHEAD = 0.8
"""Metres along the way at which the point lies that is driven to; half a second at top speed where that is more."""

HORIZON = 1.6
"""Seconds that the dynamic window looks ahead."""

MARGIN = 0.03
"""Metres that the body keeps."""

COMFORT = 0.35
"""Metres beyond what the body needs up to which a way is the cheaper the more room it has."""

_ROOM = 4.0  # m of map beyond start and target
_WAY = 4000  # cells of a way, at most
_WEIGHTS = (1.0, 0.15, 0.1, 0.2)  # of progress, room, speed, heading


class Maps:
    """What each of many robots has seen, and its way to its target.

    Args:
        task: robot and scanner.
        moving: False leaves what moves out of the maps, for controllers that are told of it.
        known: the arena of each scenario, for a planner that has its map from the beginning.
    """

    def __init__(self, task: TaskConfig, *, moving: bool = True, known: Sequence[Arena] = ()) -> None:
        self._known, self._again = known, PLAN_KNOWN_AGAIN if known else PLAN_AGAIN
        self.scans, self._body, self._moving = Scans(task), Body.of(task), moving
        rectangular = self._body.half_length > 0.0
        self._cell = 0.5 * CELL if rectangular else CELL
        self._keep = (task.robot.inscribed_radius if rectangular else self._body.radius) + 0.5 * self._cell
        self._ahead = max(AHEAD, 0.5 * task.robot.max_linear_speed)
        self._grids: dict[int, tuple[float, float, NDArray[np.int8]]] = {}
        self._ways: dict[int, Doubles] = {}
        self._steps: dict[int, int] = {}

    def carrots(self, situation: Situation) -> Doubles:
        """(n, 2) the points that robots should drive to now, metres, in the arena's frame; each scan is taken in first."""
        points = np.empty((len(situation.robots), 2))
        for i, scenario in enumerate(situation.robots.tolist()):
            pose, target = situation.poses[i].astype(np.float64), situation.targets[i].astype(np.float64)
            x, y, grid = self._grids.get(scenario) or self._begin(scenario, pose, target)
            starts, angles, ranges = self._still(situation, i)
            trace(grid, x, y, self._cell, starts, pose[2], angles, ranges, self.scans.limit)
            step = self._steps.get(scenario, 0)
            if step % self._again == 0:
                self._ways[scenario] = self._plan(x, y, grid, pose, target)
            self._steps[scenario] = step + 1
            points[i] = self._point_ahead(self._ways[scenario], pose, target)
        return points

    def _begin(self, scenario: int, pose: Doubles, target: Doubles) -> tuple[float, float, NDArray[np.int8]]:
        """An empty map that reaches as far beyond start and target as they are apart, and a little further."""
        reach = _ROOM + 2.0 * math.dist(pose[:2], target)
        low = np.minimum(pose[:2], target) - reach
        size = np.maximum(pose[:2], target) + reach - low
        grid = np.zeros((int(size[1] / self._cell), int(size[0] / self._cell)), dtype=np.int8)
        if self._known:
            rows, columns = np.indices(grid.shape)
            centres = low + (np.stack([columns, rows], axis=-1) + 0.5) * self._cell
            grid[free_distance(self._known[scenario], centres) < 0.5 * self._cell] = SURE
        self._grids[scenario] = float(low[0]), float(low[1]), grid
        return self._grids[scenario]

    def _still(self, situation: Situation, i: int) -> tuple[Doubles, Doubles, Doubles]:
        """Starts, angles and lengths of a scan's rays; without those that met what a controller is told of."""
        angles, ranges = self.scans.angles, situation.ranges[i].astype(np.float64)
        discs, poses = situation.discs[i], situation.poses[i : i + 1].astype(np.float64)
        starts = self.scans.origins(poses)[0]
        if self._moving or not len(discs):
            return starts, angles, ranges
        directions = np.stack([np.cos(poses[0, 2] + angles), np.sin(poses[0, 2] + angles)], axis=1)
        ends = starts + ranges[:, None] * directions
        apart = np.hypot(*np.moveaxis(ends[:, None] - discs[None, :, :2], -1, 0)) - discs[:, 2]
        still = (apart > 0.05).all(axis=1)
        return starts[still], angles[still], ranges[still]

    def _plan(self, x: float, y: float, grid: NDArray[np.int8], pose: Doubles, target: Doubles) -> Doubles:
        """(m, 2) metres: the way to the target; the target alone where there is none."""
        # Only the part that was seen, and what lies between it and the target, matters.
        seen_rows, seen_columns = np.nonzero(grid.any(axis=1))[0], np.nonzero(grid.any(axis=0))[0]
        here = int((pose[1] - y) / self._cell), int((pose[0] - x) / self._cell)
        goal = int((target[1] - y) / self._cell), int((target[0] - x) / self._cell)
        spare = int(1.5 / self._cell)
        low_row = max(min(seen_rows.min(initial=here[0]), here[0], goal[0]) - spare, 0)
        low_column = max(min(seen_columns.min(initial=here[1]), here[1], goal[1]) - spare, 0)
        high_row = max(seen_rows.max(initial=here[0]), here[0], goal[0]) + spare
        high_column = max(seen_columns.max(initial=here[1]), here[1], goal[1]) + spare
        part = grid[low_row : high_row + 1, low_column : high_column + 1]
        gaps = np.empty(part.shape, dtype=np.float32)
        distances(part, self._cell, gaps)
        way = np.empty((_WAY, 2), dtype=np.int32)
        count = plan(
            gaps, self._cell, self._keep, self._keep + COMFORT, here[0] - low_row, here[1] - low_column,
            goal[0] - low_row, goal[1] - low_column, way,
        )  # fmt: skip
        if not count:
            return target[None]
        corner = np.array([x + low_column * self._cell, y + low_row * self._cell])
        cells = corner + (way[:count, ::-1] + 0.5) * self._cell
        return np.vstack([cells[:-1], target])

    def _point_ahead(self, way: Doubles, pose: Doubles, target: Doubles) -> Doubles:
        """The point of a way that lies some way ahead of where the robot is on it."""
        nearest = int(np.argmin(np.hypot(*(way - pose[:2]).T)))
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way[nearest:], axis=0).T))])
        beyond = np.flatnonzero(along >= self._ahead)
        return np.asarray(way[nearest + beyond[0]] if len(beyond) else target)


def mapping_planner(task: TaskConfig, known: Sequence[Arena] = ()) -> Callable[[Situation], Floats]:
    """The planner as a controller for `sim.suites.run_controller`; one for each run, since it remembers.

    Args:
        task: robot and scanner.
        known: the arena of each scenario, for a planner that has its map from the beginning.
    """
    maps, drive, body = Maps(task, known=known), Drive.of(task), Body.of(task)
    steps = max(2, round(HORIZON / task.control_period))

    def act(situation: Situation) -> Floats:
        carrots = in_frames(situation.poses, maps.carrots(situation))
        points, counts = maps.scans.points(situation)
        actions = np.zeros((len(carrots), 2), dtype=np.float32)
        follow_all(
            points, counts, carrots, body.half_length, body.half_width, body.radius, MARGIN, drive.fractions(situation),
            drive.top_linear, drive.top_angular, drive.linear_change, drive.angular_change, task.control_period, steps,
            np.array(_WEIGHTS), actions,
        )  # fmt: skip
        return actions

    return act

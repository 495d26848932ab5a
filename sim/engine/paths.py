"""How far robots are from their targets by the shortest path, and the reward for making it shorter.

A path keeps the clearance that a robot needs to pass, over cells of 0.1 m; it goes round walls and obstacles, not movers.
Where the target is in sight nothing is searched. Else each target's field is computed when a robot first needs it, and kept
in a store of bounded size for the next robot whose target is in the same cell.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from sim.arenas import Arena
from sim.arenas.cells import free_mask
from sim.config import PathProgressTerm, TaskConfig
from sim.engine.stretches import Crew
from sim.kernels import paths as kernels
from sim.kernels.bundles import Robots
from sim.kernels.records import ARRIVAL, CELL, COLLISION

MAX_BYTES = 64 * 2**20
"""Of all fields that are kept."""

ALONE = Crew()
"""The thread that asks, and no other."""


class Grids(NamedTuple):
    """The cells of all arenas, one arena after the other.

    Attributes:
        free: (cells,) bool.
        nearest: (cells,) int32 the nearest free cell of each, counted in its arena.
        places: (arenas, 3) int64 where each arena's cells begin, its rows and its columns.
    """

    free: NDArray[np.bool_]
    nearest: NDArray[np.int32]
    places: NDArray[np.int64]

    @classmethod
    def of(cls, arenas: Sequence[Arena], clearance: float) -> "Grids":
        """The cells in which a robot keeps `clearance` metres; all, where there are none, so that every path is straight."""
        masks = [free if (free := free_mask(arena, clearance, CELL)).any() else np.ones_like(free) for arena in arenas]
        firsts = np.cumsum([0, *(mask.size for mask in masks)])
        return cls(
            free=np.concatenate([mask.ravel() for mask in masks]),
            nearest=np.concatenate([_nearest(mask).ravel() for mask in masks]),
            places=np.array([(first, *mask.shape) for first, mask in zip(firsts, masks, strict=False)], np.int64),
        )


def _nearest(free: NDArray[np.bool_]) -> NDArray[np.int32]:
    rows, columns = distance_transform_edt(~free, return_distances=False, return_indices=True)
    return np.asarray(rows * free.shape[1] + columns, np.int32)


class Paths:
    """Shortest paths from any place of some arenas to any target.

    Args:
        arenas: the pool.
        clearance: metres that paths keep from everything.
        max_bytes: of the fields that are kept; one is, however large.
    """

    def __init__(self, arenas: Sequence[Arena], clearance: float, max_bytes: int = MAX_BYTES) -> None:
        self.grids = Grids.of(arenas, clearance)
        largest = int(self.grids.places[:, 1:].prod(axis=1).max())
        self.fields = np.empty((max(1, max_bytes // (4 * largest)), largest), np.int32)
        self.owners = np.full(len(self.fields), -1, np.int64)
        self._slots: dict[int, int] = {}
        self._oldest = 0

    def length(self, index: int, place: Sequence[float], target: Sequence[float]) -> float:
        """Metres from a place to a target, (x, y) each, in an arena; never less than the straight line.

        Where no path leads there, it is the straight line.
        """
        given = (*map(float, place), *map(float, target), index)
        length, _, _, cell = kernels.shortest_way(*given, -1, self.grids, self.fields, self.owners)
        if length < 0.0:
            length, *_ = kernels.shortest_way(*given, self.slot(index, cell), self.grids, self.fields, self.owners)
        return float(length)

    def slot(self, index: int, cell: int) -> int:
        """The row of the field of a target's cell; a new one takes the place of the one made longest ago."""
        return self.slots_of([(index, cell)], ALONE)[0]

    def slots_of(self, wanted: Sequence[tuple[int, int]], crew: Crew) -> list[int]:
        """`slot` of arenas and cells: of the first ones, as many as there is room for side by side, at least one."""
        found: list[int] = []
        new: list[tuple[int, int, int]] = []
        for index, cell in wanted:
            owner = int(self.grids.places[index, 0]) + cell
            slot = self._slots.get(owner)
            if slot is None:
                if self._oldest in found:
                    break
                slot, self._oldest = self._oldest, (self._oldest + 1) % len(self.fields)
                self._slots.pop(int(self.owners[slot]), None)
                self._slots[owner], self.owners[slot] = slot, owner
                new.append((index, cell, slot))
            found.append(slot)
        parts = max(1, min(crew.threads, len(new)))

        def lead(part: int) -> None:
            for index, cell, slot in new[part::parts]:
                kernels.lead(kernels.grid_of(index, self.grids)[0], cell, self.fields[slot])

        crew.share(lead, parts)
        return found


class RobotPaths:
    """The shortest path of each robot to its target, looked for once for all who want to know it.

    Args:
        paths: of the robots' arenas.
        robots: how many.

    Attributes:
        lengths: (N,) metres, from where each was when it was looked at last.
        firsts: (N, 2) x, y of the first corner of its path that is not underfoot, or of its target, metres.
    """

    def __init__(self, paths: Paths, robots: int) -> None:
        self.lengths, self.firsts = np.zeros(robots), np.zeros((robots, 2))
        self._paths = paths
        self._slots, self._missing = np.full(robots, -1, np.int32), np.empty(robots, np.int32)

    def look(self, robots: Robots, which: NDArray[np.bool_], crew: Crew = ALONE) -> None:
        """Look at some robots (N,), and once more at those whose targets had no field, with that; a crew shares the work."""
        paths, slots, missing = self._paths, self._slots, self._missing
        fixed = robots, slots, paths.grids, paths.fields, paths.owners, self.lengths, self.firsts, missing

        def find(first: int, last: int, those: NDArray[np.bool_]) -> int:
            return int(kernels.find_ways(first, last, those, *fixed))

        crew = crew if 2 * np.count_nonzero(which) > len(which) else ALONE
        parts = crew.stretches(len(which))
        counts = crew.share(lambda part: find(*parts[part], which), len(parts))
        ends = ((first, first + count) for (first, _), count in zip(parts, counts, strict=True))
        left = [i for first, end in ends for i in missing[first:end].tolist()]
        again = np.zeros(len(which), np.bool_)
        while left:
            found = paths.slots_of([self._target_of(robots, i) for i in left], crew)
            now, left = left[: len(found)], left[len(found) :]
            # At once: the next ones' fields may take the places of these.
            slots[now], again[now] = found, True
            find(min(now), max(now) + 1, again)
            again[now] = False

    def _target_of(self, robots: Robots, robot: int) -> tuple[int, int]:
        """A robot's arena and the cell of its target."""
        index, target = int(robots.records["map"][robot]), robots.targets[robot].tolist()
        paths = self._paths
        *_, cell = kernels.shortest_way(*target, *target, index, -1, paths.grids, paths.fields, paths.owners)
        return index, int(cell)


class PathProgress:
    """The term `path_progress` of a task's reward for so many robots; there may be none.

    Args:
        task: whose reward.
        paths: of its robots, where there is one.
        robots: how many.
    """

    def __init__(self, task: TaskConfig, paths: RobotPaths | None, robots: int) -> None:
        found = [(column, term) for column, term in enumerate(task.reward.terms) if isinstance(term, PathProgressTerm)]
        self._terms = [(column, np.float32(term.weight)) for column, term in found]
        self._paths = paths if found else None
        self._lengths = np.zeros(robots)

    def __bool__(self) -> bool:
        return bool(self._terms)

    def begin(self, which: NDArray[np.bool_]) -> None:
        """Remember how far some robots (N,), which have been looked at, have to go."""
        if self._paths is not None:
            self._lengths[which] = self._paths.lengths[which]

    def add(self, robots: Robots) -> None:
        """Add the term of the step that was just driven, all having been looked at, before anybody begins anew."""
        if self._paths is None:
            return
        paid = (robots.outcomes != ARRIVAL) & (robots.outcomes != COLLISION) & (robots.records["parked"] == 0)
        now = self._paths.lengths
        for column, weight in self._terms:
            terms = np.where(paid, weight * (self._lengths - now), 0.0).astype(np.float32)
            robots.terms[:, column] = terms
            robots.rewards[:] += terms
            robots.records["attempt_reward"] += terms
        self._lengths[paid] = now[paid]

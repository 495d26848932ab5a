"""The movers of all tiles: where they start, how they go on, and what the rest of the simulation sees of them."""

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sim.arenas import Arena
from sim.arenas.mover import Kind
from sim.engine.shapes import Shapes, hulls
from sim.kernels.bundles import Crowd, Robots
from sim.kernels.movers import DECISION, GUESTS, move_movers, place_movers, see_robots
from sim.kernels.options import bound
from sim.kernels.random import seed_streams
from sim.kernels.records import DISC_COLUMNS, MOVER, PATROL, PEDESTRIAN, TIMED, WALKER
from sim.streams import MOVERS, Stream

_KINDS: dict[Kind, int] = {"patrol": PATROL, "walker": WALKER, "pedestrian": PEDESTRIAN, "timed": TIMED}


class Movers:
    """What moves beside the robots. Unless they see robots, a scenario is the same whoever drives in it.

    Args:
        arenas: the pool; tile t is a copy of arena t modulo their number.
        shapes: of the pool.
        origins: (tiles, 2) centres of the tiles, metres.
        period: seconds of a step.
        alike: whether all copies of an arena have the same movers in the same places.
        robots: how many there are, for movers that see them.
        robot_radius: metres that these take a robot to fill around its centre.
        others: robots that each robot sees in its tile: they have the last slots, see `sim.kernels.together`.

    Attributes:
        discs: (tiles, K, 5) float32 x, y, radius, metres in the arena's frame, and how far each came in the last step, in
            x and y; a radius below zero is an empty slot.
        walking: (tiles, K - others, 5) those of them that are no robots.
        fastest: m/s, the highest top speed of them all.
    """

    def __init__(
        self,
        arenas: Sequence[Arena],
        shapes: Shapes,
        origins: NDArray[np.float64],
        period: float,
        *,
        alike: bool,
        robots: int = 0,
        robot_radius: float = 0.0,
        others: int = 0,
    ) -> None:
        tiles, walking = len(origins), max(len(arena.movers) for arena in arenas)
        slots = walking + others
        self.discs: NDArray[np.float32] = np.full((tiles, slots, DISC_COLUMNS), -1.0, dtype=np.float32)
        self.walking = self.discs[:, :walking]
        self.fastest = max((mover.fastest for arena in arenas for mover in arena.movers), default=0.0)
        table = np.zeros((tiles, slots), dtype=MOVER)
        table["radius"] = -1.0
        sees = np.zeros((tiles, slots), dtype=np.bool_)
        waypoints: list[tuple[float, float]] = []
        times: list[float] = []
        for index, arena in enumerate(arenas):
            for slot, mover in enumerate(arena.movers):
                records = table[index :: len(arenas), slot]
                records["kind"] = _KINDS[mover.kind]
                records["radius"] = mover.radius
                records["speed"] = mover.speed
                records["first_waypoint"] = len(waypoints)
                records["waypoints"] = len(mover.waypoints)
                records["way"] = mover.loops
                sees[index :: len(arenas), slot] = mover.sees_robots
                waypoints += mover.waypoints
                times += mover.times or (0.0,) * len(mover.waypoints)
        self._records = table.reshape(-1)
        bounds, circles, boxes = shapes
        self._crowd = Crowd(
            records=self._records,
            discs=self.discs,
            waypoints=np.array(waypoints, dtype=np.float64).reshape(-1, 2),
            times=np.array(times, dtype=np.float64),
            maps=(np.arange(tiles) % len(arenas)).astype(np.int32),
            bounds=bounds,
            circles=circles,
            boxes=boxes,
            origins=origins,
            hulls=hulls(circles, boxes),
            near=np.empty(1 + circles.shape[1] + boxes.shape[1], dtype=np.int32),
            met=np.empty(slots + 1, dtype=np.int32),
            steps=np.zeros(1, dtype=np.int64),
            sees=sees.reshape(-1),
            robot_radius=np.array([robot_radius]),
            seen=np.zeros((robots if sees.any() else 0, 4)),
            first_seen=np.zeros(tiles + 1, dtype=np.int64),
            lines=np.empty((2, 4 + circles.shape[1] + boxes.shape[1] + 2 * slots + 2 * GUESTS, 3)),
            chosen=np.empty((slots + 1, 2)),
        )
        self._copies = tiles // len(arenas) if alike else 1
        self._arenas = len(arenas)
        self._period = period
        self._steps_between = max(1, round(DECISION / period))

    def __len__(self) -> int:
        return len(self._records)

    def seed(self, seed: int | None, stream: Stream) -> None:
        """Start every mover's generator anew, from the movers' child of a stream; None takes a seed from the system."""
        streams = seed_streams(seed, len(self) // self._copies, key=(*stream, *MOVERS))
        self._records["random"] = np.tile(streams, self._copies)

    def place(self) -> None:
        """Draw where all of them start."""
        self._crowd.steps[0] = 0
        place_movers(self._crowd)

    def put(self, slot: int, x: float, y: float) -> None:
        """Put one of the first copy of the first arena somewhere else, metres; one that goes by the clock goes on by it."""
        self._records[slot]["x"], self._records[slot]["y"] = x, y
        self.discs[0, slot, :2] = x, y
        self.discs[0, slot, 3:] = 0.0

    def write_places(self, state: NDArray[np.float64]) -> None:
        """Write where all of them are in the Space to their rows (tiles * K, 3) of `sim.engine.physics.TiledSpace.state`."""
        places = np.stack([self._records["x"], self._records["y"]], axis=1)
        state[:, :2] = np.repeat(self._crowd.origins, self.discs.shape[1], axis=0) + places

    def of(self, tile: int) -> NDArray[np.float32]:
        """(n, 3) x, y, radius of the movers in a tile, metres."""
        discs = self.discs[tile]
        present: NDArray[np.float32] = discs[discs[:, 2] > 0.0, :3]
        return present

    def speeds(self, tiles: NDArray[np.int32]) -> NDArray[np.float64]:
        """(n, K) top speeds of the movers of tiles (n,), m/s."""
        speeds: NDArray[np.float64] = self._records["speed"].reshape(len(self.discs), -1)[tiles]
        return speeds

    def routes_left(self, tiles: NDArray[np.int32]) -> tuple[NDArray[np.float64], NDArray[np.int32]]:
        """How far the movers of tiles (n,) are from the next corner of their routes, and which that is.

        Returns:
            (n, K) metres, 0 for those without a route; and (n, K) the corners.
        """
        records = self._records.reshape(len(self.discs), -1)[tiles]
        left = np.hypot(records["goal_x"] - records["x"], records["goal_y"] - records["y"])
        walks = (records["kind"] == PEDESTRIAN) & (records["waypoints"] > 0) & (records["present"] == 1)
        return np.where(walks, left, 0.0), records["waypoint"].copy()

    def distance(self, tile: int, point: NDArray[np.float64]) -> float:
        """From a point (2,) in a tile to the nearest mover's surface, metres; infinite where there is none."""
        here = self.of(tile)
        gaps = np.hypot(*(here[:, :2] - point).T) - here[:, 2]
        return float(gaps.min(initial=np.inf))

    def look(self, robots: Robots, parameters: NDArray[np.void]) -> None:
        """Show the robots, as they are now, to those that see them; at a decision only, when it makes a difference.

        Args:
            robots: all of them.
            parameters: (1,) of `sim.kernels.records.PARAMETERS`.
        """
        if len(self._crowd.seen) and self._crowd.steps[0] % self._steps_between == 0:
            see_robots(self._crowd, robots, self._arenas, parameters)

    def step(self, command: NDArray[np.float64], robots: int) -> None:
        """Go on for one control period.

        Args:
            command: of `sim.engine.physics.TiledSpace`, whose rows of movers are written.
            robots: rows before them.
        """
        self._move(self._crowd, self._period, self._steps_between, command, robots)

    @cached_property
    def _move(self) -> Callable[..., Any]:
        """`move_movers` for these movers, and for commands as `step` takes them."""
        return bound(move_movers, self._crowd, self._period, self._steps_between, np.zeros((1, 3)), 0)

    def state(self) -> dict[str, NDArray[np.generic]]:
        """The arrays that the future depends on, by name; empty where nothing moves."""
        if not len(self):
            return {}
        arrays: dict[str, NDArray[np.generic]] = {f"mover_{name}": self._records[name] for name in MOVER.names or ()}
        return arrays | {"mover_discs": self.discs, "mover_steps": self._crowd.steps}

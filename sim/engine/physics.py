"""All robots in one pymunk Space: each arena is a tile of it, and poses and commands pass through in bulk.

The robots of a tile do not see one another, so a tile is as good as a world of its own; one Space instead of many is what
makes a step cheap (benchmarks/sim_throughput.py).
"""

import gc
import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager

import numpy as np
import pymunk
from numpy.typing import NDArray
from pymunk import batch

from sim.arenas import Arena
from sim.config import AnyRobotConfig, RectangularRobot

ROBOTS_PER_TILE = 64
"""Robots that share a tile: few enough that the broad phase finds few pairs, enough that thousands need few shapes."""

TILE_COLUMNS = 64
"""Tiles in a row. Fixed, so that a robot's tile, and with it every rounding, is independent of the number of robots."""

GAP = 2.0
"""Metres between two tiles."""

_WALL = 0.05  # half the thickness of the outer walls, whose inner faces stand on the arena's bounds
_HASH_CELL = 1.5  # m; in larger cells too many robots of a tile meet, of smaller ones each needs several
_HASH_SLOTS_PER_SHAPE = 2
_HASH_SLOTS_PER_PAIR = 8.0  # of a robot and a shape, to the power of a half: where shapes are many, fewer slots are faster
_ROBOT, _OBSTACLE = 0b01, 0b10
_MEETS_ROBOTS = pymunk.ShapeFilter(categories=_OBSTACLE, mask=_ROBOT)
_POSES = batch.BodyFields.POSITION | batch.BodyFields.ANGLE
_VELOCITIES = batch.BodyFields.VELOCITY | batch.BodyFields.ANGULAR_VELOCITY
_FEW = 20  # up to one body in so many is put by itself, which takes so many times as long as one in bulk


def tile_origins(arenas: Sequence[Arena], replicas: int) -> NDArray[np.float64]:
    """Centres of the tiles, (replicas * arenas, 2) metres: all arenas once, then all again, row by row."""
    pitch = GAP + 2.0 * max(max(arena.half_width, arena.half_height) for arena in arenas)
    tiles = np.arange(replicas * len(arenas))
    return pitch * np.stack([tiles % TILE_COLUMNS, tiles // TILE_COLUMNS], axis=1).astype(np.float64)


@contextmanager
def _objects_that_stay() -> Iterator[None]:
    """No search for garbage among objects of which none is: with thousands of arenas that took half of the time."""
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def _hash_slots(shapes: int, robots: int) -> int:
    """Slots of a Space's hash, of which every step clears all, and every robot looks through what shares its own.

    A step of 512 robots of a training among 593,384 shapes takes 2.2 ms with two slots a shape, and 1.3 with a quarter.
    """
    return min(_HASH_SLOTS_PER_SHAPE * shapes, round(_HASH_SLOTS_PER_PAIR * math.sqrt(shapes * robots)))


def add_arena(space: pymunk.Space, arena: Arena, x: float, y: float) -> list[pymunk.Shape]:
    """Put an arena's walls and obstacles into a Space around (x, y), metres; returns the shapes."""
    body = space.static_body
    width, height = arena.half_width + _WALL, arena.half_height + _WALL
    corners = [(x - width, y - height), (x + width, y - height), (x + width, y + height), (x - width, y + height)]
    # The ends of a thick segment answer ray queries wrongly, but those of the walls stand outside the corners.
    shapes: list[pymunk.Shape] = [
        pymunk.Segment(body, corners[k], corners[(k + 1) % 4], _WALL) for k in range(4)
    ]  # fmt: skip
    for cx, cy, radius in arena.circles.tolist():
        shapes.append(pymunk.Circle(body, radius, (x + cx, y + cy)))
    for cx, cy, length, breadth, angle in arena.boxes.tolist():
        cos, sin = math.cos(angle), math.sin(angle)
        vertices = [
            (x + cx + cos * u - sin * v, y + cy + sin * u + cos * v)
            for u, v in ((-length, -breadth), (length, -breadth), (length, breadth), (-length, breadth))
        ]
        shapes.append(pymunk.Poly(body, vertices))
    for shape in shapes:
        shape.filter = _MEETS_ROBOTS
    space.add(*shapes)
    return shapes


def robot_body(robot: AnyRobotConfig) -> tuple[pymunk.Body, pymunk.Shape]:
    """A robot's body of 1 kg at the origin, and its shape."""
    if isinstance(robot, RectangularRobot):
        size = robot.length, robot.width
        body = pymunk.Body(1.0, pymunk.moment_for_box(1.0, size))
        return body, pymunk.Poly.create_box(body, size)
    body = pymunk.Body(1.0, pymunk.moment_for_circle(1.0, 0.0, robot.radius))
    return body, pymunk.Circle(body, robot.radius)


class TiledSpace:
    """A Space with every arena in its tile, all robots and all movers, driven by velocities and read as poses.

    Movers are kinematic bodies without shapes: nothing pushes them, and the kernel that senses them also says which robots
    they touch. With shapes the broad phase would find that once more, for a fifth of the rate.

    Attributes:
        space: the pymunk Space.
        state: (bodies, 3) float64 x, y, angle in the Space, in the order robots, movers, static body. `step` refills it;
            what is written to it stands once it is `put`.
        command: (bodies, 3) float64 vx, vy, angular velocity of the next `step`.
    """

    def __init__(
        self, arenas: Sequence[Arena], origins: NDArray[np.float64], robots: int, robot: AnyRobotConfig, movers: int
    ) -> None:
        space = pymunk.Space()
        space.gravity = 0.0, 0.0
        # Chipmunk lets shapes overlap by 0.1 m unless told otherwise: a robot's radius.
        space.collision_slop = 0.0
        # No push-out velocity: it would leak into the first step after a robot is put elsewhere.
        space.collision_bias = 1.0
        shapes = sum(4 + len(arena.circles) + len(arena.boxes) for arena in arenas)
        shapes = shapes * (len(origins) // len(arenas)) + robots
        space.use_spatial_hash(_HASH_CELL, _hash_slots(shapes, robots))
        with _objects_that_stay():
            for tile, (x, y) in enumerate(origins.tolist()):
                add_arena(space, arenas[tile % len(arenas)], x, y)
        self._bodies: list[pymunk.Body] = []
        for _ in range(robots):
            body, shape = robot_body(robot)
            shape.filter = pymunk.ShapeFilter(group=1, categories=_ROBOT, mask=_OBSTACLE)
            space.add(body, shape)
            self._bodies.append(body)
        for _ in range(movers):
            body = pymunk.Body(body_type=pymunk.Body.KINEMATIC)
            space.add(body)
            self._bodies.append(body)
        self.space = space

        # Rows follow the order of insertion, the static body last; they stay so since no body is ever removed.
        rows = robots + movers + 1
        self.command: NDArray[np.float64] = np.zeros((rows, 3))
        self._written = batch.Buffer()
        self._written.set_float_buf(self.command)
        self._read = batch.Buffer()
        batch.get_space_bodies(space, _POSES, self._read)
        # A view of pymunk's own memory, which stays where it is while the number of rows does.
        self.state: NDArray[np.float64] = np.frombuffer(self._read.float_buf(), np.float64).reshape(-1, 3)
        if self.state.shape != (rows, 3):
            raise AssertionError(f"pymunk.batch gave {self.state.shape[0]} bodies instead of {rows}")

    def step(self, period: float) -> None:
        """Let every body drive for `period` seconds as `command` says, and read `state`."""
        batch.set_space_bodies(self.space, _VELOCITIES, self._written)
        self.space.step(period)
        self._read.clear()
        batch.get_space_bodies(self.space, _POSES, self._read)

    def put(self, rows: NDArray[np.int32]) -> None:
        """Put the bodies of these rows where `state` says; it says where all others are, too."""
        if _FEW * len(rows) > len(self.state):
            self.put_all()
            return
        for row in rows.tolist():
            x, y, angle = self.state[row].tolist()
            self._bodies[row].position = x, y
            self._bodies[row].angle = angle

    def put_all(self) -> None:
        """Put every body where `state` says."""
        batch.set_space_bodies(self.space, _POSES, self._read)

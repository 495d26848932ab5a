"""What every scene is drawn with: walls, people on their ways, and a robot's start and target."""

import math
from dataclasses import dataclass, field

import numpy as np

from sim.arenas.geometry import Arena
from sim.arenas.mover import Mover

HALF = 6.0
"""Metres from the middle of a scene to its walls."""

PERSON = 0.25
"""Radius of a person, metres."""

PACE = 1.0
"""Top speed of people, m/s, and of the robot that is measured among them."""

Point = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Scene:
    """An arena with people in it, and a robot's start (x, y, heading) and target (x, y) there; metres and radians."""

    arena: Arena
    start: tuple[float, float, float]
    target: Point


@dataclass
class Draft:
    """A scene as it is drawn: the robot starts on the left and goes to the right.

    Attributes:
        random: where everything that is random comes from.
        sees: whether people see the robot.
        boxes: rows of `Arena.boxes`.
        movers: the people.
        start, target: the robot's.
    """

    random: np.random.Generator
    sees: bool
    boxes: list[tuple[float, float, float, float, float]] = field(default_factory=list)
    movers: list[Mover] = field(default_factory=list)
    start: Point = (-4.5, 0.0)
    target: Point = (4.5, 0.0)

    def between(self, low: float, high: float) -> float:
        """A number drawn uniformly."""
        return float(self.random.uniform(low, high))

    def wall(self, low_x: float, low_y: float, high_x: float, high_y: float) -> None:
        """An upright box between two corners."""
        self.boxes.append(
            (0.5 * (low_x + high_x), 0.5 * (low_y + high_y), 0.5 * (high_x - low_x), 0.5 * (high_y - low_y), 0.0)
        )

    def person(self, *way: Point, pace: float = PACE, loops: bool = True) -> None:
        """Somebody who starts at the first point and walks to the others; with one point alone, who stands there."""
        self.movers.append(Mover("pedestrian", PERSON, pace, way, loops=loops, sees_robots=self.sees))

    def group(self, people: int, abreast: Point, *way: Point, pace: float = PACE) -> None:
        """People who walk side by side, `abreast` from one to the next."""
        for k in range(people):
            aside = k - 0.5 * (people - 1)
            self.person(*((x + aside * abreast[0], y + aside * abreast[1]) for x, y in way), pace=pace)

    def scene(self, name: str) -> Scene:
        """What was drawn, mirrored or not, and turned by a random number of quarter turns."""
        mirrored = -1.0 if self.random.integers(2) else 1.0
        turns = int(self.random.integers(4))
        cos, sin = (1, 0, -1, 0)[turns], (0, 1, 0, -1)[turns]

        def placed(point: Point) -> Point:
            x, y = point[0], mirrored * point[1]
            return cos * x - sin * y, sin * x + cos * y

        boxes = [
            (*placed((x, y)), *((wide, long) if turns % 2 else (long, wide)), mirrored * angle)
            for x, y, long, wide, angle in self.boxes
        ]
        movers = tuple(
            Mover(m.kind, m.radius, m.speed, tuple(map(placed, m.waypoints)), loops=m.loops, sees_robots=m.sees_robots)
            for m in self.movers
        )
        arena = Arena(name, HALF, HALF, boxes=np.array(boxes, dtype=np.float64).reshape(-1, 5), movers=movers)
        start, target = placed(self.start), placed(self.target)
        facing = math.atan2(target[1] - start[1], target[0] - start[0])
        return Scene(arena, (*start, facing), target)

"""Ten scenes among people, eight of them named as in Francis et al. 2023; `queue` and `groups` are ours.

The paper is "Principles and Guidelines for Evaluating Social Robot Navigation Algorithms". What it describes in words is
drawn here with numbers of our own.

Times and places are drawn so that people and robot, equally fast, meet about half-way.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Final, Literal, get_args

import numpy as np

from sim.arenas.geometry import Arena
from sim.arenas.scenes.draft import HALF, PERSON, Draft, Scene
from sim.errors import ArenaError

SceneName = Literal[
    "frontal-approach",
    "overtaking",
    "intersection",
    "blind-corner",
    "narrow-doorway",
    "parallel-traffic",
    "perpendicular-traffic",
    "queue",
    "groups",
    "crowd-navigation",
]

_ABREAST = 0.75  # m from one person to the next in a group
_APART = 0.6  # m that people who stand keep from one another


def _corridor(draft: Draft, width: float) -> None:
    """Walls above and below a corridor along x."""
    draft.wall(-HALF, 0.5 * width, HALF, HALF)
    draft.wall(-HALF, -HALF, HALF, -0.5 * width)


def _frontal_approach(draft: Draft) -> None:
    width = draft.between(1.8, 3.0)
    _corridor(draft, width)
    aside = draft.between(-0.3, 0.3)
    draft.person((4.5, aside), (-5.5, aside), loops=False)
    draft.target = (4.0, 0.0)


def _overtaking(draft: Draft) -> None:
    _corridor(draft, draft.between(2.2, 3.2))
    aside = draft.between(-0.4, 0.4)
    draft.person((-2.8, aside), (5.5, aside), pace=draft.between(0.3, 0.6), loops=False)


def _intersection(draft: Draft) -> None:
    width = draft.between(2.0, 3.0)
    half = 0.5 * width
    for low_x, high_x in ((-HALF, -half), (half, HALF)):
        for low_y, high_y in ((-HALF, -half), (half, HALF)):
            draft.wall(low_x, low_y, high_x, high_y)
    for side in (-1.0, 1.0)[: 1 + int(draft.random.integers(2))]:
        at = draft.between(-0.4, 0.4)
        draft.person((at, side * draft.between(3.8, 5.2)), (at, -side * 5.3))


def _blind_corner(draft: Draft) -> None:
    width = draft.between(1.8, 2.6)
    low = -4.0
    draft.wall(-HALF, low + 0.5 * width, HALF - 1.0 - width, HALF)
    draft.wall(HALF - 1.0, -HALF, HALF, HALF)
    draft.wall(-HALF, -HALF, HALF - 1.0, low - 0.5 * width)
    far = HALF - 1.0 - 0.5 * width
    draft.start, draft.target = (-3.0, low), (far, 4.0)
    for behind in range(1 + int(draft.random.integers(2))):
        draft.person((far, 2.6 + 1.2 * behind), (far, low), (-5.3, low), loops=False)


def _narrow_doorway(draft: Draft) -> None:
    door, at = 0.5 * draft.between(1.0, 1.4), draft.between(-1.5, 1.5)
    draft.wall(-0.1, at + door, 0.1, HALF)
    draft.wall(-0.1, -HALF, 0.1, at - door)
    draft.start, draft.target = (-4.5, draft.between(-2.0, 2.0)), (4.5, draft.between(-2.0, 2.0))
    for behind in range(1 + int(draft.random.integers(3))):
        draft.person(
            (3.6 + 0.9 * behind, at + draft.between(-0.5, 0.5)), (0.8, at), (-0.8, at), (-4.0, at - 3.0), loops=False
        )


def _parallel_traffic(draft: Draft) -> None:
    width = draft.between(3.6, 4.6)
    _corridor(draft, width)
    for k in range(4):  # oncoming, in twos and alone
        begin, end = (1.4 + 1.1 * k, draft.between(-1.0, 1.0)), (-5.4, draft.between(-1.0, 1.0))
        draft.group(1 + k % 2, (0.0, _ABREAST), begin, end)
    for k in range(2):  # the same way
        at = draft.between(-1.0, 1.0)
        draft.person((-2.6 + 2.0 * k, at), (5.4, at), pace=draft.between(0.7, 1.0))


def _perpendicular_traffic(draft: Draft) -> None:
    for k in range(8):
        x, side = -2.8 + 0.8 * k + draft.between(-0.1, 0.1), 1.0 if k % 2 else -1.0
        draft.person((x, side * draft.between(1.5, 5.2)), (x, -side * 5.2), (x, side * 5.2), pace=draft.between(0.8, 1.0))


def _queue(draft: Draft) -> None:
    # A counter at the top, and a line of people before it across the robot's way.
    draft.wall(-0.8, HALF - 1.0, 0.8, HALF)
    lean, x = draft.between(-0.15, 0.15), draft.between(-0.8, 0.8)
    for k in range(9):
        draft.person((x + lean * k * (_APART + 0.25), HALF - 1.5 - k * (_APART + 0.25)))
    draft.start, draft.target = (-4.5, draft.between(-1.0, 2.5)), (4.5, draft.between(-1.0, 2.5))


def _groups(draft: Draft) -> None:
    # Standing rings of people who talk, and one group that walks.
    for x, y in ((-1.8, 1.2), (0.6, -1.2), (2.6, 1.4)):
        x, y = x + draft.between(-0.3, 0.3), y + draft.between(-0.3, 0.3)
        first, people = draft.between(0.0, 2.0 * math.pi), 3 + int(draft.random.integers(2))
        for k in range(people):
            angle = first + 2.0 * math.pi * k / people
            draft.person((x + _APART * math.cos(angle), y + _APART * math.sin(angle)))
    at = draft.between(-0.4, 0.4)
    draft.group(2, (0.0, _ABREAST), (4.9, at), (-4.9, at))


def _crowd_navigation(draft: Draft) -> None:
    pillars: list[tuple[float, float]] = []
    while len(pillars) < 6:
        x, y = draft.between(-4.0, 4.0), draft.between(-4.0, 4.0)
        if all(math.dist((x, y), other) > 2.0 for other in (*pillars, draft.start, draft.target)):
            pillars.append((x, y))
            draft.boxes.append((x, y, draft.between(0.15, 0.4), draft.between(0.15, 0.4), 0.0))

    def clear(near: list[tuple[float, float]], room: float) -> tuple[float, float]:
        while True:
            point = draft.between(-5.2, 5.2), draft.between(-5.2, 5.2)
            if all(math.dist(point, pillar) > 0.6 + PERSON for pillar in pillars) and all(
                math.dist(point, other) > room for other in near
            ):
                return point

    starts = [draft.start]
    for _ in range(10):
        starts.append(clear(starts, 1.6))
        draft.person(starts[-1], *(clear([], 0.0) for _ in range(6)), pace=draft.between(0.7, 1.0))


SCENES: Final[dict[SceneName, Callable[[Draft], None]]] = {
    "frontal-approach": _frontal_approach,
    "overtaking": _overtaking,
    "intersection": _intersection,
    "blind-corner": _blind_corner,
    "narrow-doorway": _narrow_doorway,
    "parallel-traffic": _parallel_traffic,
    "perpendicular-traffic": _perpendicular_traffic,
    "queue": _queue,
    "groups": _groups,
    "crowd-navigation": _crowd_navigation,
}


def generate_scene(name: SceneName, seed: int, *, sees: bool) -> Scene:
    """The scene of a name and a seed; the same two give the same scene.

    Args:
        name: of the scene.
        seed: at least 0.
        sees: whether people see the robot; they are in the same places and on the same ways in either case.

    Raises:
        ArenaError: there is no such scene, or the seed is negative.
    """
    if name not in SCENES:
        raise ArenaError(f"there is no scene {name!r}: choose one of {', '.join(get_args(SceneName))}")
    if seed < 0:
        raise ArenaError(f"a seed is at least 0, and {seed} is not")
    draft = Draft(np.random.default_rng([list(SCENES).index(name), seed]), sees)
    SCENES[name](draft)
    return draft.scene(f"{name}-{seed}")


def training_scene(difficulty: float, seed: int) -> Arena:
    """A scene to train in, whose people don't see the robot.

    Args:
        difficulty: the share of the scene's people who are there; one is, at least.
        seed: at least 0; of ten that follow one another each has another scene.

    Raises:
        ArenaError: as `generate_scene`.
    """
    arena = generate_scene(list(SCENES)[seed % len(SCENES)], seed, sees=False).arena
    return replace(arena, movers=arena.movers[: max(1, round(difficulty * len(arena.movers)))])

"""The colours of the live view, light and dark, to match the pages around it."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Theme = Literal["light", "dark"]
Rgb = tuple[int, int, int]


@dataclass(frozen=True, slots=True)
class Colours:
    """One look of the scene; sRGB, 0 to 255."""

    floor: Rgb
    cell: Rgb
    section: Rgb
    wall: Rgb
    obstacle: Rgb
    chassis: Rgb
    ray: Rgb
    hit: Rgb
    fan: float
    shadow: float
    sun: float
    ambient: float
    ray_strength: float


COLOURS: dict[Theme, Colours] = {
    "dark": Colours(
        floor=(22, 25, 33),
        cell=(31, 35, 45),
        section=(44, 50, 63),
        wall=(72, 82, 104),
        obstacle=(104, 116, 142),
        chassis=(52, 57, 68),
        ray=(20, 160, 215),
        hit=(255, 107, 87),
        fan=0.10,
        shadow=0.45,
        sun=1.6,
        ambient=0.45,
        ray_strength=0.38,
    ),
    "light": Colours(
        floor=(250, 251, 253),
        cell=(236, 239, 244),
        section=(219, 224, 232),
        wall=(176, 187, 205),
        obstacle=(148, 162, 187),
        chassis=(70, 76, 90),
        ray=(20, 140, 190),
        hit=(235, 72, 48),
        fan=0.08,
        shadow=0.16,
        sun=1.5,
        ambient=0.8,
        ray_strength=0.5,
    ),
}

# Told apart at a glance, and none of them the green of an arrival or the red of a collision.
ROBOTS: tuple[Rgb, ...] = (
    (51, 154, 240),
    (255, 146, 43),
    (190, 92, 235),
    (34, 190, 205),
    (240, 101, 149),
    (252, 196, 25),
    (92, 124, 250),
    (168, 140, 110),
)

# By `Frame.outcomes`: none yet, arrival, collision, time-out.
OUTCOMES: tuple[Rgb, ...] = ((128, 128, 128), (64, 208, 110), (255, 82, 82), (255, 190, 60))


def linear(colours: NDArray[np.float64] | Rgb) -> NDArray[np.uint8]:
    """From sRGB to linear light: viser's client takes the colours of batches and of line vertices as linear."""
    return np.round((np.asarray(colours, np.float64) / 255.0) ** 2.2 * 255.0).astype(np.uint8)


def robot_colours(robots: int) -> NDArray[np.float64]:
    """A colour for each robot, (robots, 3) sRGB 0 to 255; they repeat after eight."""
    return np.array([ROBOTS[index % len(ROBOTS)] for index in range(robots)], np.float64).reshape(-1, 3)

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
    mover: Rgb
    chassis: Rgb
    ray: Rgb
    hit: Rgb
    fan: Rgb
    shadow: float
    sun: float
    sky: Rgb
    ground: Rgb
    ambient: float
    ray_strength: float
    arrow: Rgb


COLOURS: dict[Theme, Colours] = {
    "dark": Colours(
        floor=(24, 28, 38),
        cell=(33, 38, 50),
        section=(48, 55, 71),
        wall=(58, 67, 88),
        obstacle=(72, 83, 108),
        mover=(186, 176, 160),
        chassis=(92, 100, 116),
        ray=(70, 200, 235),
        hit=(255, 110, 88),
        fan=(40, 125, 185),
        shadow=0.5,
        sun=1.8,
        sky=(200, 215, 255),
        ground=(90, 98, 122),
        ambient=2.6,
        ray_strength=0.34,
        arrow=(132, 146, 176),
    ),
    "light": Colours(
        floor=(250, 251, 253),
        cell=(236, 239, 244),
        section=(219, 224, 232),
        wall=(150, 163, 186),
        obstacle=(124, 140, 168),
        mover=(104, 82, 120),
        chassis=(98, 106, 122),
        ray=(20, 140, 200),
        hit=(232, 62, 40),
        fan=(90, 190, 240),
        shadow=0.18,
        sun=1.7,
        sky=(255, 255, 255),
        ground=(205, 212, 224),
        ambient=2.2,
        ray_strength=0.5,
        arrow=(96, 110, 138),
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


def robot_colours(robots: int, first: int = 0) -> NDArray[np.float64]:
    """A colour for each robot from that number on, (robots, 3) sRGB 0 to 255; they repeat after eight."""
    return np.array([ROBOTS[(first + index) % len(ROBOTS)] for index in range(robots)], np.float64).reshape(-1, 3)


def css_colour(robot: int) -> str:
    """A robot's colour as CSS writes it: `#339af0`."""
    return "#{:02x}{:02x}{:02x}".format(*ROBOTS[robot % len(ROBOTS)])

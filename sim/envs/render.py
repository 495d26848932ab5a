"""Pictures of a robot in its arena from above, in NumPy alone: signed distances give smooth edges for free."""

from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from sim.arenas import Arena, free_distance
from sim.arenas.geometry import box_distance
from sim.engine.world import World
from sim.lidar import drawn_ray_angles, ray_origins

LONG_SIDE = 480
"""Pixels of a picture's longer side."""

_MARGIN = 0.25  # m of wall around the arena
_FLOOR = np.array([250, 250, 247], dtype=np.float32)
_OBSTACLE = np.array([76, 84, 96], dtype=np.float32)
_MOVER = np.array([133, 79, 170], dtype=np.float32)
_RAY = np.array([228, 87, 61], dtype=np.float32)
_TARGET = np.array([32, 150, 92], dtype=np.float32)
_BODY = np.array([41, 98, 205], dtype=np.float32)

Image = NDArray[np.float32]


@lru_cache(maxsize=8)
def _pixels(arena: Arena) -> tuple[NDArray[np.float64], float]:
    """Centres of the pixels, (height, width, 2) metres, and pixels per metre."""
    width, height = 2.0 * (arena.half_width + _MARGIN), 2.0 * (arena.half_height + _MARGIN)
    scale = LONG_SIDE / max(width, height)
    x = (np.arange(round(width * scale)) + 0.5) / scale - width / 2.0
    y = height / 2.0 - (np.arange(round(height * scale)) + 0.5) / scale
    return np.stack(np.meshgrid(x, y), axis=-1), scale


@lru_cache(maxsize=8)
def _background(arena: Arena) -> Image:
    """The arena without robots."""
    pixels, scale = _pixels(arena)
    image = np.broadcast_to(_FLOOR, (*pixels.shape[:2], 3)).copy()
    _paint(image, free_distance(arena, pixels) * scale, _OBSTACLE)
    return image


def _paint(image: Image, distance: NDArray[np.float64], colour: NDArray[np.float32], opacity: float = 1.0) -> None:
    """Paint where the signed distance, in pixels, is negative; the edge is one pixel soft."""
    cover = np.clip(0.5 - distance, 0.0, 1.0)[..., None].astype(np.float32) * np.float32(opacity)
    image += cover * (colour - image)


def render_robot(world: World, index: int) -> NDArray[np.uint8]:
    """One robot with its target, its rays and what moves in its arena, (height, width, 3) RGB."""
    robots = world.robots
    arena = world.arenas[robots.records["map"][index]]
    pixels, scale = _pixels(arena)
    image = _background(arena).copy()
    x, y, heading = robots.poses[index].astype(np.float64)

    ranges = robots.ranges[index].astype(np.float64)
    directions = heading + drawn_ray_angles(world.task.lidar, world.fields_of_view[index])
    along = np.arange(0.0, world.task.lidar.range, 1.0 / scale)
    seen = along[None, :] < ranges[:, None]
    from_x, from_y = ray_origins(world.task.lidar, robots.poses[index : index + 1])[0].T[:, :, None]
    px = (from_x + along * np.cos(directions)[:, None])[seen]
    py = (from_y + along * np.sin(directions)[:, None])[seen]
    rows = np.clip(((pixels[0, 0, 1] - py) * scale + 0.5).astype(int), 0, image.shape[0] - 1)
    columns = np.clip(((px - pixels[0, 0, 0]) * scale + 0.5).astype(int), 0, image.shape[1] - 1)
    image[rows, columns] = 0.65 * image[rows, columns] + 0.35 * _RAY

    for mx, my, mover_radius in world.movers.of(int(world.tiles()[index])).tolist():
        _paint(image, (np.hypot(*np.moveaxis(pixels - (mx, my), -1, 0)) - mover_radius) * scale, _MOVER)
    target = robots.targets[index].astype(np.float64)
    to_target = np.hypot(*np.moveaxis(pixels - target, -1, 0))
    _paint(image, (to_target - world.task.arrival_distance) * scale, _TARGET, 0.35)
    _paint(image, (to_target - 0.06) * scale, _TARGET)
    robot = world.task.robot
    radius = robot.inscribed_radius
    if robot.half_extents:
        body = box_distance(np.array([x, y, *robot.half_extents, heading]), pixels[..., 0], pixels[..., 1])
    else:
        body = np.hypot(*np.moveaxis(pixels - (x, y), -1, 0)) - radius
    _paint(image, body * scale, _BODY)
    nose = np.array([x + 0.55 * radius * np.cos(heading), y + 0.55 * radius * np.sin(heading)])
    _paint(image, (np.hypot(*np.moveaxis(pixels - nose, -1, 0)) - 0.35 * radius) * scale, _FLOOR)
    return image.round().astype(np.uint8)

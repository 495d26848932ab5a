"""Low-poly shapes of the scene: robots like a TurtleBot3 Burger or a Jackal, rings and beacons. Metres, z up, x ahead."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Places = Sequence[tuple[float, float]]
"""Where scanners stand on a body, x ahead and y to the left of its middle."""


@dataclass(frozen=True)
class Mesh:
    """A triangle mesh.

    Attributes:
        vertices: (V, 3) float32.
        faces: (F, 3) uint32, counter-clockwise seen from outside.
    """

    vertices: NDArray[np.float32]
    faces: NDArray[np.uint32]

    def __add__(self, other: "Mesh") -> "Mesh":
        """Both in one."""
        return Mesh(
            np.concatenate([self.vertices, other.vertices]),
            np.concatenate([self.faces, other.faces + np.uint32(len(self.vertices))]),
        )


def prism(outline: NDArray[np.float64], bottom: float, top: float) -> Mesh:
    """A convex outline (n, 2), counter-clockwise, drawn out from `bottom` to `top`."""
    n = len(outline)
    lower, upper = (np.column_stack([outline, np.full(n, z)]) for z in (bottom, top))
    i = np.arange(n)
    j = (i + 1) % n
    sides = np.concatenate([np.column_stack([i, j, n + j]), np.column_stack([i, n + j, n + i])])
    k = np.arange(1, n - 1)
    caps = np.concatenate([np.column_stack([n + 0 * k, n + k, n + k + 1]), np.column_stack([0 * k, k + 1, k])])
    return Mesh(np.concatenate([lower, upper]).astype(np.float32), np.concatenate([sides, caps]).astype(np.uint32))


def circle(radius: float, corners: int, centre: tuple[float, float] = (0.0, 0.0), turn: float = 0.0) -> NDArray[np.float64]:
    """The corners of a regular polygon, (corners, 2)."""
    angles = turn + np.linspace(0.0, 2.0 * np.pi, corners, endpoint=False)
    return np.column_stack([centre[0] + radius * np.cos(angles), centre[1] + radius * np.sin(angles)])


def rectangle(x: float, y: float, half_x: float, half_y: float) -> NDArray[np.float64]:
    """The corners of an axis-aligned rectangle, (4, 2)."""
    return np.array([[x - half_x, y - half_y], [x + half_x, y - half_y], [x + half_x, y + half_y], [x - half_x, y + half_y]])


def chassis(radius: float, scanners: Places) -> Mesh:
    """The dark parts of a robot: two decks, posts, wheels and the scanners on their necks."""
    r = radius
    deck = circle(0.92 * r, 12, turn=np.pi / 12)
    mesh = prism(deck, 0.25 * r, 0.45 * r) + prism(deck, 0.95 * r, 1.1 * r)
    for x, y in ((0.55, 0.55), (0.55, -0.55), (-0.55, 0.55), (-0.55, -0.55)):
        mesh += prism(circle(0.08 * r, 6, (x * r, y * r)), 0.45 * r, 1.4 * r)
    for side in (-1.0, 1.0):
        mesh += _wheel(0.32 * r, side * 0.93 * r, 0.09 * r)
    for place in scanners:
        mesh += prism(circle(0.34 * r, 14, place), 1.58 * r, 1.98 * r)
    return mesh


def shell(radius: float, scanners: Places) -> Mesh:
    """The coloured parts of a robot: the top deck with a nose that points ahead, and the scanners' caps."""
    r = radius
    half = np.linspace(0.36 * np.pi, 1.64 * np.pi, 13)
    deck = np.column_stack([0.98 * r * np.cos(half), 0.98 * r * np.sin(half)])
    outline = np.concatenate([deck, [[1.5 * r, 0.0]]])
    mesh = prism(outline, 1.38 * r, 1.58 * r)
    for place in scanners:
        mesh += prism(circle(0.26 * r, 14, place), 1.98 * r, 2.06 * r)
    return mesh


def box_chassis(half_length: float, half_width: float, scanners: Places) -> Mesh:
    """The dark parts of a robot with a rectangular body: hull, four wheels and the scanners on their necks."""
    r = min(half_length, half_width)
    wheel = min(0.45 * r, 0.45 * half_length)
    mesh = prism(rectangle(0.0, 0.0, half_length, 0.72 * half_width), 0.3 * r, 0.8 * r)
    for x in (-1.0, 1.0):
        for y in (-1.0, 1.0):
            part = _wheel(wheel, y * 0.87 * half_width, 0.13 * half_width)
            mesh += Mesh(part.vertices + np.array([x * (half_length - wheel), 0.0, 0.0], np.float32), part.faces)
    for place in scanners:
        mesh += prism(circle(0.28 * r, 14, place), 1.05 * r, 1.4 * r)
    return mesh


def box_shell(half_length: float, half_width: float, scanners: Places) -> Mesh:
    """The coloured parts of a robot with a rectangular body: the top deck with a nose that points ahead, and caps."""
    r = min(half_length, half_width)
    deck = prism(rectangle(0.0, 0.0, half_length, 0.98 * half_width), 0.92 * r, 1.05 * r)
    nose = np.array([[half_length, -0.4 * half_width], [half_length + 0.3 * r, 0.0], [half_length, 0.4 * half_width]])
    mesh = deck + prism(nose, 0.92 * r, 1.05 * r)
    for place in scanners:
        mesh += prism(circle(0.22 * r, 14, place), 1.4 * r, 1.48 * r)
    return mesh


def mover() -> Mesh:
    """Something that moves, of radius 1 and 0.6 m tall: a round foot that is as wide as it is, shoulders and a head."""
    foot = prism(circle(1.0, 28), 0.0, 0.06)
    body = prism(circle(0.72, 20), 0.06, 0.42)
    return foot + body + prism(circle(0.42, 16), 0.46, 0.6)


def ring(inner: float, outer: float, corners: int = 40) -> Mesh:
    """A flat ring on the floor, seen from above."""
    vertices = np.concatenate([circle(inner, corners), circle(outer, corners)])
    i = np.arange(corners)
    j = (i + 1) % corners
    faces = np.concatenate([np.column_stack([i, corners + i, corners + j]), np.column_stack([i, corners + j, j])])
    return Mesh(np.column_stack([vertices, np.zeros(2 * corners)]).astype(np.float32), faces.astype(np.uint32))


def _wheel(radius: float, y: float, half_width: float) -> Mesh:
    """A wheel that stands on the floor, its axle along y."""
    disc = prism(circle(radius, 14), -half_width, half_width)
    x, z, along = disc.vertices.T
    return Mesh(np.column_stack([x, y - along, z + radius]).astype(np.float32), disc.faces)

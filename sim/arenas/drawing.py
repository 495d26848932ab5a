"""An arena in characters, for a terminal: what was understood of a file, before anything is done with it."""

from itertools import pairwise

import numpy as np

from sim.arenas.document import to_arena
from sim.arenas.geometry import free_distance
from sim.config import ArenaFile, Patrol, Pedestrian, Timed

COLUMNS = 72
"""Characters across the longer side of an arena that is wider than high."""

_ROWS = 36  # at most
_ASPECT = 2.0  # a character is twice as high as wide
_LEGEND = {"#": "obstacle", "o": "way of what moves", "O": "where it starts", "S": "start", "T": "target"}


def draw(document: ArenaFile) -> str:
    """The walls, obstacles and ways of an arena from above, and a line that says what each sign is."""
    cell = max(document.width / COLUMNS, document.height / (_ASPECT * _ROWS))
    columns, rows = max(1, round(document.width / cell)), max(1, round(document.height / (_ASPECT * cell)))
    x = (np.arange(columns) + 0.5) * document.width / columns - 0.5 * document.width
    y = 0.5 * document.height - (np.arange(rows) + 0.5) * document.height / rows
    # A thin pillar between the middles of two characters shows as well.
    reach = 0.5 * cell
    blocked = free_distance(to_arena(document), np.stack(np.meshgrid(x, y), axis=-1)) < reach
    wall = (np.abs(x)[None, :] + reach >= 0.5 * document.width) | (np.abs(y)[:, None] + reach >= 0.5 * document.height)
    signs = np.where(blocked & ~wall, "#", " ")

    def put(sign: str, px: float, py: float) -> None:
        column = int((px / document.width + 0.5) * columns)
        row = int((0.5 - py / document.height) * rows)
        if 0 <= column < columns and 0 <= row < rows:
            signs[row, column] = sign

    for mover in document.movers:
        corners: list[tuple[float, float]] = []
        if isinstance(mover, Timed):
            corners = [(frame.x, frame.y) for frame in mover.keyframes]
        elif isinstance(mover, Pedestrian):
            corners = [(corner.x, corner.y) for corner in mover.waypoints]
        elif isinstance(mover, Patrol):
            corners = [(corner.x, corner.y) for corner in (*mover.waypoints, *mover.waypoints[:1])]
        for one, other in pairwise(corners):
            for part in np.linspace(0.0, 1.0, 2 * max(columns, rows)):
                put("o", one[0] + part * (other[0] - one[0]), one[1] + part * (other[1] - one[1]))
        if corners:
            put("O", *corners[0])
    if document.start is not None:
        put("S", document.start.x, document.start.y)
    if document.target is not None:
        put("T", document.target.x, document.target.y)
    lines = ["+" + "-" * columns + "+", *(f"|{''.join(row)}|" for row in signs), "+" + "-" * columns + "+"]
    shown = [f"{sign} {meaning}" for sign, meaning in _LEGEND.items() if (signs == sign).any()]
    return "\n".join([*lines, ", ".join(shown)] if shown else lines)

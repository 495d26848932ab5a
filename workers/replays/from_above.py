"""Pictures of a scenario from above: arena, ways, rays, what moves, the robots, and a caption that says who they are."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from PIL import Image, ImageDraw, ImageFont

from sim.arenas.document import to_arena
from sim.lidar import drawn_ray_angles, ray_origins
from workers.frames import Frame
from workers.replays.moments import Filmed
from workers.scene.themes import COLOURS, OUTCOMES, ROBOTS, Rgb, Theme

# Everything is drawn so many times larger, and then made smaller: edges come out smooth.
_FINER = 2
_MARGIN = 0.15  # m of wall around the arena
_MOST_OBLONG = 4.0
_LINE = 22  # pixels of a line of the caption
_TEXT = 14
_PAPER = 10
# Who is shown beside the first is a ghost: this much of its own colour, the rest is what lies below.
_GHOST = 0.5
_WAY = 0.4
_RAY = 0.45
_TARGET = 0.3
_OUTCOMES = {"arrival": "arrived", "collision": "collided", "timeout": "timed out"}
_MAX_TITLE = 60

Point = tuple[float, float]


@dataclass(frozen=True, eq=False)
class Shown:
    """What is to be seen.

    Attributes:
        filmed: who drove; the first with its rays, all others as ghosts.
        titles: theirs.
        suite: its name.
        episode: its place in the suite, from 0.
        theme: light or dark.
    """

    filmed: Sequence[Filmed]
    titles: Sequence[str]
    suite: str
    episode: int
    theme: Theme


class FromAbove:
    """Draws one picture after another of a scenario.

    Args:
        shown: what.
        long_side: pixels of the arena's longer side; the caption comes below it.
    """

    def __init__(self, shown: Shown, long_side: int) -> None:
        self._shown = shown
        self._colours = COLOURS[shown.theme]
        self._dark = shown.theme == "dark"
        self._arena = to_arena(shown.filmed[0].track.arena)
        self._half = self._arena.half_width + _MARGIN, self._arena.half_height + _MARGIN
        self._scale = long_side / (2.0 * max(self._half))
        lines = 1 + len(shown.filmed)
        # H.264 wants even numbers.
        self._drawn = _even(2.0 * self._half[0] * self._scale), _even(2.0 * self._half[1] * self._scale)
        self.size = max(self._drawn[0], _even(long_side / _MOST_OBLONG)), self._drawn[1] + _even(lines * _LINE + 2 * _PAPER)
        self._font = ImageFont.load_default(_TEXT * _FINER)
        self._background = self._still()

    def pixel(self, x: float, y: float) -> Point:
        """Where a point of the arena, metres, lies in a picture: columns from the left, rows from above."""
        return (x + self._half[0]) * self._scale, (self._half[1] - y) * self._scale

    def picture(self, frames: Sequence[Frame], seconds: float) -> Image.Image:
        """One moment.

        Args:
            frames: one of each who drove.
            seconds: since the start.
        """
        image = self._background.copy()
        draw = ImageDraw.Draw(image, "RGBA")
        first = frames[0]
        if seconds <= self._shown.filmed[0].seconds + 1e-9:
            self._rays(draw, first)
        for x, y, radius in first.movers.tolist():
            self._disc(draw, (x, y), radius, self._colours.mover)
        for number in reversed(range(len(frames))):
            self._robot(draw, number, frames[number].poses[0], seconds)
        self._caption(draw, seconds)
        return image.reduce(_FINER)

    # -- what stands still ------------------------------------------------------------------------------------------------

    def _still(self) -> Image.Image:
        colours, arena = self._colours, self._arena
        image = Image.new("RGB", (self.size[0] * _FINER, self.size[1] * _FINER), self._paper)
        draw = ImageDraw.Draw(image, "RGBA")
        draw.rectangle((0, 0, self._drawn[0] * _FINER - 1, self._drawn[1] * _FINER - 1), colours.wall)
        inside = [*self._at(-arena.half_width, arena.half_height), *self._at(arena.half_width, -arena.half_height)]
        draw.rectangle(inside, colours.floor)
        for metre in range(math.ceil(-arena.half_width), math.floor(arena.half_width) + 1):
            draw.line([self._at(metre, -arena.half_height), self._at(metre, arena.half_height)], colours.section, _FINER)
        for metre in range(math.ceil(-arena.half_height), math.floor(arena.half_height) + 1):
            draw.line([self._at(-arena.half_width, metre), self._at(arena.half_width, metre)], colours.section, _FINER)
        for x, y, radius in arena.circles.tolist():
            self._disc(draw, (x, y), radius, colours.obstacle)
        for x, y, half_x, half_y, angle in arena.boxes.tolist():
            draw.polygon(self._box(x, y, half_x, half_y, angle), colours.obstacle)
        for number, each in reversed(list(enumerate(self._shown.filmed))):
            self._line(draw, each.track.poses[:, :2], _faint(ROBOTS[number], _WAY))
        first = self._shown.filmed[0]
        target = (float(first.track.target[0]), float(first.track.target[1]))
        self._disc(draw, target, first.task.arrival_distance, _faint(OUTCOMES[1], _TARGET))
        self._disc(draw, target, 0.25 * first.task.arrival_distance, OUTCOMES[1])
        return image

    # -- what moves -------------------------------------------------------------------------------------------------------

    def _rays(self, draw: ImageDraw.ImageDraw, frame: Frame) -> None:
        task, colours = self._shown.filmed[0].task, self._colours
        angles = frame.poses[0, 2] + drawn_ray_angles(task.lidar, frame.fields_of_view)[0]
        origins = ray_origins(task.lidar, frame.poses)[0]
        ends = origins + frame.ranges[0][:, None] * np.column_stack([np.cos(angles), np.sin(angles)])
        for origin, end, reach in zip(origins.tolist(), ends.tolist(), frame.ranges[0].tolist(), strict=True):
            draw.line([self._at(*origin), self._at(*end)], _faint(colours.ray, _RAY), _FINER)
            if reach < task.lidar.range - 1e-3:
                self._disc(draw, (end[0], end[1]), 1.8 / self._scale, colours.hit)

    def _robot(self, draw: ImageDraw.ImageDraw, number: int, pose: NDArray[np.float32], seconds: float) -> None:
        """The way so far, the body with a nose, and a ring in the outcome's colour once it has ended."""
        each, strength = self._shown.filmed[number], 1.0 if number == 0 else _GHOST
        driven = min(round(seconds / each.task.control_period), len(each.track.poses) - 1)
        way = np.concatenate([each.track.poses[:driven, :2], pose[None, :2]])
        self._line(draw, way, _faint(ROBOTS[number], strength))
        x, y, heading = pose.tolist()
        robot, own = each.task.robot, _faint(ROBOTS[number], strength)
        radius = robot.inscribed_radius
        if robot.half_extents is None:
            self._disc(draw, (x, y), radius, own)
        else:
            draw.polygon(self._box(x, y, *robot.half_extents, heading), own)
        ahead = robot.half_extents[0] if robot.half_extents else radius
        nose = [(ahead, 0.0), (0.45 * ahead, 0.4 * radius), (0.45 * ahead, -0.4 * radius)]
        cos, sin = math.cos(heading), math.sin(heading)
        corners = [self._at(x + cos * forwards - sin * left, y + sin * forwards + cos * left) for forwards, left in nose]
        draw.polygon(corners, _faint((255, 255, 255), strength))
        if each.seconds <= seconds + 1e-9:
            column, row = self._at(x, y)
            reach = 1.7 * robot.circumscribed_radius * self._scale * _FINER
            draw.ellipse((column - reach, row - reach, column + reach, row + reach), outline=OUTCOMES[each.outcome], width=6)

    def _caption(self, draw: ImageDraw.ImageDraw, seconds: float) -> None:
        left, top = _PAPER * _FINER, (self._drawn[1] + _PAPER) * _FINER
        draw.text((left, top), f"Episode {self._shown.episode + 1} of {self._shown.suite}", self._ink, self._font)
        right = self.size[0] * _FINER - left
        draw.text((right, top), f"{seconds:.1f} s", self._ink, self._font, anchor="ra")
        for number, (each, title) in enumerate(zip(self._shown.filmed, self._shown.titles, strict=True)):
            row = top + (number + 1) * _LINE * _FINER
            dot = _TEXT * _FINER
            draw.ellipse((left, row + 4, left + dot - 6, row + dot - 2), ROBOTS[number])
            ended = each.seconds <= seconds + 1e-9
            said = f", {_OUTCOMES[each.result.outcome]} after {each.seconds:.1f} s" if ended else ""
            short = title if len(title) <= _MAX_TITLE else f"{title[: _MAX_TITLE - 3]}..."
            draw.text((left + dot + 4, row), f"{short}{said}", self._ink, self._font)

    # -- with what it is drawn --------------------------------------------------------------------------------------------

    @property
    def _paper(self) -> Rgb:
        return (16, 19, 26) if self._dark else (255, 255, 255)

    @property
    def _ink(self) -> Rgb:
        return (222, 226, 234) if self._dark else (40, 46, 58)

    def _at(self, x: float, y: float) -> Point:
        column, row = self.pixel(x, y)
        return column * _FINER, row * _FINER

    def _disc(self, draw: ImageDraw.ImageDraw, at: Point, radius: float, colour: tuple[int, ...]) -> None:
        column, row = self._at(*at)
        reach = radius * self._scale * _FINER
        draw.ellipse((column - reach, row - reach, column + reach, row + reach), colour)

    def _box(self, x: float, y: float, half_x: float, half_y: float, angle: float) -> list[Point]:
        cos, sin = math.cos(angle), math.sin(angle)
        return [
            self._at(x + cos * along - sin * across, y + sin * along + cos * across)
            for along, across in ((half_x, half_y), (half_x, -half_y), (-half_x, -half_y), (-half_x, half_y))
        ]

    def _line(self, draw: ImageDraw.ImageDraw, points: ArrayLike, colour: tuple[int, ...]) -> None:
        places = [self._at(x, y) for x, y in np.asarray(points).tolist()]
        if len(places) > 1:
            draw.line(places, colour, 2 * _FINER, joint="curve")


def _even(number: float) -> int:
    return 2 * math.ceil(number / 2.0)


def _faint(colour: Rgb, strength: float) -> tuple[int, int, int, int]:
    return (*colour, round(255 * strength))

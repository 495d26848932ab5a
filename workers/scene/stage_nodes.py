"""The nodes of a playground: obstacles that move, the way ahead, arrows, and handles to drag things by.

A click chooses what it meets, or puts the target where it meets the floor; what is chosen has handles. Both come from
browsers, and are checked before they are believed: by the bridge as messages, by the playground as wishes.
"""

import math

import numpy as np
import viser
from numpy.typing import NDArray

from sim.config import TaskConfig
from workers.frames import Frame
from workers.scene.stage import Stage, StagePicture
from workers.scene.themes import OUTCOMES, Colours, linear

HANDLE = "/world/handle"
"""The node with the handles."""

GRABS = ("/world/grab", "/world/hold")
"""What may be taken hold of beside these: a wide disc on the floor, and the room in which the thing stands."""

_WORLD = "/world"
OBSTACLE_HEIGHT = 0.45
_WAY_HEIGHT = 0.03
_ARROW_HEIGHT = 0.015
_ARROW_HEAD = 0.35
_HEAD_ANGLE = 2.6
# What a click may miss something by, metres.
_REACH = 0.12
# Of the handles, metres: around the thing, and where that is small, as large as before.
_HANDLE_SCALE = 0.7
# A ring to turn by is at that share of the scale.
_RING = 0.65
# A finger covers about a third of a metre of a picture that shows a whole arena.
_GRAB_RADIUS = 0.6
_GRAB_HEIGHT = 0.02
_GRAB_OPACITY = 0.16
_HOLD_HEIGHT = OBSTACLE_HEIGHT + 0.05
_TARGET_RADIUS = 0.2
_HOLD_MARGIN = 0.08
# Heights at which a click's ray is looked at, from the top of an obstacle to the floor, metres.
_HEIGHTS = np.linspace(OBSTACLE_HEIGHT, 0.0, 10)
_NAMES: dict[str | None, int] = {None: 0, "arrival": 1, "collision": 2, "timeout": 3}


class StageNodes:
    """The nodes of a stage in one scene.

    Args:
        server: where they live.
        centre: (3,) the point of the arena under the camera, as it changes.
        stage: whose.
        task: for the robot's size.
        colours: of the theme.
    """

    def __init__(
        self, server: viser.ViserServer, centre: NDArray[np.float64], stage: Stage, task: TaskConfig, colours: Colours
    ) -> None:
        self._server, self._centre, self._stage, self._colours = server, centre, stage, colours
        self._robot_radius = task.robot.circumscribed_radius
        self._obstacles: dict[tuple[str, int], tuple[tuple[float, ...], viser.SceneNodeHandle]] = {}
        self._way: viser.LineSegmentsHandle | None = None
        self._arrows: viser.LineSegmentsHandle | None = None
        self._drawn: tuple[bytes, bytes] = b"", b""
        self._chosen: tuple[str, int] | None = None
        self._handle: viser.TransformControlsHandle | None = None
        self._dragging = False
        self._grabs: list[viser.CylinderHandle] = []
        self._grab_radius = 0.0
        # From where something was taken hold of to its middle, metres.
        self._held: tuple[float, float] | None = None
        self._frame: Frame | None = None
        server.scene.on_click()(self._clicked)

    def update(self, frame: Frame | None) -> None:
        """Draws how things stand; None where nothing drives yet."""
        if frame is not None:
            self._frame = frame
            self._stage.shown(frame.sim_time)
        picture = self._stage.picture()
        self._draw_obstacles(picture)
        self._draw_lines(picture)
        self._draw_handle(picture)

    # -- drawing ----------------------------------------------------------------------------------------------------------

    def _draw_obstacles(self, picture: StagePicture) -> None:
        rows = [(("circle", index), tuple(row)) for index, row in enumerate(picture.circles.tolist())]
        rows += [(("box", index), tuple(row)) for index, row in enumerate(picture.boxes.tolist())]
        for key in self._obstacles.keys() - {key for key, _ in rows}:
            self._obstacles.pop(key)[1].remove()
        for key, row in rows:
            shape, node = self._obstacles.get(key, ((), None))
            if row == shape:
                continue
            if node is None or row[2:4] != shape[2:4]:
                node = self._add(key, row)
            node.position = (row[0], row[1], OBSTACLE_HEIGHT / 2)
            if key[0] == "box":
                node.wxyz = _turned(row[4])
            self._obstacles[key] = row, node

    def _add(self, key: tuple[str, int], row: tuple[float, ...]) -> viser.SceneNodeHandle:
        """A node of that name; one that was there goes."""
        name, colour = f"{_WORLD}/{key[0]}/{key[1]}", self._colours.obstacle
        if key[0] == "circle":
            return self._server.scene.add_cylinder(name, row[2], OBSTACLE_HEIGHT, colour, radial_segments=40)
        return self._server.scene.add_box(name, colour, (2 * row[2], 2 * row[3], OBSTACLE_HEIGHT))

    def _draw_lines(self, picture: StagePicture) -> None:
        told = picture.way.tobytes() + str(picture.outcome).encode(), picture.arrows.tobytes()
        if told[0] != self._drawn[0]:
            line = np.column_stack([picture.way, np.full(len(picture.way), _WAY_HEIGHT)])
            colour = linear(OUTCOMES[_NAMES[picture.outcome]])
            self._way = self._lines("way", self._way, np.stack([line[:-1], line[1:]], axis=1), colour, 4.0)
        if told[1] != self._drawn[1]:
            colour = linear(self._colours.arrow)
            self._arrows = self._lines("arrows", self._arrows, _arrow_lines(picture.arrows), colour, 2.0)
        self._drawn = told

    def _lines(
        self,
        name: str,
        node: viser.LineSegmentsHandle | None,
        lines: NDArray[np.float64],
        colour: NDArray[np.uint8],
        thickness: float,
    ) -> viser.LineSegmentsHandle | None:
        if node is not None:
            node.remove()
        if not len(lines):
            return None
        colours = np.broadcast_to(colour, (len(lines), 2, 3)).copy()
        return self._server.scene.add_line_segments(
            f"{_WORLD}/{name}", lines.astype(np.float32), colours, thickness=thickness, thickness_units="screen"
        )

    def _draw_handle(self, picture: StagePicture) -> None:
        place = self._place(picture, picture.chosen)
        radius = 0.0 if picture.chosen is None else self._radius(picture, picture.chosen)
        if picture.chosen != self._chosen or place is None or abs(radius - self._grab_radius) > 1e-3:
            for node in (self._handle, *self._grabs):
                if node is not None:
                    node.remove()
            self._handle, self._dragging, self._grabs, self._held = None, False, [], None
            self._chosen, self._grab_radius = picture.chosen if place is not None else None, radius
        if place is None or self._chosen is None or self._dragging:
            return
        x, y, angle = place
        if self._handle is None:
            turns = self._chosen[0] in ("robot", "box")
            self._add_grabs(radius)
            self._handle = self._server.scene.add_transform_controls(
                HANDLE,
                scale=max(_HANDLE_SCALE, (radius + 2 * _HOLD_MARGIN) / _RING),
                line_width=4.0,
                active_axes=(True, True, False),
                disable_rotations=not turns,
                depth_test=False,
            )
            self._handle.on_update(self._dragged)
        position, turn = (x, y, 0.05), _turned(angle)
        if not np.allclose(self._handle.position, position, atol=1e-3):
            self._handle.position = position
        if not np.allclose(self._handle.wxyz, turn, atol=1e-3):
            self._handle.wxyz = turn
        for node in self._grabs:
            if not np.allclose(node.position[:2], (x, y), atol=1e-3):
                node.position = (x, y, node.position[2])

    def _add_grabs(self, radius: float) -> None:
        """The handles are thin: beside them the thing itself and a disc around it can be taken hold of, by fingers too."""
        shapes = ((max(_GRAB_RADIUS, radius + 0.2), _GRAB_HEIGHT, _GRAB_OPACITY), (radius + _HOLD_MARGIN, _HOLD_HEIGHT, 0.0))
        for name, (wide, high, opacity) in zip(GRABS, shapes, strict=True):
            node = self._server.scene.add_cylinder(
                name, wide, high, self._colours.arrow, radial_segments=32, opacity=opacity, position=(0.0, 0.0, high / 2)
            )
            node.on_drag("left")(self._grabbed)
            self._grabs.append(node)

    def _radius(self, picture: StagePicture, chosen: tuple[str, int]) -> float:
        """Of the circle around a thing, metres."""
        thing, index = chosen
        if thing == "robot":
            return self._robot_radius
        if thing == "circle" and index < len(picture.circles):
            return float(picture.circles[index, 2])
        if thing == "box" and index < len(picture.boxes):
            return float(np.hypot(*picture.boxes[index, 2:4]))
        if thing == "mover" and self._frame is not None and index < len(self._frame.movers):
            return float(self._frame.movers[index, 2])
        return _TARGET_RADIUS

    def _place(self, picture: StagePicture, chosen: tuple[str, int] | None) -> tuple[float, float, float] | None:
        """x, y and angle of a thing; None where it is not there."""
        thing, index = chosen or ("", 0)
        frame = self._frame
        if thing == "circle" and index < len(picture.circles):
            return float(picture.circles[index, 0]), float(picture.circles[index, 1]), 0.0
        if thing == "box" and index < len(picture.boxes):
            x, y, _, _, angle = picture.boxes[index].tolist()
            return x, y, angle
        if frame is None:
            return None
        if thing == "robot":
            x, y, angle = frame.poses[0].tolist()
            return x, y, angle
        if thing == "target":
            return float(frame.targets[0, 0]), float(frame.targets[0, 1]), 0.0
        if thing == "mover" and index < len(frame.movers):
            return float(frame.movers[index, 0]), float(frame.movers[index, 1]), 0.0
        return None

    # -- what people do ---------------------------------------------------------------------------------------------------

    def _dragged(self, event: viser.TransformControlsEvent) -> None:
        self._dragging = event.phase != "end"
        chosen = self._chosen
        if chosen is None or event.phase == "start":
            return
        x, y, _ = event.target.position
        w, _, _, z = event.target.wxyz
        self._stage.put(*chosen, float(x), float(y), math.degrees(2.0 * math.atan2(float(z), float(w))) % 360.0)

    async def _grabbed(self, event: viser.SceneNodeDragEvent[viser.CylinderHandle]) -> None:
        """Somebody drags what stands there; asynchronous, so that one move comes after another."""
        chosen, place = self._chosen, None
        if chosen is not None:
            place = self._place(self._stage.picture(), chosen)
        point = self._on_floor(np.array(event.client.camera.position), np.array(event.end_position))
        if chosen is None or place is None or point is None:
            return
        x, y, angle = place
        if event.phase == "start":
            start = self._on_floor(np.array(event.client.camera.position), np.array(event.start_position))
            self._held = None if start is None else (x - start[0], y - start[1])
        if self._held is not None:
            self._stage.put(*chosen, point[0] + self._held[0], point[1] + self._held[1], math.degrees(angle) % 360.0)
        if event.phase == "end":
            self._held = None

    def _on_floor(self, eye: NDArray[np.float64], through: NDArray[np.float64]) -> tuple[float, float] | None:
        """Where somebody sees the floor through a point, in the arena; None where they look past it."""
        direction = through - eye
        if not (np.isfinite(eye).all() and np.isfinite(direction).all()) or direction[2] > -1e-6:
            return None
        x, y, _ = (eye - eye[2] / direction[2] * direction + self._centre).tolist()
        return x, y

    def _clicked(self, event: viser.SceneClickEvent) -> None:
        origin, direction = np.array(event.ray_origin), np.array(event.ray_direction)
        if not (np.isfinite(origin).all() and np.isfinite(direction).all()) or abs(direction[2]) < 1e-6:
            return
        points = origin + ((_HEIGHTS - origin[2]) / direction[2])[:, None] * direction + self._centre
        found = self._met(points)
        if found is not None:
            self._stage.choose(*found)
            return
        x, y, _ = points[-1].tolist()
        self._stage.put("target", 0, x, y, 0.0)

    def _met(self, points: NDArray[np.float64]) -> tuple[str, int] | None:
        """The first thing on a ray's way (n, 3) down to the floor."""
        picture, frame = self._stage.picture(), self._frame
        rows = picture.boxes
        for x, y, _ in points.tolist():
            if frame is not None:
                if math.hypot(*(frame.poses[0, :2] - (x, y)).tolist()) < self._robot_radius + _REACH:
                    return "robot", 0
                for index, (mx, my, radius) in enumerate(frame.movers.tolist()):
                    if math.hypot(mx - x, my - y) < radius:
                        return "mover", index
            for index, (cx, cy, radius) in enumerate(picture.circles.tolist()):
                if math.hypot(cx - x, cy - y) < radius:
                    return "circle", index
            for index, (bx, by, length, width, angle) in enumerate(rows.tolist()):
                along = (x - bx) * math.cos(angle) + (y - by) * math.sin(angle)
                across = (y - by) * math.cos(angle) - (x - bx) * math.sin(angle)
                if abs(along) < length and abs(across) < width:
                    return "box", index
        return None


def _turned(angle: float) -> tuple[float, float, float, float]:
    return math.cos(angle / 2), 0.0, 0.0, math.sin(angle / 2)


def _arrow_lines(arrows: NDArray[np.float64]) -> NDArray[np.float64]:
    """(3 A, 2, 3) shafts and the two sides of each head."""
    tails, tips = arrows[:, :2], arrows[:, 2:]
    shafts = tips - tails
    lines = [np.stack([tails, tips], axis=1)]
    for turn in (_HEAD_ANGLE, -_HEAD_ANGLE):
        cos, sin = math.cos(turn), math.sin(turn)
        side = _ARROW_HEAD * np.column_stack(
            [cos * shafts[:, 0] - sin * shafts[:, 1], sin * shafts[:, 0] + cos * shafts[:, 1]]
        )
        lines.append(np.stack([tips, tips + side], axis=1))
    flat = np.concatenate(lines)
    return np.concatenate([flat, np.full((*flat.shape[:2], 1), _ARROW_HEIGHT)], axis=2)

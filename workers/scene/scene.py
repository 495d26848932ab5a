"""The scene of one run: light, floor, walls and obstacles, built once, and the robots and movers that come and go in it."""

import numpy as np
import viser

from sim.arenas import Arena, arena_clearance, build_arena
from sim.config import TaskConfig
from workers.frames import Frame
from workers.scene.movers import MoverNodes
from workers.scene.moving import ByViser, Moving
from workers.scene.robots import RobotNodes
from workers.scene.stage import Stage
from workers.scene.stage_nodes import OBSTACLE_HEIGHT, StageNodes
from workers.scene.themes import COLOURS, Colours, Theme

# Everything hangs below this node, so that one message moves the world under the camera when it follows a robot.
_WORLD = "/world"
_ARENA = f"{_WORLD}/arena"
_WALL_HEIGHT = 0.3
_WALL_THICKNESS = 0.1


class Scene:
    """One run's scene; broadcast to every browser that watches it in the same theme.

    Args:
        server: where the nodes live.
        task: the place, and the geometry of robot and LiDAR.
        theme: light or dark.
        moving: where the nodes that move are set.
    """

    def __init__(self, server: viser.ViserServer, task: TaskConfig, theme: Theme, moving: Moving | None = None) -> None:
        self._server = server
        self._moving = moving or ByViser()
        self._task = task
        self._colours = COLOURS[theme]
        self._rays: tuple[bool, int | None] = (True, None)
        self._robots: RobotNodes | None = None
        self._movers: MoverNodes | None = None
        self._shape: tuple[int, ...] = ()
        self._centre = np.zeros(3)
        self._world = server.scene.add_frame(_WORLD, show_axes=False)
        _light(server, theme, self._colours)
        self._enter(0)

    def add_stage(self, stage: Stage) -> StageNodes:
        """Nodes for what a playground draws, below the world that moves under the camera."""
        return StageNodes(self._server, self._centre, stage, self._task, self._colours)

    def add_robots(self, task: TaskConfig, frame: Frame, number: int) -> RobotNodes:
        """Robots of another task in the same place, without rays; whoever adds them updates them.

        Args:
            task: geometry of robot and LiDAR.
            frame: the first frame to draw.
            number: of the first of them, for its colour.
        """
        parent = f"{_WORLD}/beside{number}"
        robots = RobotNodes(self._server, self._moving, parent, task, self._colours, frame, first=number)
        robots.show_rays(visible=False, robot=None)
        return robots

    @property
    def half_size(self) -> float:
        """Half the longer side of the arena, metres."""
        return max(self._arena.half_width, self._arena.half_height)

    def centre_on(self, x: float, y: float) -> None:
        """Moves the world so that the point (x, y) of the arena lies where the camera looks."""
        self._centre[:2] = x, y
        self._moving.put(self._world, "position", -self._centre)

    def show_rays(self, visible: bool, robot: int | None) -> None:
        """Shows or hides rays, hits and scanned area; those of one robot, or of all where it is None."""
        if (visible, robot) == self._rays:
            return
        self._rays = visible, robot
        if self._robots is not None:
            self._robots.show_rays(visible, robot)

    def update(self, frame: Frame, now: float) -> None:
        """Draws a frame.

        Args:
            frame: what to draw.
            now: seconds of the wall clock, for what fades.
        """
        if frame.arena != self._arena_index:
            self._place.remove()
            self._enter(frame.arena)
        if self._robots is None or self._shape != frame.ranges.shape:
            if self._robots is not None:
                self._robots.remove()
            self._shape = frame.ranges.shape
            self._robots = RobotNodes(self._server, self._moving, _WORLD, self._task, self._colours, frame)
            self._robots.show_rays(*self._rays)
        self._robots.update(frame, now)
        if len(frame.movers) != (0 if self._movers is None else len(self._movers)):
            if self._movers is not None:
                self._movers.remove()
            self._movers = None
            if len(frame.movers):
                self._movers = MoverNodes(self._server, self._moving, _WORLD, self._colours, len(frame.movers))
        if self._movers is not None:
            self._movers.update(frame)

    def _enter(self, index: int) -> None:
        """Builds the arena of that number in the task's pool."""
        self._arena_index = index
        self._arena = build_arena(self._task.arena, index, clearance=arena_clearance(self._task))
        self._place = self._server.scene.add_frame(_ARENA, show_axes=False)
        _build(self._server, self._arena, self._colours)


def _light(server: viser.ViserServer, theme: Theme, colours: Colours) -> None:
    scene = server.scene
    scene.world_axes.visible = False
    scene.set_up_direction("+z")
    # No picture of a studio is needed for flat surfaces; without one, the scene is there at once.
    scene.configure_environment_map(None)
    scene.add_light_hemisphere("/sky", sky_color=colours.sky, ground_color=colours.ground, intensity=colours.ambient)
    # viser's own lights are three times as bright as the colours of the theme bear.
    scene.configure_default_lights(enabled=False)
    scene.add_light_directional("/sun", intensity=colours.sun, cast_shadow=True, position=(-2.0, -3.0, 8.0))
    server.gui.configure_theme(dark_mode=theme == "dark", show_logo=False, show_share_button=False)


def _build(server: viser.ViserServer, arena: Arena, colours: Colours) -> None:
    scene = server.scene
    width, height = 2 * arena.half_width, 2 * arena.half_height
    scene.add_grid(
        f"{_ARENA}/floor",
        width,
        height,
        cell_size=0.5,
        cell_color=colours.cell,
        section_size=1.0,
        section_color=colours.section,
        plane_color=colours.floor,
        plane_opacity=1.0,
        shadow_opacity=colours.shadow,
        position=(0.0, 0.0, -0.005),
    )
    side = arena.half_width + _WALL_THICKNESS / 2
    end = arena.half_height + _WALL_THICKNESS / 2
    long = width + 2 * _WALL_THICKNESS
    for name, x, y, size_x, size_y in (
        ("east", side, 0.0, _WALL_THICKNESS, height),
        ("west", -side, 0.0, _WALL_THICKNESS, height),
        ("north", 0.0, end, long, _WALL_THICKNESS),
        ("south", 0.0, -end, long, _WALL_THICKNESS),
    ):
        scene.add_box(
            f"{_ARENA}/walls/{name}", colours.wall, (size_x, size_y, _WALL_HEIGHT), position=(x, y, _WALL_HEIGHT / 2)
        )
    for index, (x, y, radius) in enumerate(arena.circles):
        scene.add_cylinder(
            f"{_ARENA}/circles/{index}",
            float(radius),
            OBSTACLE_HEIGHT,
            colours.obstacle,
            radial_segments=40,
            position=(float(x), float(y), OBSTACLE_HEIGHT / 2),
        )
    for index, (x, y, half_x, half_y, angle) in enumerate(arena.boxes):
        scene.add_box(
            f"{_ARENA}/boxes/{index}",
            colours.obstacle,
            (2 * float(half_x), 2 * float(half_y), OBSTACLE_HEIGHT),
            position=(float(x), float(y), OBSTACLE_HEIGHT / 2),
            wxyz=(float(np.cos(angle / 2)), 0.0, 0.0, float(np.sin(angle / 2))),
        )

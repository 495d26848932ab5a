"""The nodes that move: robots, trails, targets, and the rings that flash when an attempt ends."""

import numpy as np
import viser
from numpy.typing import NDArray

from sim.config import TaskConfig
from workers.frames import Frame
from workers.scene import meshes
from workers.scene.continuity import continues, ended
from workers.scene.moving import Moving
from workers.scene.rays import RayNodes
from workers.scene.themes import OUTCOMES, Colours, linear, robot_colours
from workers.scene.trails import Trails, trail_colours

_TARGET_HEIGHT = 0.025
_FLASH_HEIGHT = 0.03
_ARRIVAL = 1
# What light falls on looks paler than the line of the same colour.
_LIT = 0.9
_FLASH_SECONDS = 0.9
# From this many robots on, filled scans and long trails would paint the whole floor.
_FEW = 16


class RobotNodes:
    """A fixed number of robots with a fixed number of rays below one node.

    Args:
        server: where the nodes live.
        moving: where they are set.
        parent: path of the node to hang them under.
        task: geometry of robot and LiDAR.
        colours: of the theme.
        frame: the first frame to draw.
        first: number of the first robot, for its colour.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        moving: Moving,
        parent: str,
        task: TaskConfig,
        colours: Colours,
        frame: Frame,
        *,
        first: int = 0,
    ) -> None:
        robots = len(frame.poses)
        scene = server.scene
        chassis, shell = _body(task)
        halo = max(task.collision_distance, 1.5 * task.robot.inscribed_radius)
        few = robots <= _FEW
        own = robot_colours(robots, first)
        still = np.tile(np.array([1.0, 0.0, 0.0, 0.0], np.float32), (robots, 1))
        nowhere = np.zeros((robots, 3), np.float32)

        self._moving = moving
        self._lidar, self._colours, self._few = task.lidar, colours, few
        self._scene, self._parent = scene, parent
        self._rays: RayNodes | None = None
        self._rays_visible = True
        self._rays_of: int | None = None
        self._positions = np.zeros((robots, 3), np.float32)
        self._headings = np.zeros((robots, 4), np.float32)
        self._trails = Trails(frame.poses, 40 if few else 16, task.robot.max_linear_speed)
        self._last: Frame | None = None
        self._flashes = np.full(robots, -np.inf)
        self._flashing = False
        self._flash_places = np.zeros((robots, 3), np.float32)
        self._flash_tints = linear(own)

        def batch(name: str, mesh: meshes.Mesh, tint: NDArray[np.uint8], **look: bool | float) -> viser.BatchedMeshHandle:
            return scene.add_batched_meshes_simple(
                f"{parent}/{name}",
                mesh.vertices,
                mesh.faces,
                batched_wxyzs=still,
                batched_positions=nowhere,
                batched_colors=tint,
                lod="off",
                **look,  # type: ignore[arg-type]
            )

        self._chassis = batch(
            "chassis",
            chassis,
            linear(colours.chassis),
            flat_shading=True,
        )
        self._shells = batch("shells", shell, linear(_LIT * own), flat_shading=True)
        self._halos = batch(
            "halos",
            meshes.prism(
                meshes.circle(halo, 32),
                0.021,
                0.024,
            ),
            linear(_LIT * own),
            opacity=0.4,
            cast_shadow=False,
            receive_shadow=False,
        )
        self._goals = batch(
            "targets",
            meshes.ring(0.72 * task.arrival_distance, task.arrival_distance),
            linear(_LIT * own),
            cast_shadow=False,
            receive_shadow=False,
        )
        self._beacons = batch(
            "beacons",
            meshes.prism(meshes.circle(0.04, 16), 0.0, 0.6),
            linear(_LIT * own),
            opacity=0.7,
            cast_shadow=False,
            receive_shadow=False,
        )
        self._rings = scene.add_batched_meshes_simple(
            f"{parent}/flashes",
            *_mesh_arguments(meshes.ring(0.8, 1.0, corners=48)),
            batched_wxyzs=still,
            batched_positions=nowhere,
            batched_scales=np.full(robots, 1e-3, np.float32),
            batched_opacities=np.zeros(robots, np.float32),
            batched_colors=linear(own),
            lod="off",
            opacity=1.0,
            cast_shadow=False,
            receive_shadow=False,
        )
        shades = linear(trail_colours(own, np.array(colours.floor, np.float64), 40 if few else 16)).reshape(robots, -1, 2, 3)
        # What a robot has left behind changes when a point is added, its end with every step.
        self._trail_ends, self._trail_lines = (
            scene.add_line_segments(
                f"{parent}/{name}", points, tints.reshape(-1, 2, 3), thickness=2.5, thickness_units="screen"
            )
            for name, points, tints in (
                ("trail_ends", self._trails.newest(), shades[:, :1]),
                ("trails", self._trails.older(), shades[:, 1:]),
            )
        )

    def update(self, frame: Frame, now: float) -> None:
        """Draws a frame of the same shape.

        Args:
            frame: what to draw.
            now: seconds of the wall clock, for what fades.
        """
        put = self._moving.put
        self._positions[:, :2] = frame.poses[:, :2]
        half = frame.poses[:, 2] / 2
        self._headings[:, 0], self._headings[:, 3] = np.cos(half), np.sin(half)
        for part in (self._chassis, self._shells):
            put(part, "batched_positions", self._positions)
            put(part, "batched_wxyzs", self._headings)
        put(self._halos, "batched_positions", self._positions)
        going_on = continues(self._last, frame)
        if self._trails.update(frame.poses, frame.sim_time, anew=not going_on):
            put(self._trail_lines, "points", self._trails.older())
        put(self._trail_ends, "points", self._trails.newest())
        if self._rays_visible:
            self._draw_rays(frame)
        self._draw_targets(frame)
        if going_on and self._last is not None:
            self._start_flashes(self._last, frame, now)
        if self._flashing:
            self._draw_flashes(now)
        self._last = frame

    def show_rays(self, visible: bool, robot: int | None) -> None:
        """Shows or hides rays, hits and the scanned area; those of one robot, or of all where it is None."""
        self._rays_visible = visible
        self._rays_of = robot
        if self._rays is not None:
            self._rays.show(visible)

    def remove(self) -> None:
        """Takes the nodes away."""
        if self._rays is not None:
            self._rays.remove()
        for node in (
            self._chassis,
            self._shells,
            self._halos,
            self._goals,
            self._beacons,
            self._rings,
            self._trail_ends,
            self._trail_lines,
        ):
            self._moving.forget(node)
            node.remove()

    def _draw_rays(self, frame: Frame) -> None:
        count = len(frame.poses)
        first, end = (0, count) if self._rays_of is None else (min(self._rays_of, count - 1), min(self._rays_of + 1, count))
        if self._rays is None or self._rays.robots != end - first:
            if self._rays is not None:
                self._rays.remove()
            self._rays = RayNodes(
                self._scene, self._moving, self._parent, self._lidar, self._colours, end - first, few=self._few
            )
        self._rays.update(frame.poses[first:end], frame.ranges[first:end], frame.fields_of_view[first:end])

    def _draw_targets(self, frame: Frame) -> None:
        if self._last is not None and (self._last.targets == frame.targets).all():
            return
        spots = np.column_stack([frame.targets, np.full(len(frame.targets), _TARGET_HEIGHT, np.float32)])
        self._moving.put(self._goals, "batched_positions", spots)
        self._moving.put(self._beacons, "batched_positions", spots)

    def _start_flashes(self, last: Frame, frame: Frame, now: float) -> None:
        """An arrival flashes at the target that was reached, anything else where the robot ended up."""
        flashing = ended(last, frame)
        if not flashing.any():
            return
        places, tints = self._flash_places, self._flash_tints
        places[flashing, :2] = np.where(frame.outcomes[:, None] == _ARRIVAL, last.targets, last.poses[:, :2])[flashing]
        places[:, 2] = _FLASH_HEIGHT
        tints[flashing] = linear(np.array(OUTCOMES, np.float64))[frame.outcomes[flashing]]
        self._moving.put(self._rings, "batched_positions", places)
        self._moving.put(self._rings, "batched_colors", tints)
        self._flashes[flashing] = now
        self._flashing = True

    def _draw_flashes(self, now: float) -> None:
        age = (now - self._flashes) / _FLASH_SECONDS
        active = age < 1.0
        self._flashing = bool(active.any())
        scales = np.where(active, 0.15 + 0.55 * np.sqrt(np.clip(age, 0, 1)), 1e-3).astype(np.float32)
        self._moving.put(self._rings, "batched_scales", scales)
        self._moving.put(self._rings, "batched_opacities", np.where(active, 1.0 - age, 0.0).astype(np.float32))


def _body(task: TaskConfig) -> tuple[meshes.Mesh, meshes.Mesh]:
    """Dark and coloured parts of a robot, its LiDARs where they are mounted."""
    robot, mount = task.robot, task.lidar.mount
    scanners = [(x, y) for x, y, _ in mount.places]
    if robot.half_extents is None:
        radius = robot.inscribed_radius
        # One in the middle is drawn a little behind it: the nose is then seen from above.
        scanners = [(-0.1 * radius, 0.0)] if mount.name == "centre" else scanners
        return meshes.chassis(radius, scanners), meshes.shell(radius, scanners)
    return meshes.box_chassis(*robot.half_extents, scanners), meshes.box_shell(*robot.half_extents, scanners)


def _mesh_arguments(mesh: meshes.Mesh) -> tuple[NDArray[np.float32], NDArray[np.uint32]]:
    return mesh.vertices, mesh.faces

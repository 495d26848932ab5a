"""The nodes that move: robots, rays, hits, trails, targets, and the rings that flash when an attempt ends."""

import numpy as np
import viser
from numpy.typing import NDArray

from sim.config import TaskConfig
from sim.lidar import drawn_ray_angles, ray_origins
from workers.frames import Frame
from workers.scene import meshes
from workers.scene.continuity import continues, ended
from workers.scene.themes import OUTCOMES, Colours, linear, robot_colours
from workers.scene.trails import Trails, trail_colours

_FLOOR_HEIGHT = 0.02
_HIT_HEIGHT = 0.05
_TARGET_HEIGHT = 0.025
_FLASH_HEIGHT = 0.03
_ARRIVAL = 1
_HIT_OFFSET = 0.035
_INSIDE_THE_ROBOT = 0.1
# What light falls on looks paler than the line of the same colour.
_LIT = 0.9
_FAN_OPACITY = 0.13
# The rays of a crowd are drawn fainter.
_CROWD_RAYS = 0.4
_FLASH_SECONDS = 0.9
# From this many robots on, filled scans and long trails would paint the whole floor.
_FEW = 16


class RobotNodes:
    """A fixed number of robots with a fixed number of rays below one node.

    Args:
        server: where the nodes live.
        parent: path of the node to hang them under.
        task: geometry of robot and LiDAR.
        colours: of the theme.
        frame: the first frame to draw.
        first: number of the first robot, for its colour.
    """

    def __init__(
        self,
        server: viser.ViserServer,
        parent: str,
        task: TaskConfig,
        colours: Colours,
        frame: Frame,
        *,
        first: int = 0,
    ) -> None:
        robots, rays = frame.ranges.shape
        scanners = len(task.lidar.mount.places)
        scene = server.scene
        chassis, shell = _body(task)
        halo = max(task.collision_distance, 1.5 * task.robot.inscribed_radius)
        few = robots <= _FEW
        own = robot_colours(robots, first)
        still = np.tile(np.array([1.0, 0.0, 0.0, 0.0], np.float32), (robots, 1))
        nowhere = np.zeros((robots, 3), np.float32)

        self._lidar = task.lidar
        self._rays_visible = True
        self._rays_of: int | None = None
        self._ends = np.empty((robots, rays, 2, 3), np.float32)
        # Rays at the scanner's true height would hide the robots: they are drawn on the floor.
        self._ends[..., 2] = _FLOOR_HEIGHT
        self._trails = Trails(frame.poses, 40 if few else 16, task.robot.max_linear_speed)
        self._last: Frame | None = None
        self._flashes = np.full(robots, -np.inf)
        self._flashing = False

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
        self._trail_lines = scene.add_line_segments(
            f"{parent}/trails",
            self._trails.segments(),
            linear(trail_colours(own, np.array(colours.floor, np.float64), 40 if few else 16)),
            thickness=2.5,
            thickness_units="screen",
        )
        strength = np.array([0.5, 1.0])[:, None] * colours.ray_strength * (1.0 if few else _CROWD_RAYS)
        ray = np.array(colours.ray) * strength + np.array(colours.floor) * (1.0 - strength)
        self._ray_lines = scene.add_line_segments(
            f"{parent}/rays",
            self._ends.reshape(-1, 2, 3),
            np.broadcast_to(linear(ray), (robots * rays, 2, 3)).copy(),
            thickness=1.25,
            thickness_units="screen",
        )
        self._hits = scene.add_point_cloud(
            f"{parent}/hits",
            np.zeros((robots * rays, 3), np.float32),
            colours.hit,
            point_size=0.032,
            point_shape="circle",
        )
        self._fan = (
            scene.add_mesh_simple(
                f"{parent}/fan",
                np.zeros((robots * (rays + scanners), 3), np.float32),
                _fan_faces(robots * scanners, task.lidar.rays),
                color=colours.fan,
                opacity=_FAN_OPACITY,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )
            if few
            else None
        )

    def update(self, frame: Frame, now: float) -> None:
        """Draws a frame of the same shape.

        Args:
            frame: what to draw.
            now: seconds of the wall clock, for what fades.
        """
        positions = np.column_stack([frame.poses[:, :2], np.zeros(len(frame.poses), np.float32)])
        headings = np.zeros((len(frame.poses), 4), np.float32)
        headings[:, 0], headings[:, 3] = np.cos(frame.poses[:, 2] / 2), np.sin(frame.poses[:, 2] / 2)
        for part in (self._chassis, self._shells):
            part.batched_positions = positions
            part.batched_wxyzs = headings
        self._halos.batched_positions = positions
        going_on = continues(self._last, frame)
        self._trails.update(frame.poses, frame.sim_time, anew=not going_on)
        self._trail_lines.points = self._trails.segments()
        if self._rays_visible:
            self._draw_rays(frame)
        self._draw_targets(frame)
        if going_on and self._last is not None:
            self._start_flashes(self._last, frame, now)
        self._draw_flashes(now)
        self._last = frame

    def show_rays(self, visible: bool, robot: int | None) -> None:
        """Shows or hides rays, hits and the scanned area; those of one robot, or of all where it is None."""
        self._rays_visible = visible
        self._rays_of = robot
        for node in (self._ray_lines, self._hits, self._fan):
            if node is not None:
                node.visible = visible

    def remove(self) -> None:
        """Takes the nodes away."""
        for node in (
            self._chassis,
            self._shells,
            self._halos,
            self._goals,
            self._beacons,
            self._rings,
            self._trail_lines,
            self._ray_lines,
            self._hits,
            self._fan,
        ):
            if node is not None:
                node.remove()

    def _draw_rays(self, frame: Frame) -> None:
        angles = frame.poses[:, 2:3] + drawn_ray_angles(self._lidar, frame.fields_of_view)
        ranges = frame.ranges
        if self._rays_of is not None:
            # The count stays the same: the others' rays have no length, and lie where nobody sees them.
            ranges = np.where(np.arange(len(ranges))[:, None] == min(self._rays_of, len(ranges) - 1), ranges, 0.0)
        self._ends[:, :, 0, :2] = origins = ray_origins(self._lidar, frame.poses)
        self._ends[:, :, 1, 0] = origins[..., 0] + ranges * np.cos(angles)
        self._ends[:, :, 1, 1] = origins[..., 1] + ranges * np.sin(angles)
        self._ray_lines.points = self._ends.reshape(-1, 2, 3)
        # The points stand a little before the surface that was met, or it would hide half of each. A ray that meets
        # nothing puts its point inside the robot, where nobody sees it: the count stays the same.
        length = np.where((ranges > 0.0) & (ranges < self._lidar.range - 1e-3), ranges - _HIT_OFFSET, 0.0)
        hits = self._ends[:, :, 0].copy()
        hits[..., 0] += length * np.cos(angles)
        hits[..., 1] += length * np.sin(angles)
        hits[..., 2] = np.where(length > 0.0, _HIT_HEIGHT, _INSIDE_THE_ROBOT)
        self._hits.points = hits.reshape(-1, 3)
        if self._fan is not None:
            # One fan for each LiDAR.
            ends = self._ends.reshape(-1, self._lidar.rays, 2, 3)
            corners = np.concatenate([ends[:, :1, 0], ends[:, :, 1]], axis=1)
            corners[..., 2] = 0.015
            self._fan.vertices = corners.reshape(-1, 3)

    def _draw_targets(self, frame: Frame) -> None:
        if self._last is not None and (self._last.targets == frame.targets).all():
            return
        spots = np.column_stack([frame.targets, np.full(len(frame.targets), _TARGET_HEIGHT, np.float32)])
        self._goals.batched_positions = spots
        self._beacons.batched_positions = spots

    def _start_flashes(self, last: Frame, frame: Frame, now: float) -> None:
        """An arrival flashes at the target that was reached, anything else where the robot ended up."""
        flashing = ended(last, frame)
        if not flashing.any():
            return
        places = self._rings.batched_positions.copy()
        places[flashing, :2] = np.where(frame.outcomes[:, None] == _ARRIVAL, last.targets, last.poses[:, :2])[flashing]
        places[:, 2] = _FLASH_HEIGHT
        tints = self._rings.batched_colors.copy()
        tints[flashing] = linear(np.array(OUTCOMES, np.float64))[frame.outcomes[flashing]]
        self._rings.batched_positions = places
        self._rings.batched_colors = tints
        self._flashes[flashing] = now

    def _draw_flashes(self, now: float) -> None:
        age = (now - self._flashes) / _FLASH_SECONDS
        active = age < 1.0
        if active.any() or self._flashing:
            self._flashing = bool(active.any())
            self._rings.batched_scales = np.where(active, 0.15 + 0.55 * np.sqrt(np.clip(age, 0, 1)), 1e-3).astype(np.float32)
            self._rings.batched_opacities = np.where(active, 1.0 - age, 0.0).astype(np.float32)


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


def _fan_faces(scanners: int, rays: int) -> NDArray[np.uint32]:
    """Triangles between the origin of each LiDAR and its neighbouring rays."""
    ray = np.arange(1, rays)
    one = np.column_stack([np.zeros_like(ray), ray, ray + 1])
    return (one[None] + (rays + 1) * np.arange(scanners)[:, None, None]).reshape(-1, 3).astype(np.uint32)

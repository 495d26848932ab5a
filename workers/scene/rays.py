"""The nodes of LiDAR scans: rays, the points that they hit, and the area between them."""

import numpy as np
import viser
from numpy.typing import NDArray

from sim.config import LidarConfig
from sim.lidar import drawn_ray_angles
from workers.scene.moving import Moving
from workers.scene.themes import Colours, linear

# Rays at the scanner's true height would hide the robots: they are drawn on the floor.
_FLOOR_HEIGHT = 0.02
_FAN_HEIGHT = 0.015
_HIT_HEIGHT = 0.05
_HIT_OFFSET = 0.035
_INSIDE_THE_ROBOT = 0.1
_FAN_OPACITY = 0.13
# The rays of a crowd are drawn fainter.
_CROWD_RAYS = 0.4


class RayNodes:
    """The scans of a fixed number of robots below one node.

    Args:
        scene: where the nodes live.
        moving: where they are set.
        parent: path of the node to hang them under.
        lidar: whose rays.
        colours: of the theme.
        robots: whose scans are drawn.
        few: whether few robots are in the scene: of a crowd, rays are fainter and no area is filled.
    """

    def __init__(
        self,
        scene: viser.SceneApi,
        moving: Moving,
        parent: str,
        lidar: LidarConfig,
        colours: Colours,
        robots: int,
        *,
        few: bool,
    ) -> None:
        self.robots = robots
        self._moving = moving
        self._lidar = lidar
        scan, scanners = lidar.scan_size, len(lidar.mount.places)
        # The floor as complex numbers: to turn is to multiply.
        self._places = np.repeat([complex(ahead, aside) for ahead, aside, _ in lidar.mount.places], lidar.rays)
        self._fields = np.empty(0, np.float32)
        self._directions = np.empty((0, scan), np.complex128)
        self._ends = np.full((robots, scan, 2, 3), _FLOOR_HEIGHT, np.float32)
        self._points = np.zeros((robots, scan, 3), np.float32)
        self._corners = np.full((robots, scanners, lidar.rays + 1, 3), _FAN_HEIGHT, np.float32)
        strength = np.array([0.5, 1.0])[:, None] * colours.ray_strength * (1.0 if few else _CROWD_RAYS)
        ray = np.array(colours.ray) * strength + np.array(colours.floor) * (1.0 - strength)
        self.lines = scene.add_line_segments(
            f"{parent}/rays",
            self._ends.reshape(-1, 2, 3),
            np.broadcast_to(linear(ray), (robots * scan, 2, 3)).copy(),
            thickness=1.25,
            thickness_units="screen",
        )
        self.hits = scene.add_point_cloud(
            f"{parent}/hits",
            self._points.reshape(-1, 3),
            colours.hit,
            point_size=0.032,
            point_shape="circle",
        )
        self._fan = (
            scene.add_mesh_simple(
                f"{parent}/fan",
                self._corners.reshape(-1, 3),
                _fan_faces(robots * scanners, lidar.rays),
                color=colours.fan,
                opacity=_FAN_OPACITY,
                side="double",
                cast_shadow=False,
                receive_shadow=False,
            )
            if few
            else None
        )

    def update(self, poses: NDArray[np.float32], ranges: NDArray[np.float32], fields: NDArray[np.float32]) -> None:
        """Draws scans.

        Args:
            poses: (robots, 3) where the robots are.
            ranges: (robots, scan) what they measure.
            fields: (robots,) degrees that their rays cover.
        """
        if not np.array_equal(fields, self._fields):
            self._fields = fields.copy()
            self._directions = np.exp(1j * drawn_ray_angles(self._lidar, fields))
        turned = np.exp(1j * poses[:, 2:3])
        origins = poses[:, 0:1] + 1j * poses[:, 1:2] + turned * self._places
        directions = turned * self._directions
        ends = origins + ranges * directions
        lines = self._ends
        lines[:, :, 0, 0], lines[:, :, 0, 1] = origins.real, origins.imag
        lines[:, :, 1, 0], lines[:, :, 1, 1] = ends.real, ends.imag
        self._moving.put(self.lines, "points", lines.reshape(-1, 2, 3))
        # The points stand a little before the surface that was met, or it would hide half of each. A ray that meets
        # nothing puts its point inside the robot, where nobody sees it: the count stays the same.
        met = (ranges > 0.0) & (ranges < self._lidar.range - 1e-3)
        hits = origins + np.where(met, ranges - _HIT_OFFSET, 0.0) * directions
        points = self._points
        points[..., 0], points[..., 1] = hits.real, hits.imag
        points[..., 2] = np.where(met, _HIT_HEIGHT, _INSIDE_THE_ROBOT)
        self._moving.put(self.hits, "points", points.reshape(-1, 3))
        if self._fan is not None:
            # One fan for each LiDAR.
            each = lines.reshape(len(poses), -1, self._lidar.rays, 2, 3)
            self._corners[:, :, 0, :2] = each[:, :, 0, 0, :2]
            self._corners[:, :, 1:, :2] = each[:, :, :, 1, :2]
            self._moving.put(self._fan, "vertices", self._corners.reshape(-1, 3))

    def show(self, visible: bool) -> None:
        """Shows or hides all of it."""
        for node in self._nodes():
            node.visible = visible

    def remove(self) -> None:
        """Takes the nodes away."""
        for node in self._nodes():
            self._moving.forget(node)
            node.remove()

    def _nodes(self) -> list[viser.SceneNodeHandle]:
        return [node for node in (self.lines, self.hits, self._fan) if node is not None]


def _fan_faces(scanners: int, rays: int) -> NDArray[np.uint32]:
    """Triangles between the origin of each LiDAR and its neighbouring rays."""
    ray = np.arange(1, rays)
    one = np.column_stack([np.zeros_like(ray), ray, ray + 1])
    return (one[None] + (rays + 1) * np.arange(scanners)[:, None, None]).reshape(-1, 3).astype(np.uint32)

"""Where each robot has been in the last seconds, as line segments that fade into the floor with age."""

import numpy as np
from numpy.typing import NDArray

# Simulated seconds between two kept points; 40 of them reach back ten seconds, 2.5 m at a TurtleBot's top speed.
_SPACING = 0.25
_HEIGHT = 0.012
# A robot that seems to move this many times faster than it can has been put somewhere else.
_TELEPORT = 3.0


class Trails:
    """The trails of some robots.

    Args:
        poses: (robots, 3) where they start.
        points: kept points per robot.
        max_speed: metres per second of which the robots are capable.
    """

    def __init__(self, poses: NDArray[np.float32], points: int, max_speed: float) -> None:
        self._max_speed = max_speed
        self._sim_time = float("-inf")
        self._kept_at = float("-inf")
        # Newest first; column 0 is where the robot is now.
        self._points = np.full((len(poses), points + 1, 3), _HEIGHT, np.float32)
        self._points[:, :, :2] = poses[:, None, :2]

    def update(self, poses: NDArray[np.float32], sim_time: float, *, anew: bool = False) -> bool:
        """The robots have moved on; where one has been put somewhere else, its trail starts there.

        Args:
            poses: (robots, 3) where they are.
            sim_time: simulated seconds.
            anew: start all trails here.

        Returns:
            Whether more than the newest segments has changed.
        """
        elapsed = sim_time - self._sim_time
        self._sim_time = sim_time
        moved = np.hypot(*(poses[:, :2] - self._points[:, 0, :2]).T)
        jumped = (moved > 0.05 + _TELEPORT * self._max_speed * elapsed) | anew
        kept = not 0.0 <= sim_time - self._kept_at < _SPACING
        if kept:
            self._kept_at = sim_time
            self._points[:, 1:] = self._points[:, :-1]
        self._points[:, 0, :2] = poses[:, :2]
        again = bool(jumped.any())
        if again:
            self._points[jumped] = self._points[jumped, :1]
        return kept or again

    def newest(self) -> NDArray[np.float32]:
        """(robots, 2, 3) the line segment that ends at each robot."""
        return self._points[:, :2]

    def older(self) -> NDArray[np.float32]:
        """(robots x (points - 1), 2, 3) the other line segments, each robot's newest first."""
        return np.stack([self._points[:, 1:-1], self._points[:, 2:]], axis=2).reshape(-1, 2, 3)


def trail_colours(colours: NDArray[np.float64], floor: NDArray[np.float64], points: int) -> NDArray[np.float64]:
    """(robots x points, 2, 3) colours of each robot's segments, newest first: its own, turning into the floor's with age."""
    strength = np.linspace(0.85, 0.0, points + 1)[None, :, None]
    shades = colours[:, None, :] * strength + floor * (1.0 - strength)
    return np.stack([shades[:, :-1], shades[:, 1:]], axis=2).reshape(-1, 2, 3)

"""Where the camera stands and what it follows.

To follow a robot, the world moves under the camera instead of the camera through the world: one message a frame for all
browsers, and everyone may still turn and zoom freely. Only the change of what is followed moves cameras, once.
"""

from collections.abc import Sequence

import viser

Point = tuple[float, float, float]

_FLIGHT_SECONDS = 0.7
_FIELD_OF_VIEW = 0.78


class CameraRig:
    """Overview or follower, for all browsers of a scene.

    Args:
        server: whose cameras to move.
        half_size: half the side of the arena in metres, which the overview has to show.
    """

    def __init__(self, server: viser.ViserServer, half_size: float) -> None:
        self._server = server
        self._overview: Point = (0.0, -1.72 * half_size, 1.84 * half_size)
        self._overview_target: Point = (0.0, -0.07 * half_size, 0.0)
        self._close_up: Point = (0.0, -2.1, 2.6)
        self._follow: int | None = None
        self._flight_started = float("-inf")
        self._origin = (0.0, 0.0)
        self._centre = (0.0, 0.0)
        server.initial_camera.fov = _FIELD_OF_VIEW
        self._aim_new_cameras()

    def follow(self, robot: int | None, now: float) -> None:
        """Flies to a robot and stays with it, or back to the overview (None)."""
        if robot == self._follow:
            return
        self._follow = robot
        self._flight_started = now
        self._origin = self._centre
        self._aim_new_cameras()
        position, target = self._pose()
        for client in self._server.get_clients().values():
            with client.atomic():
                client.camera.position = position
                client.camera.look_at = target

    def centre(self, robots: Sequence[Sequence[float]], now: float) -> tuple[float, float]:
        """The point of the arena that lies under the camera.

        Args:
            robots: where the robots are.
            now: seconds of the wall clock.
        """
        goal = robots[self._follow] if self._follow is not None and self._follow < len(robots) else (0.0, 0.0)
        t = min(max((now - self._flight_started) / _FLIGHT_SECONDS, 0.0), 1.0)
        ease = t * t * (3.0 - 2.0 * t)
        self._centre = (
            self._origin[0] + (goal[0] - self._origin[0]) * ease,
            self._origin[1] + (goal[1] - self._origin[1]) * ease,
        )
        return self._centre

    def _pose(self) -> tuple[Point, Point]:
        return (self._overview, self._overview_target) if self._follow is None else (self._close_up, (0.0, 0.0, 0.1))

    def _aim_new_cameras(self) -> None:
        self._server.initial_camera.position, self._server.initial_camera.look_at = self._pose()

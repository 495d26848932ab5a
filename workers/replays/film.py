"""A scenario as a recording for viser's own player: robots, rays and trails over time, and where they ended."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
import viser
from numpy.typing import NDArray

from sim.config import ImportedArenaConfig
from workers.replays.moments import LAST_PICTURE_SECONDS, Filmed, frames_at, movers_at
from workers.scene.camera import CameraRig
from workers.scene.meshes import ring
from workers.scene.quiet import start_viser, stop_viser
from workers.scene.scene import Scene
from workers.scene.themes import COLOURS, OUTCOMES, Theme, linear, robot_colours

FRAMES_PER_SECOND = 20.0
# Of an episode that lasts longer than a minute, fewer pictures a second are kept.
_MAX_FRAMES = 1_200
_PATH_HEIGHT = 0.008
_PATH_STRENGTH = 0.35
_END_HEIGHT = 0.032
_END_RADIUS = 0.28


def film_scene(filmed: Sequence[Filmed], theme: Theme, progress: Callable[[float], None]) -> bytes:
    """A `.viser` file of one scenario; takes about half a second for each robot.

    Args:
        filmed: the robots that drove it; the rays drawn are those of the first, the movers those that the longest met.
        theme: light or dark.
        progress: told the share of the work that is done, 0 to 1.
    """
    first, longest = filmed[0], max(filmed, key=lambda each: each.seconds)
    place = first.task.model_copy(update={"arena": ImportedArenaConfig.of(first.track.arena)})
    times = np.linspace(0.0, longest.seconds, min(_MAX_FRAMES, round(longest.seconds * FRAMES_PER_SECOND)) + 1)
    movers = movers_at(longest, times)
    reels = [frames_at(each, times, movers) for each in filmed]
    server = start_viser()
    try:
        scene = Scene(server, place, theme)
        CameraRig(server, scene.half_size)
        for number, each in enumerate(filmed):
            _draw_path(server.scene, each.track.poses, number, theme)
        scene.update(reels[0][0], 0.0)
        beside = [scene.add_robots(each.task, reels[number][0], number) for number, each in enumerate(filmed) if number]
        for robots, reel in zip(beside, reels[1:], strict=True):
            robots.update(reel[0], 0.0)
        serializer = server.get_scene_serializer()
        ended: set[int] = set()
        for before, after in pairwise(range(len(times))):
            now = float(times[after])
            progress(after / len(times))
            serializer.insert_sleep(now - float(times[before]))
            scene.update(reels[0][after], now)
            for robots, reel in zip(beside, reels[1:], strict=True):
                robots.update(reel[after], now)
            for number, each in enumerate(filmed):
                if number not in ended and each.seconds <= now + 1e-9:
                    ended.add(number)
                    mark_end(server.scene, each, f"{number}")
        serializer.insert_sleep(LAST_PICTURE_SECONDS)
        return serializer.serialize()
    finally:
        stop_viser(server)


def _draw_path(scene: viser.SceneApi, poses: NDArray[np.float32], number: int, theme: Theme) -> None:
    """The whole way, faint, so that one sees from the beginning where it leads."""
    points = np.column_stack([poses[:, :2], np.full(len(poses), _PATH_HEIGHT, np.float32)])
    colour = _PATH_STRENGTH * robot_colours(1, number)[0] + (1.0 - _PATH_STRENGTH) * np.array(COLOURS[theme].floor)
    scene.add_line_segments(
        f"/world/paths/{number}",
        np.stack([points[:-1], points[1:]], axis=1),
        np.broadcast_to(linear(colour), (len(points) - 1, 2, 3)).copy(),
        thickness=1.5,
        thickness_units="screen",
    )


def mark_end(scene: viser.SceneApi, filmed: Filmed, name: str) -> viser.MeshHandle:
    """A ring around the robot in the outcome's colour."""
    pose = filmed.track.poses[-1]
    mesh = ring(0.75 * _END_RADIUS, _END_RADIUS, corners=48)
    return scene.add_mesh_simple(
        f"/world/ends/{name}",
        mesh.vertices,
        mesh.faces,
        color=OUTCOMES[filmed.outcome],
        position=(float(pose[0]), float(pose[1]), _END_HEIGHT),
        cast_shadow=False,
        receive_shadow=False,
    )

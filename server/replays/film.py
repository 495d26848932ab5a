"""An episode as a recording for viser's own player: robot, rays and trail over time, and where it ended."""

from itertools import pairwise

import numpy as np
import viser
from numpy.typing import NDArray

from server.scene.camera import CameraRig
from server.scene.meshes import ring
from server.scene.quiet import start_viser, stop_viser
from server.scene.scene import Scene
from server.scene.themes import COLOURS, OUTCOMES, ROBOTS, Theme, linear
from sim.config import ImportedArenaConfig, TaskConfig
from workers.frames import Frame
from workers.replays.recording import Track
from workers.reporting import EpisodeResult

_FRAMES_PER_SECOND = 20.0
# Of an episode that lasts longer than a minute, fewer pictures a second are kept.
_MAX_FRAMES = 1_200
_LAST_PICTURE_SECONDS = 1.5
# Between two steps a ray that leaves one thing for another jumps; all others sweep.
_SAME_THING = 0.4

# As `Frame.outcomes` counts them.
_OUTCOME_NUMBERS = {"arrival": 1, "collision": 2, "timeout": 3}
_PATH_HEIGHT = 0.008
_PATH_STRENGTH = 0.35
_END_HEIGHT = 0.032
_END_RADIUS = 0.28


def film(track: Track, result: EpisodeResult, task: TaskConfig, theme: Theme) -> bytes:
    """A `.viser` file; takes about half a second.

    Args:
        track: what the robot did.
        result: how it ended.
        task: robot, LiDAR and limits.
        theme: light or dark.
    """
    place = task.model_copy(update={"arena": ImportedArenaConfig.of(track.arena)})
    server = start_viser()
    try:
        scene = Scene(server, place, theme)
        CameraRig(server, scene.half_size)
        _draw_path(server.scene, track.poses, theme)
        duration = (len(track.poses) - 1) * task.control_period
        times = np.linspace(0.0, duration, min(_MAX_FRAMES, round(duration * _FRAMES_PER_SECOND)) + 1)
        frames = _frames(track, times, task.control_period)
        scene.update(frames[0], 0.0)
        serializer = server.get_scene_serializer()
        for before, frame in pairwise(frames):
            serializer.insert_sleep(frame.sim_time - before.sim_time)
            scene.update(frame, frame.sim_time)
        _mark_end(server.scene, track.poses[-1], result)
        serializer.insert_sleep(_LAST_PICTURE_SECONDS)
        return serializer.serialize()
    finally:
        stop_viser(server)


def _frames(track: Track, times: NDArray[np.float64], period: float) -> list[Frame]:
    """What to draw at each of these times, seconds: between two recorded moments, which are `period` apart."""
    moments = times / period
    before = np.minimum(moments.astype(np.int64), len(track.poses) - 1)
    after = np.minimum(before + 1, len(track.poses) - 1)
    share = (moments - before)[:, None]
    change = track.poses[after] - track.poses[before]
    change[:, 2] = (change[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    poses = (track.poses[before] + share * change).astype(np.float32)
    jump = track.ranges[after] - track.ranges[before]
    sweep = np.where(np.abs(jump) < _SAME_THING, share * jump, np.where(share < 0.5, 0.0, jump))
    ranges = (track.ranges[before] + sweep).astype(np.float32)
    movers = track.movers[before] + share[:, None] * (track.movers[after] - track.movers[before])
    return [
        Frame(
            mode="policy",
            step=0,
            sim_time=float(seconds),
            speed=1.0,
            poses=poses[index : index + 1],
            targets=track.target[None],
            ranges=ranges[index : index + 1],
            fields_of_view=track.fields_of_view[before[index], None],
            rewards=np.zeros(1, np.float32),
            outcomes=np.zeros(1, np.uint8),
            movers=movers[index].astype(np.float32),
        )
        for index, seconds in enumerate(times)
    ]


def _draw_path(scene: viser.SceneApi, poses: NDArray[np.float32], theme: Theme) -> None:
    """The whole way, faint, so that one sees from the beginning where it leads."""
    points = np.column_stack([poses[:, :2], np.full(len(poses), _PATH_HEIGHT, np.float32)])
    colour = _PATH_STRENGTH * np.array(ROBOTS[0]) + (1.0 - _PATH_STRENGTH) * np.array(COLOURS[theme].floor)
    scene.add_line_segments(
        "/world/path",
        np.stack([points[:-1], points[1:]], axis=1),
        np.broadcast_to(linear(colour), (len(points) - 1, 2, 3)).copy(),
        thickness=1.5,
        thickness_units="screen",
    )


def _mark_end(scene: viser.SceneApi, pose: NDArray[np.float32], result: EpisodeResult) -> None:
    """A ring around the robot in the outcome's colour."""
    mesh = ring(0.75 * _END_RADIUS, _END_RADIUS, corners=48)
    scene.add_mesh_simple(
        "/world/end",
        mesh.vertices,
        mesh.faces,
        color=OUTCOMES[_OUTCOME_NUMBERS[result.outcome]],
        position=(float(pose[0]), float(pose[1]), _END_HEIGHT),
        cast_shadow=False,
        receive_shadow=False,
    )

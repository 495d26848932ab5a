"""A scenario as a recording for viser's own player: robots, rays and trails over time, and where they ended."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import viser
from numpy.typing import NDArray

from server.scene.camera import CameraRig
from server.scene.meshes import ring
from server.scene.quiet import start_viser, stop_viser
from server.scene.scene import Scene
from server.scene.themes import COLOURS, OUTCOMES, Theme, linear, robot_colours
from sim.config import ImportedArenaConfig, TaskConfig
from workers.frames import Frame
from workers.replays.recording import Track
from workers.reporting import EpisodeResult

FRAMES_PER_SECOND = 20.0
# Of an episode that lasts longer than a minute, fewer pictures a second are kept.
_MAX_FRAMES = 1_200
LAST_PICTURE_SECONDS = 1.5
# Between two steps a ray that leaves one thing for another jumps; all others sweep.
_SAME_THING = 0.4

# As `Frame.outcomes` counts them.
_OUTCOME_NUMBERS = {"arrival": 1, "collision": 2, "timeout": 3}
_PATH_HEIGHT = 0.008
_PATH_STRENGTH = 0.35
_END_HEIGHT = 0.032
_END_RADIUS = 0.28


@dataclass(frozen=True, eq=False)
class Filmed:
    """What one robot did, how it ended, and with which robot, LiDAR and limits."""

    track: Track
    result: EpisodeResult
    task: TaskConfig

    @property
    def seconds(self) -> float:
        """Of simulated time."""
        return (len(self.track.poses) - 1) * self.task.control_period


def film(filmed: Sequence[Filmed], theme: Theme) -> bytes:
    """A `.viser` file of one scenario; takes about half a second for each robot.

    Args:
        filmed: the robots that drove it; the rays drawn are those of the first, the movers those that the longest met.
        theme: light or dark.
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


def _between(filmed: Filmed, times: NDArray[np.float64]) -> tuple[NDArray[np.int64], NDArray[np.int64], NDArray[np.float64]]:
    """The moments before and after each of these times, seconds, and how far it is from the one to the other, 0 to 1."""
    moments, last = times / filmed.task.control_period, len(filmed.track.poses) - 1
    before = np.minimum(moments.astype(np.int64), last)
    return before, np.minimum(before + 1, last), moments - before


def movers_at(filmed: Filmed, times: NDArray[np.float64]) -> NDArray[np.float32]:
    """(T, movers, 3) what moves at each of these times, seconds."""
    before, after, share = _between(filmed, times)
    movers = filmed.track.movers
    return (movers[before] + share[:, None, None] * (movers[after] - movers[before])).astype(np.float32)


def frames_at(filmed: Filmed, times: NDArray[np.float64], movers: NDArray[np.float32]) -> list[Frame]:
    """What to draw at each of these times, seconds: between two recorded moments; a robot that has ended stands."""
    track = filmed.track
    before, after, share = _between(filmed, times)
    share = share[:, None]
    change = track.poses[after] - track.poses[before]
    change[:, 2] = (change[:, 2] + np.pi) % (2.0 * np.pi) - np.pi
    poses = (track.poses[before] + share * change).astype(np.float32)
    jump = track.ranges[after] - track.ranges[before]
    sweep = np.where(np.abs(jump) < _SAME_THING, share * jump, np.where(share < 0.5, 0.0, jump))
    ranges = (track.ranges[before] + sweep).astype(np.float32)
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
            movers=movers[index],
        )
        for index, seconds in enumerate(times)
    ]


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
        color=OUTCOMES[_OUTCOME_NUMBERS[filmed.result.outcome]],
        position=(float(pose[0]), float(pose[1]), _END_HEIGHT),
        cast_shadow=False,
        receive_shadow=False,
    )

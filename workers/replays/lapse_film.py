"""A run's learning as one recording: the same scenarios, driven by one checkpoint after another."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import viser

from sim.config import ImportedArenaConfig
from workers.frames import Frame
from workers.replays.film import FRAMES_PER_SECOND, mark_end
from workers.replays.moments import LAST_PICTURE_SECONDS, Filmed, frames_at, movers_at
from workers.scene.camera import CameraRig
from workers.scene.quiet import start_viser, stop_viser
from workers.scene.scene import Scene
from workers.scene.themes import Theme


@dataclass(frozen=True, eq=False)
class Chapter:
    """What one checkpoint did.

    Attributes:
        robots: the scenarios that it drove, those of all chapters in one order.
        begins: in the film, seconds.
        lasts: in the film, seconds, beside the picture at its end.
    """

    robots: Sequence[Filmed]
    begins: float
    lasts: float


def film_lapse(chapters: Sequence[Chapter], theme: Theme, progress: Callable[[float], None]) -> bytes:
    """A `.viser` file; takes about half a second for each chapter.

    Args:
        chapters: in their order, each with the same arena, robot and LiDAR.
        theme: light or dark.
        progress: told the share of the work that is done, 0 to 1.
    """
    first = chapters[0].robots[0]
    place = first.task.model_copy(update={"arena": ImportedArenaConfig.of(first.track.arena)})
    server = start_viser()
    try:
        scene = Scene(server, place, theme)
        CameraRig(server, scene.half_size)
        scene.show_rays(visible=False, robot=None)
        reels = [_reel(chapter) for chapter in chapters]
        scene.update(reels[0][0], 0.0)
        serializer = server.get_scene_serializer()
        marks: list[viser.MeshHandle] = []
        for number, (chapter, reel) in enumerate(zip(chapters, reels, strict=True)):
            for mark in marks:
                mark.remove()
            marks.clear()
            ended: set[int] = set()
            for frame in reel:
                scene.update(frame, chapter.begins + frame.sim_time / frame.speed)
                for robot, filmed in enumerate(chapter.robots):
                    if robot not in ended and filmed.seconds <= frame.sim_time + 1e-9:
                        ended.add(robot)
                        marks.append(mark_end(server.scene, filmed, f"{number}-{robot}"))
                serializer.insert_sleep(chapter.lasts / len(reel))
            progress((number + 1) / len(chapters))
            serializer.insert_sleep(LAST_PICTURE_SECONDS)
        return serializer.serialize()
    finally:
        stop_viser(server)


def _reel(chapter: Chapter) -> list[Frame]:
    """All robots of a chapter in each picture."""
    longest = max(chapter.robots, key=lambda each: each.seconds)
    times = np.linspace(0.0, longest.seconds, max(2, round(chapter.lasts * FRAMES_PER_SECOND)))
    movers = movers_at(longest, times)
    each = [frames_at(filmed, times, movers) for filmed in chapter.robots]
    return [
        Frame(
            mode="policy",
            step=0,
            sim_time=pictures[0].sim_time,
            speed=longest.seconds / chapter.lasts,
            poses=np.concatenate([picture.poses for picture in pictures]),
            targets=np.concatenate([picture.targets for picture in pictures]),
            ranges=np.concatenate([picture.ranges for picture in pictures]),
            fields_of_view=np.concatenate([picture.fields_of_view for picture in pictures]),
            rewards=np.zeros(len(pictures), np.float32),
            outcomes=np.zeros(len(pictures), np.uint8),
            movers=pictures[0].movers,
        )
        for pictures in zip(*each, strict=True)
    ]

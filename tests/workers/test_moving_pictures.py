"""Films from above, read back: so many pictures, as long as the episode, the robot where it was, a ghost beside it."""

from itertools import pairwise
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from sim.config import ArenaFile, TaskConfig
from workers.replays.from_above import FromAbove, Shown
from workers.replays.moments import Filmed
from workers.replays.moving_pictures import GIF_SIDE, MP4_SIDE, times_of, write_gif, write_mp4
from workers.replays.recording import Track
from workers.reporting import EpisodeResult, Outcome
from workers.scene.themes import COLOURS, ROBOTS

# A robot that is large enough to be seen in a few pixels of a small arena.
TASK = TaskConfig()
ARENA = ArenaFile(name="A hall", width=4.0, height=2.0)
SPEED = 0.5


def straight(y: float, steps: int, outcome: Outcome = "arrival") -> Filmed:
    """Goes from (-1.5, y) to the right at `SPEED` past a mover that stands at (0, -0.7); its rays reach nothing."""
    moments, rays = steps + 1, TASK.lidar.rays
    poses = np.zeros((moments, 3), np.float32)
    poses[:, 0], poses[:, 1] = -1.5 + SPEED * TASK.control_period * np.arange(moments), y
    track = Track(
        arena=ARENA,
        poses=poses,
        ranges=np.full((moments, rays), 0.3, np.float32),
        fields_of_view=np.full(moments, TASK.lidar.field_of_view, np.float32),
        target=np.array([1.2, y], np.float32),
        movers=np.tile(np.array([[0.0, -0.7, 0.2]], np.float32), (moments, 1, 1)),
        commands=np.zeros((moments, 2), np.float32),
        twists=np.zeros((moments, 3), np.float32),
        terms=np.zeros((moments, 1), np.float32),
        gamma=0.99,
    )
    result = EpisodeResult(outcome=outcome, steps=steps, reward=0.0, path_length=1.0, shortest_path=1.0, min_clearance=0.1)
    return Filmed(track, result, TASK)


def shown(*filmed: Filmed) -> Shown:
    return Shown(filmed, [f"Policy {number}" for number in range(len(filmed))], "a suite", 7, "light")


def at(picture: NDArray[Any], above: FromAbove, x: float, y: float) -> list[int]:
    column, row = above.pixel(x, y)
    colour: list[int] = picture[int(row), int(column)].tolist()
    return colour


def near(colour: list[int], other: tuple[int, ...], within: float = 40.0) -> bool:
    return float(np.linalg.norm(np.subtract(colour, other))) < within


def test_an_mp4_lasts_as_long_as_the_episode_and_shows_the_robot_where_it_was(tmp_path: Path) -> None:
    path, what = tmp_path / "film.mp4", shown(straight(0.0, 20))
    told: list[float] = []
    write_mp4(path, what, told.append)
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        assert (stream.codec_context.name, stream.codec_context.pix_fmt) == ("h264", "yuv420p")
        pictures = [frame.to_ndarray(format="rgb24") for frame in container.decode(stream)]
        seconds = float(stream.duration * stream.time_base) if stream.duration and stream.time_base else 0.0
    # 4 s at twenty pictures a second with both ends, and a second and a half of the last.
    assert len(pictures) == 81 + 30
    assert seconds == pytest.approx(len(pictures) / 20)
    above = FromAbove(what, MP4_SIDE)
    assert {picture.shape for picture in pictures} == {(above.size[1], above.size[0], 3)}
    # A little behind its middle: the nose is white.
    for picture in (0, 20, 40, 60):
        x = -1.5 + SPEED * picture / 20
        assert near(at(pictures[picture], above, x - 0.04, 0.0), ROBOTS[0])
        assert near(at(pictures[picture], above, x - 0.04, 0.6), COLOURS["light"].floor)
        assert near(at(pictures[picture], above, 0.0, -0.7), COLOURS["light"].mover)
    # Its way lies behind it, not before it.
    behind, ahead = at(pictures[40], above, -0.8, 0.0), at(pictures[40], above, 0.8, 0.0)
    assert near(behind, ROBOTS[0], within=60.0)
    assert not near(ahead, ROBOTS[0], within=60.0)
    assert told == sorted(told)
    assert 0.9 < told[-1] < 1.0
    # What a player needs to begin stands at the front.
    data = path.read_bytes()
    assert data.index(b"moov") < data.index(b"mdat")
    assert len(data) < 500_000


def test_a_gif_shows_the_same_and_a_ghost_beside_it(tmp_path: Path) -> None:
    path, what = tmp_path / "film.gif", shown(straight(0.0, 20), straight(0.5, 10, "collision"))
    write_gif(path, what, lambda _: None)
    above = FromAbove(what, GIF_SIDE)
    pictures, durations = [], []
    with Image.open(path) as gif:
        assert gif.size == above.size
        for number in range(gif.n_frames):  # type: ignore[attr-defined]
            gif.seek(number)
            durations.append(gif.info["duration"])
            pictures.append(np.asarray(gif.convert("RGB")))
    # 4 s of pictures, the last one a tenth of a second and then the second and a half more.
    assert sum(durations) == pytest.approx(1_000 * (4.0 + 0.1 + 1.5), abs=1.0)
    assert set(durations[:40]) == {100}
    assert near(at(pictures[10], above, -1.0 - 0.04, 0.0), ROBOTS[0])
    faint = tuple((0.5 * np.array(ROBOTS[1]) + 0.5 * np.array(COLOURS["light"].floor)).tolist())
    assert near(at(pictures[10], above, -1.0, 0.56), faint, within=60.0)
    # It stays where it ended.
    assert near(at(pictures[-1], above, -0.5, 0.56), faint, within=60.0)
    assert path.stat().st_size < 1_000_000


def test_a_long_episode_goes_by_faster() -> None:
    moments, again = times_of(200.0, 20, 60.0)
    assert (len(moments), again) == (1_201, 30)
    assert (moments[0], moments[-1]) == (0.0, 200.0)
    assert {round(after - before, 6) for before, after in pairwise(moments)} == {round(200.0 / 1_200, 6)}


@pytest.mark.parametrize(("width", "height"), [(30.0, 2.0), (2.0, 30.0), (3.3, 7.1)])
def test_any_arena_fits_into_a_picture_of_even_sides(width: float, height: float) -> None:
    filmed = straight(0.0, 2)
    track = filmed.track
    other = Filmed(
        Track(**{**vars(track), "arena": ArenaFile(name="Another", width=width, height=height)}), filmed.result, TASK
    )
    wide, high = FromAbove(shown(other), MP4_SIDE).size
    assert wide % 2 == high % 2 == 0
    assert max(wide, high) <= MP4_SIDE + 100
    assert min(wide, high) >= 80

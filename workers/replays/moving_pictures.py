"""A scenario from above as a film that any browser, chat or slide shows: MP4 (H.264) and GIF.

A film is at most a minute long: a longer episode goes by faster. Its caption says the episode's own time.
"""

from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path

import numpy as np
from PIL import Image

from workers.replays.from_above import FromAbove, Shown
from workers.replays.moments import LAST_PICTURE_SECONDS, frames_at, movers_at

LONGEST_SECONDS = 60.0
"""Of a film, beside its last picture."""
MP4_PER_SECOND = 20
MP4_SIDE = 640
# A GIF keeps every picture almost whole: fewer, smaller ones.
GIF_PER_SECOND = 10
GIF_SIDE = 400
_GIF_LONGEST_SECONDS = 30.0
_GIF_COLOURS = 96
# x264's own scale, lower is better: flat colours stay clean at this one.
_QUALITY = "22"


def write_mp4(path: Path, shown: Shown, progress: Callable[[float], None]) -> None:
    """Write the film; takes about a second for each three that it lasts.

    Args:
        path: of the file.
        shown: what is to be seen.
        progress: told the share of the work that is done, 0 to 1.
    """
    import av

    above = FromAbove(shown, MP4_SIDE)
    with av.open(path, "w", format="mp4", options={"movflags": "faststart"}) as container:
        stream = container.add_stream("libx264", rate=MP4_PER_SECOND, options={"crf": _QUALITY, "preset": "veryfast"})
        stream.width, stream.height = above.size
        stream.pix_fmt = "yuv420p"
        stream.time_base = Fraction(1, MP4_PER_SECOND)
        stream.codec_context.thread_count = 1
        for number, image in enumerate(_pictures(above, shown, MP4_PER_SECOND, LONGEST_SECONDS, progress)):
            frame = av.VideoFrame.from_ndarray(np.asarray(image), format="rgb24")
            frame.pts, frame.time_base = number, Fraction(1, MP4_PER_SECOND)
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def write_gif(path: Path, shown: Shown, progress: Callable[[float], None]) -> None:
    """Write the film, which begins anew at its end; see `write_mp4`."""
    above = FromAbove(shown, GIF_SIDE)
    # The first and the last picture have all colours between them; one palette for all keeps what stands still quiet.
    both = np.concatenate([np.asarray(picture) for picture in _pictures(above, shown, 0, 0.0, _unheard)])
    palette = Image.fromarray(both).quantize(_GIF_COLOURS, Image.Quantize.MEDIANCUT, dither=Image.Dither.NONE)
    pictures = (
        picture.quantize(palette=palette, dither=Image.Dither.NONE)
        for picture in _pictures(above, shown, GIF_PER_SECOND, _GIF_LONGEST_SECONDS, progress)
    )
    next(pictures).save(
        path, "GIF", save_all=True, append_images=pictures, duration=1_000 // GIF_PER_SECOND, loop=0, optimize=False
    )


def times_of(seconds: float, per_second: int, longest: float) -> tuple[list[float], int]:
    """The episode's time in each picture, seconds, and how often the last one comes again."""
    count = max(1, round(min(seconds, longest) * per_second))
    return np.linspace(0.0, seconds, count + 1).tolist(), round(LAST_PICTURE_SECONDS * per_second)


def _unheard(_share: float) -> None:
    """Nobody waits."""


def _pictures(
    above: FromAbove, shown: Shown, per_second: int, longest: float, progress: Callable[[float], None]
) -> Iterator[Image.Image]:
    last = max(shown.filmed, key=lambda each: each.seconds)
    moments, again = times_of(last.seconds, per_second, longest)
    times = np.array(moments)
    movers = movers_at(last, times)
    reels = [frames_at(each, times, movers) for each in shown.filmed]
    for number, seconds in enumerate(moments):
        progress(number / len(moments))
        picture = above.picture([reel[number] for reel in reels], seconds)
        yield picture
    for _ in range(again):
        yield picture

"""Makes a film's file of the recordings of those who drive in it."""

from collections.abc import Callable, Sequence
from pathlib import Path

from workers.errors import WorkerError
from workers.film_protocol import EpisodeFilm, FilmedPolicy, LapseFilm
from workers.replays.from_above import Shown
from workers.replays.moments import Filmed
from workers.replays.recording import Recording


class StaleRecordingError(WorkerError):
    """A recording is not what the film was to be made of."""


def make_film(
    film: EpisodeFilm | LapseFilm, recordings: Sequence[Path], result: Path, progress: Callable[[float], None]
) -> None:
    """Write the file.

    Args:
        film: what it shows.
        recordings: of its policies, in their order.
        result: where it goes.
        progress: told the share of the work that is done, 0 to 1.

    Raises:
        StaleRecordingError: a recording is damaged, or is one of another suite.
    """
    if isinstance(film, LapseFilm):
        result.write_bytes(_lapse(film, recordings, progress))
        return
    recorded = [_read(policy, path) for policy, path in zip(film.policies, recordings, strict=True)]
    tracks = [recording.track(film.episode) for recording in recorded]
    filmed = [
        Filmed(track, recording.evaluation.episodes[film.episode], policy.drawn.task())
        for track, recording, policy in zip(tracks, recorded, film.policies, strict=True)
    ]
    titles = [policy.title for policy in film.policies]
    match film.form:
        case "scene":
            from workers.replays.film import film_scene

            result.write_bytes(film_scene(filmed, film.theme, progress))
        case "mcap":
            from workers.replays.messages import Driven, as_mcap

            driven = [Driven(title, each.task, each.track) for title, each in zip(titles, filmed, strict=True)]
            result.write_bytes(as_mcap(driven, film.suite, film.episode, progress))
        case "mp4":
            from workers.replays.moving_pictures import write_mp4

            write_mp4(result, Shown(filmed, titles, film.suite, film.episode, film.theme), progress)
        case "gif":
            from workers.replays.moving_pictures import write_gif

            write_gif(result, Shown(filmed, titles, film.suite, film.episode, film.theme), progress)


def _lapse(film: LapseFilm, recordings: Sequence[Path], progress: Callable[[float], None]) -> bytes:
    from workers.replays.lapse_film import Chapter, film_lapse

    chapters = []
    for chapter, path in zip(film.chapters, recordings, strict=True):
        recording, task = _read(chapter.policy, path), chapter.policy.drawn.task()
        robots = [Filmed(recording.track(each), recording.evaluation.episodes[each], task) for each in film.scenarios]
        chapters.append(Chapter(robots, chapter.begins, chapter.lasts))
    return film_lapse(chapters, film.theme, progress)


def _read(policy: FilmedPolicy, path: Path) -> Recording:
    try:
        recording = Recording.load(path)
    except (OSError, ValueError) as error:
        raise StaleRecordingError(f"what {policy.title} did can't be read: {error}") from error
    if recording.evaluation.suite_hash != policy.suite_hash:
        raise StaleRecordingError(f"what {policy.title} did was recorded on another suite")
    return recording

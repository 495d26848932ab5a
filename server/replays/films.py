"""Films of episodes, made by workers on demand and kept for a while."""

import hashlib
import importlib.metadata
from collections.abc import Sequence
from pathlib import Path

from server.errors import JobFailedError, ReplayFailedError
from server.jobs.asked import Asked
from server.jobs.names import result_name
from server.jobs.repository import JobRepository
from server.jobs.waiting import result_of
from server.replays.recordings import recording_key, recordings_of
from server.replays.schemas import FilmProgress
from server.replays.simulator import simulator
from server.replays.subject import Subject
from server.services import Services
from workers.film_protocol import Drawn, EpisodeFilm, FilmedPolicy, FilmForm, LapseFilm
from workers.job_protocol import FilmJob
from workers.scene.themes import Theme


def filmed_policy(subject: Subject) -> FilmedPolicy:
    """What a film's maker must know of one who drove."""
    return FilmedPolicy(
        title=subject.title,
        recording=recording_key(subject),
        suite_hash=subject.recorded.suite_hash,
        drawn=Drawn.of(subject.task),
    )


def episode_film(subjects: Sequence[Subject], episode: int, form: FilmForm, theme: Theme = "light") -> EpisodeFilm:
    """A film of one scenario by all of them."""
    policies = tuple(map(filmed_policy, subjects))
    return EpisodeFilm(form=form, theme=theme, suite=subjects[0].recorded.suite, episode=episode, policies=policies)


async def film_of(services: Services, film: EpisodeFilm | LapseFilm, subjects: Sequence[Subject]) -> Path:
    """The film's file; made now if it is not kept, and with it the recordings that it is made of.

    Args:
        services: of the server.
        film: what it shows.
        subjects: its policies.

    Raises:
        ReplayFailedError: it can't be made.
        JobTimeoutError: it took too long.
        NoWorkerError: nobody is there to do it.
        BusyError: as much waits as may.
    """
    asked = film_asked_for(film, subjects)
    if not await services.lanes.jobs.run(_can_be_made, services, asked.key, subjects):
        await recordings_of(services, subjects)
    try:
        return await result_of(services, asked)
    except JobFailedError:
        # A recording may have gone meanwhile, or be damaged: then it is driven again here.
        await recordings_of(services, subjects)
    try:
        return await result_of(services, asked)
    except JobFailedError as error:
        raise ReplayFailedError(f"The film could not be made: {error.message}") from error


def film_asked_for(film: EpisodeFilm | LapseFilm, subjects: Sequence[Subject], *, ahead: bool = False) -> Asked:
    """The job that makes it; `ahead`: nobody waits for it yet."""
    title = _title(subjects)
    return Asked(FilmJob(film=film), film_key(film), f"{title}, made ahead" if ahead else title, ahead=ahead)


async def film_progress(services: Services, film: EpisodeFilm) -> FilmProgress:
    """How far it is made, by whoever asked for it."""
    return await services.lanes.jobs.run(_progress, services, film_key(film))


def _progress(services: Services, key: str) -> FilmProgress:
    if services.results.find(result_name("film", key)) is not None:
        return FilmProgress(ready=True, share=1.0)
    with services.database.read() as session:
        job = JobRepository(session).open_of(key)
    return FilmProgress(ready=False, share=0.0 if job is None else min(0.99, services.board.progress(job.id)))


def film_key(film: EpisodeFilm | LapseFilm) -> str:
    """Says what decides how it looks: all that it shows, what draws it, and the player that it is for."""
    drawn_by = f"{simulator()} {importlib.metadata.version('viser')}"
    return f"film-{hashlib.sha256(f'{drawn_by} {film.model_dump_json()}'.encode()).hexdigest()[:48]}"


def _can_be_made(services: Services, key: str, subjects: Sequence[Subject]) -> bool:
    """Whether the film, or all that it is made of, is there."""
    find = services.results.find
    if find(result_name("film", key)) is not None:
        return True
    # All of them, so that each counts as looked at.
    recordings = [find(result_name("replay", recording_key(subject))) for subject in subjects]
    return None not in recordings


def _title(subjects: Sequence[Subject]) -> str:
    others = f" and {len(subjects) - 1} more" if len(subjects) > 1 else ""
    return f"{subjects[0].title}{others}"

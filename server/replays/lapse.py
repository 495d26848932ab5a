"""Time lapses: a run's checkpoints on the same scenarios, one after another."""

from collections.abc import Sequence

import numpy as np

from server.checkpoints.repository import CheckpointRepository
from server.checkpoints.spread import spread
from server.errors import NotFoundError
from server.replays.films import filmed_policy
from server.replays.page import LapseCaption
from server.replays.references import Reference
from server.replays.schemas import Lapse, LapseChapter
from server.replays.subject import Subject
from server.runs.repository import RunRepository
from server.services import Services
from workers.film_protocol import MAX_CHAPTERS, MAX_ROBOTS, FilmedChapter, LapseFilm
from workers.replays.recording import Recording
from workers.scene.themes import Theme
from workers.wording import counted, percent

_LONGEST_SECONDS = 6.0
# The picture at the end of each chapter.
_PAUSE_SECONDS = 1.5


def checkpoints_of(services: Services, run_id: str) -> list[Reference]:
    """The checkpoints that a run's time lapse shows: whole, and measured on the suite that its last one was measured on.

    Raises:
        NotFoundError: there is no such run, or none of its checkpoints was measured.
    """
    with services.database.read() as session:
        RunRepository(session).check(run_id)
        steps = [step for step in CheckpointRepository(session).steps(run_id) if step.suite_hash is not None]
    if not steps:
        raise NotFoundError("No checkpoint of this run was evaluated yet: there is nothing to look back at.")
    alike = [step for step in steps if step.suite_hash == steps[-1].suite_hash]
    return [Reference("checkpoint", step.id) for step in spread(alike, MAX_CHAPTERS)]


def described(run_id: str, subjects: Sequence[Subject], recordings: Sequence[Recording]) -> Lapse:
    """What a time lapse shows, and when."""
    scenarios = _scenarios(recordings[0])
    return Lapse(
        suite=subjects[0].recorded.suite,
        scenarios=len(scenarios),
        page=f"/replays/lapses/{run_id}/",
        chapters=[
            LapseChapter(step=subject.step, success=_success(recording), begins=begins)
            for subject, recording, (begins, _) in zip(
                subjects, recordings, _times(subjects, recordings, scenarios), strict=True
            )
        ],
    )


def filmed(subjects: Sequence[Subject], recordings: Sequence[Recording], theme: Theme) -> tuple[LapseFilm, LapseCaption]:
    """The film of a time lapse, and what stands over its picture."""
    scenarios = _scenarios(recordings[0])
    times = _times(subjects, recordings, scenarios)
    chapters = tuple(
        FilmedChapter(policy=filmed_policy(subject), begins=begins, lasts=lasts)
        for subject, (begins, lasts) in zip(subjects, times, strict=True)
    )
    said = [
        (begins, f"Step {counted(subject.step)}: {percent(_success(recording))} of all arrive")
        for subject, recording, (begins, _) in zip(subjects, recordings, times, strict=True)
    ]
    run = subjects[-1].title.removesuffix(f", step {counted(subjects[-1].step)}")  # its checkpoints come one after another
    caption = LapseCaption(run, subjects[0].recorded.suite, len(scenarios), said)
    return LapseFilm(theme=theme, scenarios=tuple(scenarios), chapters=chapters), caption


def _scenarios(recording: Recording) -> list[int]:
    """Some in one arena: the one in which most begin."""
    arenas = recording.arena_indices
    most = int(np.bincount(arenas).argmax())
    return spread(np.flatnonzero(arenas == most).tolist(), MAX_ROBOTS)


def _times(
    subjects: Sequence[Subject], recordings: Sequence[Recording], scenarios: Sequence[int]
) -> list[tuple[float, float]]:
    """When each chapter begins, and how long it lasts, seconds: as long as its longest episode, or less, by going faster."""
    found, begins = [], 0.0
    for subject, recording in zip(subjects, recordings, strict=True):
        steps = max(recording.evaluation.episodes[scenario].steps for scenario in scenarios)
        lasts = min(_LONGEST_SECONDS, steps * subject.task.control_period)
        found.append((round(begins, 3), lasts))
        begins += lasts + _PAUSE_SECONDS
    return found


def _success(recording: Recording) -> float:
    episodes = recording.evaluation.episodes
    return sum(episode.outcome == "arrival" for episode in episodes) / len(episodes)

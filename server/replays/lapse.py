"""Time lapses: a run's checkpoints on the same scenarios, one after another."""

from collections.abc import Sequence

import numpy as np

from server.checkpoints.repository import CheckpointRepository
from server.checkpoints.spread import spread
from server.errors import NotFoundError
from server.replays.page import LapseCaption, replay_page
from server.replays.references import Reference
from server.replays.schemas import Lapse, LapseChapter
from server.replays.service import Part
from server.runs.repository import RunRepository
from server.scene.themes import Theme
from server.services import Services
from workers.replays.recording import Recording

MOST_CHECKPOINTS = 8
"""In a time lapse, evenly apart, the first and the last among them."""
MOST_ROBOTS = 8
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
    return [Reference("checkpoint", step.id) for step in spread(alike, MOST_CHECKPOINTS)]


def described(run_id: str, steps: Sequence[int], parts: Sequence[Part]) -> Lapse:
    """What a time lapse shows, and when."""
    scenarios = _scenarios(parts[0].recording)
    return Lapse(
        suite=parts[0].subject.recorded.suite,
        scenarios=len(scenarios),
        page=f"/replays/lapses/{run_id}/",
        chapters=[
            LapseChapter(step=step, success=_success(part.recording), begins=begins)
            for step, part, (begins, _) in zip(steps, parts, _times(parts, scenarios), strict=True)
        ],
    )


def filmed(title: str, steps: Sequence[int], parts: Sequence[Part], theme: Theme) -> str:
    """The time lapse's player as HTML that needs nothing else; takes some seconds."""
    # viser takes a second to import, so nobody pays for it before somebody looks.
    from server.replays.film import Filmed
    from server.replays.lapse_film import Chapter, film_lapse

    scenarios = _scenarios(parts[0].recording)
    times = _times(parts, scenarios)
    chapters = [
        Chapter(
            [
                Filmed(part.recording.track(scenario), part.recording.evaluation.episodes[scenario], part.subject.task)
                for scenario in scenarios
            ],
            begins,
            lasts,
        )
        for part, (begins, lasts) in zip(parts, times, strict=True)
    ]
    said = [
        (begins, f"Step {step:,}: {_success(part.recording):.0%} of all arrive")
        for step, part, (begins, _) in zip(steps, parts, times, strict=True)
    ]
    caption = LapseCaption(title, parts[0].subject.recorded.suite, len(scenarios), said)
    return replay_page(theme, film_lapse(chapters, theme), caption.html())


def _scenarios(recording: Recording) -> list[int]:
    """Some in one arena: the one in which most begin."""
    arenas = recording.arena_indices
    most = int(np.bincount(arenas).argmax())
    return spread(np.flatnonzero(arenas == most).tolist(), MOST_ROBOTS)


def _times(parts: Sequence[Part], scenarios: Sequence[int]) -> list[tuple[float, float]]:
    """When each chapter begins, and how long it lasts, seconds: as long as its longest episode, or less, by going faster."""
    found, begins = [], 0.0
    for part in parts:
        steps = max(part.recording.evaluation.episodes[scenario].steps for scenario in scenarios)
        lasts = min(_LONGEST_SECONDS, steps * part.subject.task.control_period)
        found.append((round(begins, 3), lasts))
        begins += lasts + _PAUSE_SECONDS
    return found


def _success(recording: Recording) -> float:
    episodes = recording.evaluation.episodes
    return sum(episode.outcome == "arrival" for episode in episodes) / len(episodes)

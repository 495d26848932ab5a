"""What a person may do with the episodes of an evaluation: look at any of them, and take it away."""

from server.errors import NotFoundError
from server.replays.page import Caption, replay_page
from server.replays.schemas import Replay
from server.replays.subject import Subject
from server.scene.themes import Theme
from workers.replays.recording import Recording


def check_episode(subject: Subject, episode: int) -> None:
    """Whether there is such an episode.

    Raises:
        NotFoundError: there is not.
    """
    count = len(subject.recorded.episodes)
    if not 0 <= episode < count:
        raise NotFoundError(f"This evaluation has {count} episodes, 0 to {count - 1}: there is no {episode}.")


def prepared(subject: Subject, recording: Recording, episode: int, page: str) -> Replay:
    """An episode that was driven again, so that its page opens at once.

    Args:
        subject: whose.
        recording: of its evaluation.
        episode: its place in the suite, from 0.
        page: path of the player.
    """
    found = recording.evaluation.episodes[episode]
    return Replay(
        episode=episode,
        suite=subject.recorded.suite,
        outcome=found.outcome,
        steps=found.steps,
        seconds=found.steps * subject.task.control_period,
        faithful=_faithful(subject, recording, episode),
        page=page,
    )


def filmed(subject: Subject, recording: Recording, episode: int, theme: Theme) -> str:
    """The episode's player as HTML that needs nothing else; takes about half a second."""
    # viser takes a second to import, so nobody pays for it before somebody looks.
    from server.replays.film import film

    result = recording.evaluation.episodes[episode]
    caption = Caption(
        title=subject.title,
        suite=subject.recorded.suite,
        episode=episode,
        result=result,
        seconds=result.steps * subject.task.control_period,
        faithful=_faithful(subject, recording, episode),
    )
    return replay_page(theme, film(recording.track(episode), result, subject.task, theme), caption)


def _faithful(subject: Subject, recording: Recording, episode: int) -> bool:
    again, then = recording.evaluation.episodes[episode], subject.recorded.episodes[episode]
    return (again.outcome, again.steps) == (then.outcome, then.steps)

"""What a person may do with episodes that were measured: look at any, alone or beside others', and take it away."""

from collections.abc import Sequence
from dataclasses import dataclass

from server.errors import ConflictError, NotFoundError
from server.replays.page import Caption, Driver
from server.replays.references import Reference
from server.replays.schemas import EpisodeReplay, EpisodeSeries, PolicySeries, Replay, ReplayedPolicy
from server.replays.series import series_of, times
from server.replays.subject import Subject
from workers.replays.recording import Recording
from workers.scene.themes import css_colour


@dataclass(frozen=True)
class Part:
    """One policy of a replay: how addresses name it, whose it is, and all that it did."""

    reference: Reference
    subject: Subject
    recording: Recording


def check_episode(subjects: Sequence[Subject], episode: int) -> None:
    """Whether there is such an episode, and whether it is the same scenario of all.

    Raises:
        NotFoundError: there is not.
        ConflictError: they were measured on different suites.
    """
    if len({subject.recorded.suite_hash for subject in subjects}) > 1:
        raise ConflictError("These were measured on different suites: no scenario is the same for all of them.")
    count = len(subjects[0].recorded.episodes)
    if not 0 <= episode < count:
        raise NotFoundError(f"This evaluation has {count} episodes, 0 to {count - 1}: there is no {episode}.")


def page_of(references: Sequence[Reference], episode: int) -> str:
    """Path of the player, without the theme."""
    return f"/replays/{','.join(map(str, references))}/{episode}/"


def prepared(part: Part, episode: int) -> Replay:
    """An episode of one policy that was driven again, so that its page opens at once."""
    found = part.recording.evaluation.episodes[episode]
    return Replay(
        episode=episode,
        suite=part.subject.recorded.suite,
        outcome=found.outcome,
        steps=found.steps,
        seconds=found.steps * part.subject.task.control_period,
        faithful=_faithful(part, episode),
        page=page_of([part.reference], episode),
    )


def together(parts: Sequence[Part], episode: int) -> EpisodeReplay:
    """One scenario that one policy or several drove again, so that its page opens at once."""
    policies = [
        ReplayedPolicy(
            of=str(part.reference),
            title=part.subject.title,
            colour=css_colour(place),
            outcome=found.outcome,
            steps=found.steps,
            seconds=found.steps * part.subject.task.control_period,
            faithful=_faithful(part, episode),
        )
        for place, part in enumerate(parts)
        for found in [part.recording.evaluation.episodes[episode]]
    ]
    return EpisodeReplay(
        episode=episode,
        suite=parts[0].subject.recorded.suite,
        seconds=max(policy.seconds for policy in policies),
        page=page_of([part.reference for part in parts], episode),
        policies=policies,
    )


def charted(parts: Sequence[Part], episode: int) -> EpisodeSeries:
    """The numbers of that scenario over time."""
    found = []
    for part in parts:
        track, task = part.recording.track(episode), part.subject.task
        found.append(PolicySeries(of=str(part.reference), times=times(track, task), series=series_of(track, task)))
    return EpisodeSeries(policies=found)


def captioned(parts: Sequence[Part], episode: int) -> Caption:
    """What stands over the picture of a scenario."""
    results = [part.recording.evaluation.episodes[episode] for part in parts]
    drivers = [
        Driver(
            title=part.subject.title,
            result=result,
            seconds=result.steps * part.subject.task.control_period,
            faithful=_faithful(part, episode),
        )
        for part, result in zip(parts, results, strict=True)
    ]
    return Caption(parts[0].subject.recorded.suite, episode, drivers)


def _faithful(part: Part, episode: int) -> bool:
    again, then = part.recording.evaluation.episodes[episode], part.subject.recorded.episodes[episode]
    return (again.outcome, again.steps) == (then.outcome, then.steps)

"""Recordings that are there before anybody asks for them, so that the first look at an episode comes at once."""

import logging
from typing import get_args

from server.checkpoints.repository import CheckpointRepository
from server.errors import ServiceError
from server.evaluations.repository import PolicyEvaluationRepository
from server.evaluations.service import replayed
from server.jobs.names import result_name
from server.jobs.service import JobService
from server.replays.films import episode_film, film_asked_for
from server.replays.recordings import asked_for, recording_key
from server.replays.subjects import checkpoint_subject
from server.runs.repository import RunRepository
from server.services import Services
from workers.job_protocol import CheckpointPolicy, ReplayJob
from workers.reporting import EpisodeResult, Outcome
from workers.scene.themes import Theme

logger = logging.getLogger(__name__)

_WORST_FIRST: tuple[Outcome, ...] = ("collision", "timeout", "arrival")


def key_of_evaluation(services: Services, job_id: str) -> str | None:
    """Under which key the episodes of what a job measured are asked for; None where its evaluation is gone."""
    with services.database.read() as session:
        evaluation_id = PolicyEvaluationRepository(session).measured_by(job_id)
    return None if evaluation_id is None else recording_key(replayed(services, evaluation_id))


def make_ahead(services: Services, run_id: str) -> None:
    """Have the last evaluation of a run that is complete driven again, once no one waits for anything else. Blocks.

    Nothing is made of a study's trials, which come by the hundred and are seldom looked at one by one, nor what is kept
    already. Where too much waits, or anything else is in the way, it is left to the first who looks.
    """
    try:
        with services.database.read() as session:
            run = RunRepository(session).get(run_id)
            measured = [step for step in CheckpointRepository(session).steps(run_id) if step.suite_hash is not None]
            if not measured or run.experiment.study_id is not None:
                return
        subject = checkpoint_subject(services, measured[-1].id)
        if services.results.peek(result_name("replay", recording_key(subject))) is None:
            JobService(services).ask(asked_for(subject, ahead=True))
    except ServiceError as error:
        logger.info("run %s: its episodes are not made ahead: %s", run_id, error.message)


def draw_ahead(services: Services, spec: ReplayJob) -> None:
    """Have the worst and the best of a checkpoint's episodes, made ahead, drawn in 3D, in either theme. Blocks."""
    if not isinstance(spec.policy, CheckpointPolicy):
        return
    try:
        subject = checkpoint_subject(services, spec.policy.id)
        ranks = [_rank(index, episode) for index, episode in enumerate(subject.recorded.episodes)]
        jobs = JobService(services)
        for _, _, episode in sorted({min(ranks), max(ranks)}):
            for theme in get_args(Theme):
                asked = film_asked_for(episode_film([subject], episode, "scene", theme), [subject], ahead=True)
                if services.results.peek(result_name("film", asked.key)) is None:
                    jobs.ask(asked)
    except ServiceError as error:
        logger.info("checkpoint %s: its episodes are not drawn ahead: %s", spec.policy.id, error.message)


def _rank(index: int, episode: EpisodeResult) -> tuple[int, float, int]:
    """Its place in the list of episodes as pages show it: failures first, then the narrowest; the last is its number."""
    return _WORST_FIRST.index(episode.outcome), episode.min_clearance, index

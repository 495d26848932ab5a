"""Recordings that come along with an evaluation, so that the first look at an episode comes at once."""

from server.evaluations.repository import PolicyEvaluationRepository
from server.evaluations.service import replayed
from server.replays.recordings import recording_key
from server.services import Services


def key_of_evaluation(services: Services, job_id: str) -> str | None:
    """Under which key the episodes of what a job measured are asked for; None where its evaluation is gone."""
    with services.database.read() as session:
        evaluation_id = PolicyEvaluationRepository(session).measured_by(job_id)
    return None if evaluation_id is None else recording_key(replayed(services, evaluation_id))

"""Finds whose episodes are to be replayed: a checkpoint's, an evaluation's, or a shipped policy's."""

from server.checkpoints.repository import CheckpointRepository, evaluation_result
from server.checkpoints.service import CheckpointService
from server.checkpoints.views import policy_title
from server.errors import NotFoundError
from server.evaluations.service import replayed
from server.experiments.stored import training_of
from server.policies.service import find, shipped_hash
from server.replays.references import Reference
from server.replays.subject import Subject
from server.runs.repository import RunRepository
from server.services import Services
from workers.errors import UnknownPolicyError
from workers.job_protocol import OWN_SUITE, CheckpointPolicy, NamedSuite, ShippedPolicyName


def subject_of(services: Services, reference: Reference) -> Subject:
    """What an address of replays names.

    Raises:
        NotFoundError: there is nothing of that name, or it was not measured.
    """
    if reference.kind == "checkpoint":
        return checkpoint_subject(services, reference.id)
    if reference.kind == "evaluation":
        return replayed(services, reference.id)
    return policy_subject(reference.id, reference.suite)


def checkpoint_subject(services: Services, checkpoint_id: str) -> Subject:
    """A checkpoint on the suite of its training.

    Raises:
        NotFoundError: there is no such checkpoint, or it was not evaluated.
    """
    with services.database.read() as session:
        checkpoints = CheckpointRepository(session)
        checkpoint = checkpoints.get(checkpoint_id)
        run = RunRepository(session).get(checkpoint.run_id)
        recorded = evaluation_result(checkpoints.evaluation(checkpoint_id))
        title = policy_title(run, checkpoint)
        training = training_of(run.experiment)
    archive = CheckpointService(services).described(checkpoint_id)
    return Subject(
        title=title,
        file_name=archive.file_name,
        task=training.task,
        sha256=archive.sha256,
        suite=OWN_SUITE,
        recorded=recorded,
        policy=CheckpointPolicy(id=checkpoint_id),
        step=checkpoint.step,
    )


def policy_subject(name: str, suite: str) -> Subject:
    """A shipped policy on one of its suites.

    Raises:
        NotFoundError: there is no such policy, or it was not measured on that suite.
    """
    policy = find(name)
    try:
        recorded = policy.evaluation(suite)
    except UnknownPolicyError as error:
        raise NotFoundError(f"The policy {name} was not measured on {suite}.") from error
    return Subject(
        title=policy.card.title,
        file_name=f"mapless-{name}.zip",
        task=policy.card.training.task,
        sha256=shipped_hash(name),
        suite=NamedSuite(name=suite),
        recorded=recorded,
        policy=ShippedPolicyName(name=name),
    )

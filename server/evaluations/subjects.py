"""What is measured: a policy's name for people, its archive's hash, and whose it is."""

from collections.abc import Sequence
from dataclasses import dataclass

from sqlalchemy.orm import Session

from server.checkpoints.repository import CheckpointRepository
from server.checkpoints.views import policy_title
from server.database import tables
from server.errors import NotFoundError
from server.evaluations.schemas import TrainingPolicies
from server.experiments.repository import ExperimentRepository
from server.experiments.stored import read_training
from server.policies.service import find, shipped_hash
from server.runs.repository import RunRepository
from server.security.principal import Principal
from server.uploads.repository import UploadRepository
from sim.config import TaskConfig
from workers.job_protocol import (
    AnyPolicy,
    ArenaSuite,
    BaselineName,
    CheckpointPolicy,
    NamedSuite,
    OwnSuite,
    ScenarioSuite,
    SuiteChoice,
    UploadedPolicy,
)


@dataclass(frozen=True)
class Measured:
    """A policy or a baseline.

    Attributes:
        title: for people.
        sha256: of its archive; None for a baseline.
        project_id: whose it is; None for what is everybody's.
        task: that it drives; None for a baseline, which takes what a suite asks for, and where it can't be read here.
    """

    title: str
    sha256: str | None
    project_id: str | None = None
    task: TaskConfig | None = None


def wanted_policies(
    session: Session, policies: Sequence[AnyPolicy | TrainingPolicies], principal: Principal
) -> list[tuple[AnyPolicy, Measured]]:
    """What somebody wants to have measured: a training stands for the best checkpoint of each of its runs.

    Raises:
        NotFoundError: there is no such policy, or it may not be seen, or none of the training's runs has a checkpoint.
    """
    found: list[tuple[AnyPolicy, Measured]] = []
    for policy in policies:
        if isinstance(policy, UploadedPolicy):
            upload = UploadRepository(session).get(policy.id)
            whole = policy.model_copy(update={"task": TaskConfig.model_validate(upload.task)})
            found.append((whole, measured(session, whole)))
        elif isinstance(policy, TrainingPolicies):
            best = _best_of(session, policy.id)
            found += [(each, measured(session, each)) for each in best]
        else:
            found.append((policy, measured(session, policy)))
    for policy, subject in found:
        if subject.project_id is not None and principal.role_in(subject.project_id) is None:
            what = "checkpoint" if isinstance(policy, CheckpointPolicy) else "uploaded policy"
            raise NotFoundError.of(what, policy.id if isinstance(policy, CheckpointPolicy | UploadedPolicy) else "")
    return found


def suite_title(choice: SuiteChoice) -> str:
    """What a suite is called before its scenarios are drawn."""
    match choice:
        case OwnSuite():
            return "its own suite"
        case ArenaSuite():
            difficulty = getattr(choice.arena, "difficulty", None)
            return choice.arena.name if difficulty is None else f"{choice.arena.name} {difficulty:g}"
        case ScenarioSuite():
            return choice.title
        case NamedSuite():
            return choice.name


def _best_of(session: Session, experiment_id: str) -> list[CheckpointPolicy]:
    experiment = ExperimentRepository(session).get(experiment_id)
    checkpoints = CheckpointRepository(session)
    best = [found[0] for run in experiment.runs if (found := checkpoints.best(run.id)) is not None]
    if not best:
        raise NotFoundError(f"No run of “{experiment.name}” has an evaluated checkpoint yet.")
    return [CheckpointPolicy(id=checkpoint.id) for checkpoint in best]


def measured(session: Session, policy: AnyPolicy) -> Measured:
    """What is known of a policy.

    Raises:
        NotFoundError: there is no such policy.
    """
    if isinstance(policy, BaselineName):
        return Measured(policy.name, None, task=policy.task)
    if isinstance(policy, CheckpointPolicy):
        checkpoint = CheckpointRepository(session).get(policy.id)
        run = RunRepository(session).get(checkpoint.run_id)
        return Measured(
            policy_title(run, checkpoint), checkpoint.sha256, run.experiment.project_id, _task_of(run.experiment)
        )
    if isinstance(policy, UploadedPolicy):
        upload = UploadRepository(session).get(policy.id)
        return Measured(upload.name, upload.sha256, upload.project_id, policy.task)
    shipped = find(policy.name)
    return Measured(shipped.card.title, shipped_hash(policy.name), task=shipped.card.training.task)


def _task_of(experiment: tables.Experiment) -> TaskConfig | None:
    stored = read_training(experiment.training)
    return None if stored.unreadable else stored.training.task

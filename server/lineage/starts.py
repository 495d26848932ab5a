"""The policy that a training is to begin with: looked up at launch, handed to the worker that takes it up."""

from collections.abc import Iterator
from typing import NoReturn

from sqlalchemy.orm import Session

from server.checkpoints.views import policy_title
from server.errors import NotFoundError, RefusedFieldError
from server.experiments.stored import read_training
from server.files import FileStore
from server.lineage.repository import LineageRepository
from server.policies.service import find, shipped_hash
from server.security.principal import Principal
from workers.config import TrainingConfig
from workers.misfit import misfit
from workers.start import StartFrom

_FIELD = ("body", "training", "start_from")
_BLOCK = 256 * 1024


def with_start(training: TrainingConfig, session: Session, files: FileStore, principal: Principal) -> TrainingConfig:
    """The training with the hash and the title of the policy that it begins with, if it begins with one.

    Raises:
        RefusedFieldError: there is no such policy for whoever launches, it is not the one that was meant, or does not fit.
    """
    if training.start_from is None:
        return training
    start, theirs = _found(training.start_from, session, files, principal)
    if training.start_from.sha256 not in (None, start.sha256):
        _refuse(f"{start.title} is not what it was when its hash was written down: choose it anew.")
    if (problem := misfit(theirs, training)) is not None:
        _refuse(f"{start.title} does not fit: {problem}. Take over its settings, or choose another policy.")
    return training.model_copy(update={"start_from": start})


def start_archive(start: StartFrom, files: FileStore) -> Iterator[bytes]:
    """The archive of a policy, by what was written down at launch; that of a checkpoint outlives the checkpoint.

    Raises:
        NotFoundError: it is gone, or another one ships by now.
    """
    if start.source == "checkpoint":
        return files.read(start.name)
    policy = find(start.name)
    if shipped_hash(start.name) != start.sha256:
        raise NotFoundError(f"The shipped policy {start.name} is another one by now: launch the training anew.")
    return _blocks(policy.archive.read_bytes())


def _found(start: StartFrom, session: Session, files: FileStore, principal: Principal) -> tuple[StartFrom, TrainingConfig]:
    if start.source == "shipped":
        try:
            card = find(start.name).card
        except NotFoundError as error:
            _refuse(error.message)
        found = StartFrom(source="shipped", name=start.name, sha256=shipped_hash(start.name), title=card.title)
        return found, card.training
    if start.source == "file":
        _refuse("A file on another machine is not here: choose a checkpoint, or a policy that ships.")
    row = LineageRepository(session).checkpoint(start.name)
    if row is None or principal.role_in(row[1].experiment.project_id) is None:
        _refuse(f"There is no checkpoint {start.name}; it may have been deleted. Choose another policy.")
    checkpoint, run = row
    title = policy_title(run, checkpoint)
    if checkpoint.damaged_at is not None:
        _refuse(f"The archive of {title} is damaged: choose another checkpoint.")
    try:
        files.open(checkpoint.id).close()
    except NotFoundError:
        _refuse(f"The archive of {title} is gone: choose another checkpoint.")
    stored = read_training(run.experiment.training)
    if stored.unreadable:
        _refuse(f"{title} can't be taken over. {stored.why_not}")
    return StartFrom(source="checkpoint", name=checkpoint.id, sha256=checkpoint.sha256, title=title), stored.training


def _refuse(message: str) -> NoReturn:
    raise RefusedFieldError(_FIELD, message)


def _blocks(data: bytes) -> Iterator[bytes]:
    for start in range(0, len(data), _BLOCK):
        yield data[start : start + _BLOCK]
